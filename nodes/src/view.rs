//! `view`: a web page of a running node.

mod access;
mod curves;
mod feed;
mod files;
mod http;
mod jitter;
mod pages;
mod plant;
mod refusals;
mod response;
mod routes;
mod server;
mod shared;
mod silence;
mod stream;
mod threads;
mod writes;

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use isochrone_control::running_nodes;
use isochrone_cyclic::{Clock, Monotonic};

use self::access::Access;
use self::pages::{Pages, RequestedSignals};
use self::plant::Plant;
use self::server::Listeners;
use self::shared::View;
use self::silence::Silence;
use self::threads::locked;
use self::writes::Writer;
use crate::base::failure::Failure;
use crate::base::session::{Asker, Session, Wish};
use crate::base::{domain, stop, terminal};
use crate::operate::{NodeArgs, client};

/// Show a running node on a web page: live curves, values, alarms and jitter
///
/// Serves a page on this machine's own addresses (127.0.0.1 and ::1) and prints its URL. The page needs no
/// network and loads nothing from elsewhere. Curves have the least and the greatest value of each thirtieth of
/// a second, from every cycle: no spike is lost. However many pages are open, the node is asked once. If it ends,
/// the page says so and goes on when it is back. With --allow-write, parameters can be set and alarms acknowledged; whoever has the
/// printed URL can do it.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone view\n  isochrone view level --port 0\n  \
    isochrone view level --allow-write\n\n\
    From another machine: ssh -L 8080:localhost:8080 HOST, then open http://localhost:8080/ here; the port has to \
    be the same on both sides. Anybody with an account on this machine can read the page while it is served.")]
pub(crate) struct Args {
    /// Name of the running node, as `[node] name` gives it; default: the only one that runs
    node: Option<String>,
    /// TCP port; 0: any free one
    #[arg(long, value_name = "N", default_value_t = 8080)]
    port: u16,
    /// Let the page set parameters; the URL then has a token that changes need
    #[arg(long)]
    allow_write: bool,
    #[command(flatten)]
    domain: domain::Args,
}

/// Between two looks for news of the node.
const TURN: Duration = Duration::from_millis(20);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let stop = stop::on_signal(None)?;
    let node = NodeArgs { node: node(args)?, domain: args.domain.clone() };
    let listeners = Listeners::bind(args.port)?;
    let port = listeners.port;
    let token = if args.allow_write { Some(access::token().map_err(no_token)?) } else { None };
    let asker = Asker { verb: "view", client: client().map(|user| format!("{user} (view)")) };
    let session = Session::start(node.clone(), asker.clone())?;
    let url = match &token {
        // The part after # stays in the browser.
        Some(token) => format!("http://127.0.0.1:{port}/#token={token}"),
        None => format!("http://127.0.0.1:{port}/"),
    };
    let writer = args.allow_write.then(|| Writer {
        args: node.clone(),
        asker,
        is_over: stop.flag(),
        wishes: session.wishes(),
        turn: Mutex::default(),
    });
    let view = Arc::new(View {
        port,
        access: Access::new(port, token),
        pages: Pages::default(),
        plant: Mutex::new(Plant::new()),
        curves: Mutex::default(),
        jitter: Mutex::default(),
        refused: Mutex::default(),
        writer,
        is_over: stop.flag(),
        silence: Silence::new(),
    });
    while !locked(&view.plant).is_known() && !stop.is_due() {
        match session.news()? {
            Some(news) => view.take(news),
            None => thread::sleep(TURN),
        }
    }
    feed::start(&node, &view)?;
    listeners.serve(&view)?;
    terminal::print(&format!("{url}\n"))?;
    let mut watched = Vec::new();
    while !stop.is_due() {
        let now_ns = Monotonic.now_ns();
        while let Some(news) = session.news()? {
            view.take(news);
        }
        locked(&view.curves).close(now_ns);
        locked(&view.jitter).tick(now_ns);
        let mut plant = locked(&view.plant);
        let is_silent = view.silence.lasts(now_ns, plant.longest_wait_ns());
        if is_silent != plant.is_silent() {
            plant.set_silent(is_silent.then(|| silence::why(&node.node, session.process())));
        }
        let RequestedSignals { names, left_out } = view.pages.values(|name| plant.needed(name));
        plant.set_left_out(left_out);
        drop(plant);
        if watched != names {
            watched.clone_from(&names);
            session.wish(Wish::Watch(names));
        }
        thread::sleep(TURN);
    }
    Ok(())
}

/// The node: the one that is named, or the only one that runs.
fn node(args: &Args) -> Result<String, Failure> {
    if let Some(node) = &args.node {
        return Ok(node.clone());
    }
    let participant = args.domain.join("isochrone/view")?;
    let running = running_nodes(&participant).map_err(Failure::found)?;
    match &running[..] {
        [] => Err(Failure::nobody(domain::nothing_runs("no node", &participant.domain()))),
        [only] => Ok(only.name.clone()),
        several => {
            let names: Vec<_> = several.iter().map(|node| node.name.as_str()).collect();
            Err(Failure::usage(format!("several nodes run here; name one: {}", names.join(", "))))
        }
    }
}

fn no_token(error: std::io::Error) -> Failure {
    Failure::found(format!("cannot make a token out of /dev/urandom: {error}"))
}
