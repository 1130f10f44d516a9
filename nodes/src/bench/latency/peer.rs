//! The process at the other end: it sends at its own pace, or sends back what it gets.

use std::io::{BufRead, stdin};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use isochrone_cyclic::{ThreadRequest, prepare_process, prepare_thread};
use isochrone_ipc::{Domain, Participant, ipc};
use isochrone_timing::Warning;
use serde::{Deserialize, Serialize};

use super::arms::{Arm, Wait};
use super::end::{self, End, Place, Side};
use super::turn::{self, Sent, Span, Terms};
use crate::failure::Failure;
use crate::run::warning;
use crate::terminal;

/// The other process of `bench latency`, which starts it
#[derive(clap::Args)]
#[command(hide = true)]
pub(crate) struct Args {}

/// The first line that the peer reads.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Setup {
    pub(super) domain_file: PathBuf,
    pub(super) folder: PathBuf,
    pub(super) prefix: String,
    pub(super) arms: Vec<Arm>,
    pub(super) values: usize,
    pub(super) wait: Wait,
    pub(super) cpu: usize,
    pub(super) priority: Option<u8>,
}

/// Every further line: a turn.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Turn {
    /// Which of the arms.
    pub(super) arm: usize,
    pub(super) span: Span,
    /// Between two messages; `None`: send back what comes.
    pub(super) period_ns: Option<u64>,
}

/// What the peer writes: first that it is ready, then a line for each turn.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Reply {
    Ready(Vec<Warning>),
    Done(Sent),
    Failed(String),
}

pub(crate) fn run(_: &Args) -> Result<(), Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    let lines = read_lines(stop.clone());
    let Ok(setup) = lines.recv() else {
        return Err(Failure::usage("latency-peer is started by `isochrone bench latency`"));
    };
    match serve(&setup, &lines, &stop) {
        Ok(()) => Ok(()),
        // Whoever started us tells it; should nobody be there any more, it matters to nobody.
        Err(error) => reply(&Reply::Failed(error)),
    }
}

/// Reads stdin in the background. Its end is the end of whoever started us: that ends us too.
fn read_lines(stop: Arc<AtomicBool>) -> Receiver<String> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
        stop.store(true, Ordering::Relaxed);
    });
    lines
}

fn serve(setup: &str, lines: &Receiver<String>, stop: &Arc<AtomicBool>) -> Result<(), String> {
    let setup: Setup = read(setup)?;
    let mut refusals = prepare_process().refusals;
    let domain = Domain::from_file(&setup.domain_file).map_err(|error| error.to_string())?;
    let participant = Participant::<ipc::Service>::join("isochrone/latency-peer", &domain)
        .map_err(|error| error.to_string())?;
    let place = Place {
        side: Side::Peer,
        folder: &setup.folder,
        participant: &participant,
        prefix: &setup.prefix,
        values: setup.values,
        wait: setup.wait,
    };
    let open = |arm: &Arm| {
        let end = end::open(*arm, &place).and_then(|opening| opening());
        end.map_err(|error| format!("arm \"{arm}\": {error}"))
    };
    let mut ends = setup.arms.iter().map(open).collect::<Result<Vec<Box<dyn End>>, String>>()?;
    let request = ThreadRequest { priority: setup.priority, cpu: Some(setup.cpu) };
    refusals.extend(prepare_thread(request).refusals);
    let ready = Reply::Ready(refusals.iter().map(warning).collect());
    reply(&ready).map_err(|_| "nobody listens")?;

    let terms = Terms { values: setup.values, wait: setup.wait };
    while let Ok(line) = lines.recv() {
        let turn: Turn = read(&line)?;
        let (Some(end), Some(arm)) = (ends.get_mut(turn.arm), setup.arms.get(turn.arm)) else {
            return Err(format!("there is no arm {}", turn.arm));
        };
        let sent = match turn.period_ns {
            Some(period_ns) => turn::send_paced(end.as_mut(), &turn.span, period_ns, stop),
            None => turn::echo(end.as_mut(), &turn.span, terms, stop),
        };
        let sent = sent.map_err(|error| format!("arm \"{arm}\", the peer: {error}"))?;
        reply(&Reply::Done(sent)).map_err(|_| "nobody listens")?;
    }
    Ok(())
}

fn read<T: serde::de::DeserializeOwned>(line: &str) -> Result<T, String> {
    serde_json::from_str(line).map_err(|error| format!("a line cannot be read: {error}"))
}

fn reply(reply: &Reply) -> Result<(), Failure> {
    let text = serde_json::to_string(reply);
    let text = text.map_err(|error| Failure::found(format!("cannot write JSON: {error}")))?;
    terminal::print(&(text + "\n"))
}
