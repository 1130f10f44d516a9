//! `top`: a running node on the screen.

mod asking;
mod cursor;
mod dialog;
#[cfg(test)]
mod fixtures;
mod history;
mod input;
mod message;
mod model;
mod palette;
mod screen;
mod signals;
mod trace;
mod view;

use std::io;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_processes::Stop;
use ratatui::crossterm::event::{self, Event};

pub(crate) use self::palette::Palette;
pub(crate) use self::screen::{Screen, Wait, restore, wait};
pub(crate) use self::view::{cut, cut_name};

use self::input::{Action, Focus, action};
use self::model::Model;
use crate::base::failure::Failure;
use crate::base::session::{Asker, Session, Wish};
use crate::base::stop;
use crate::operate::{NodeArgs, client};

/// Show a running node on the screen: signals, tasks, alarms and forces
///
/// Shows the value of each signal with its unit, quality and trend, and the jitter of the tasks over the
/// last second and the last minute. Sets parameters, forces signals, releases forces and takes changes
/// back. Press ? for the keys.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone top level\n  NO_COLOR=1 isochrone top level\n\n\
    Marks: F is forced, f is computed from what is forced, ! is an input that is not ok or a pin of a block in error, ? is computed from such. NO_COLOR turns colour \
    off. If the node ends, top waits for it and goes on.")]
pub(crate) struct Args {
    #[command(flatten)]
    node: NodeArgs,
}

/// Between two looks for news and signals while no key is pressed.
const TURN: Duration = Duration::from_millis(50);
/// Between two drawings while no key is pressed.
const DRAW_INTERVAL: Duration = Duration::from_millis(200);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    Screen::check()?;
    let stop = stop::on_signal_after(None, screen::restore)?;
    let session = Session::start(args.node.clone(), Asker { verb: "top", client: client() })?;
    let mut screen = Screen::open()?;
    let shown = show(&mut screen, &session, &stop);
    drop(screen);
    // The session may be waiting for the domain's lock.
    stop.request();
    shown
}

/// Shows the node until it is enough.
fn show(screen: &mut Screen, session: &Session, stop: &Stop) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::found(format!("cannot use the terminal: {error}"));
    let palette = Palette::of_environment();
    let terminal = &mut screen.terminal;
    let mut model = Model::default();
    let mut watched = Vec::new();
    let mut next_draw = Instant::now();
    while !stop.is_due() {
        while let Some(news) = session.news()? {
            model.take(news);
        }
        model.tick(Monotonic.now_ns());
        if Instant::now() >= next_draw {
            next_draw = Instant::now() + DRAW_INTERVAL;
            let size = terminal.size().map_err(failed)?;
            model.set_rows(view::rows(size.into(), &model));
            terminal.draw(|frame| view::draw(frame, &model, palette)).map_err(failed)?;
        }
        let wanted = model.watched();
        if watched != wanted {
            watched.clone_from(&wanted);
            session.wish(Wish::Watch(wanted));
        }
        if screen::wait(TURN).map_err(failed)? == Wait::HungUp {
            return Ok(());
        }
        let mut waiting = event::poll(Duration::ZERO).map_err(failed)?;
        while waiting {
            // A new size is drawn as a key's effect is: at once.
            next_draw = Instant::now();
            if let Event::Key(key) = event::read().map_err(failed)? {
                let is_shown = view::fits(terminal.size().map_err(failed)?.into());
                // What cannot be seen is not operated.
                let focus = if is_shown { model.focus() } else { Focus::List };
                match action(focus, key) {
                    Some(Action::Quit) => return Ok(()),
                    Some(Action::Redraw) => terminal.clear().map_err(failed)?,
                    Some(action) if is_shown => {
                        if let Some(order) = model.act(action) {
                            session.order(order);
                        }
                    }
                    _ => {}
                }
            }
            waiting = event::poll(Duration::ZERO).map_err(failed)?;
        }
    }
    Ok(())
}
