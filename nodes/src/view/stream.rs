//! The server-sent events of a page, for as long as it is open.
//!
//! Nothing waits for a page: each has a thread that looks at what is known, tells what is new since its last
//! look, and gives up if nobody takes it, or if the page is not heard of any more.

use std::collections::HashMap;
use std::io::{self, ErrorKind, Write};
use std::net::TcpStream;
use std::sync::atomic::Ordering;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use serde_json::{Map, Value, json};

use super::curves::INTERVAL_NS;
use super::pages::{MAX_PAGES, Open};
use super::plant::{Line, Text};
use super::response::{self, Response};
use super::shared::View;
use super::threads::locked;

/// Between two looks at what is new: thirty a second.
const LOOK_INTERVAL: Duration = Duration::from_nanos(INTERVAL_NS);
/// How long a browser may not read its events.
const PATIENCE: Duration = Duration::from_secs(5);
/// A connection whose other end is gone shows only when something is sent.
const SILENCE: Duration = Duration::from_secs(1);

/// Tells a page what is new until it is closed.
pub(super) fn serve(view: &View, stream: &TcpStream) -> io::Result<()> {
    let Some(page) = view.pages.open()? else {
        let full =
            format!("{MAX_PAGES} pages are open, which is as many as there can be; close one");
        return send(stream, Response::sentence(503, full).bytes(false));
    };
    let head = response::head(200, "text/event-stream; charset=utf-8") + "\r\n";
    let hello = json!({ "page": page.id, "writable": view.access.is_writable() });
    send(stream, &(head + &event("hello", &response::json(&hello))))?;
    let mut page_state = PageState::default();
    let mut spoke = Instant::now();
    while !view.is_over.load(Ordering::Relaxed) && page.is_alive(Instant::now()) {
        let mut news = page_state.news(view, &page);
        if news.is_empty() && spoke.elapsed() >= SILENCE {
            // A comment.
            news = ":\n\n".into();
        }
        if !news.is_empty() {
            send(stream, &news)?;
            spoke = Instant::now();
        }
        thread::sleep(LOOK_INTERVAL);
    }
    Ok(())
}

/// Sends a text whole, or fails when the other end takes nothing more.
pub(super) fn send(mut stream: &TcpStream, text: impl AsRef<[u8]>) -> io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut rest = text.as_ref();
    while !rest.is_empty() {
        match stream.write(rest) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(count) => rest = rest.get(count..).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

/// JSON has no line breaks of its own.
fn event(name: &str, json: &str) -> String {
    format!("event: {name}\ndata: {json}\n\n")
}

/// The state that a page has been sent.
#[derive(Default)]
struct PageState {
    versions: HashMap<&'static str, u64>,
    readings: u64,
    rows: HashMap<String, Option<Line>>,
    /// By the name of a curve the number of its newest interval.
    curves: HashMap<String, u64>,
}

impl PageState {
    fn news(&mut self, view: &View, page: &Open<'_>) -> String {
        let look = page.now();
        let mut news = String::new();
        let plant = locked(&view.plant);
        self.text("state", &plant.state, &mut news);
        self.text("alarms", &plant.alarms, &mut news);
        self.text("process", &plant.process, &mut news);
        self.text("forces", &plant.forced, &mut news);
        let has_rows = look.rows().iter().all(|name| self.rows.contains_key(name));
        if !has_rows || self.readings != plant.readings_version {
            self.readings = plant.readings_version;
            self.rows.retain(|name, _| look.rows().contains(name));
            let mut changed = Map::new();
            for name in look.rows() {
                let line = plant.line(name);
                if self.rows.get(name) != Some(&line) {
                    changed.insert(name.clone(), json!(line));
                    self.rows.insert(name.clone(), line);
                }
            }
            if !changed.is_empty() {
                news += &event("rows", &response::json(&changed));
            }
        }
        drop(plant);
        let (version, json) = locked(&view.jitter).shown();
        self.text("jitter", &Text { version, json }, &mut news);
        let refused = locked(&view.refused).clone();
        self.text("refused", &refused, &mut news);
        if !look.curves.is_empty() {
            news += &event("curves", &response::json(&self.curves(view, &look.curves)));
        }
        news
    }

    fn text(&mut self, name: &'static str, text: &Text, news: &mut String) {
        let version = self.versions.entry(name).or_default();
        if *version != text.version {
            *version = text.version;
            *news += &event(name, &text.json);
        }
    }

    fn curves(&mut self, view: &View, names: &[String]) -> Value {
        self.curves.retain(|name, _| names.contains(name));
        let curves = locked(&view.curves);
        let mut new = Map::new();
        for name in names {
            let number = self.curves.entry(name.clone()).or_default();
            let intervals = curves.since(name, *number);
            *number = curves.newest();
            if !intervals.is_empty() {
                new.insert(name.clone(), json!(intervals));
            }
        }
        drop(curves);
        json!({ "now": Monotonic.now_ns() as f64 / INTERVAL_NS as f64, "curves": new })
    }
}
