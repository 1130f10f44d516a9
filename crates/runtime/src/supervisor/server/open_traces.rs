//! The traces of a node, and why those ended that there are no more.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Instant;

use isochrone_control::desk::Selection;
use isochrone_control::{Code, Finding, Refusal, Ticket, TraceResult};

use super::trace_ports::{OpenedTrace, Opening};
use crate::clocks::unix_ns;

/// How many ended traces are remembered, with the reason.
const REMEMBERED: usize = 32;

/// The traces of a node.
pub(super) struct Tracing {
    pub(super) jobs: Sender<Opening>,
    pub(super) opened: Receiver<OpenedTrace>,
    /// The start of the ids of this run: a client of an earlier run must not find its number in use.
    pub(super) run: u32,
    pub(super) last: u64,
    pub(super) traces: Vec<Trace>,
    /// Ids, and why they ended.
    ended: VecDeque<(String, &'static str)>,
}

/// A trace, from the request for it to its end.
pub(super) struct Trace {
    pub(super) number: u64,
    pub(super) task: usize,
    pub(super) result: TraceResult,
    pub(super) renewed: Instant,
    pub(super) state: State,
}

/// How far a trace is.
pub(super) enum State {
    /// Its service is being opened, for the client with this ticket and the signals that were found.
    Opening(Ticket, Selection),
    Running,
    /// Its task was told to end it, and why.
    Ending(&'static str),
}

impl Tracing {
    /// Makes the traces, with the channels to and from the thread that has the services.
    pub(super) fn new(jobs: Sender<Opening>, opened: Receiver<OpenedTrace>) -> Self {
        let run = unix_ns() / 1_000_000;
        let (traces, ended) = (Vec::new(), VecDeque::new());
        Self { jobs, opened, run: run as u32, last: 0, traces, ended }
    }

    /// Stops opening; returns the tickets that wait.
    pub(super) fn end(&mut self) -> impl Iterator<Item = Ticket> {
        self.traces.drain(..).filter_map(|trace| match trace.state {
            State::Opening(ticket, _) => Some(ticket),
            State::Running | State::Ending(_) => None,
        })
    }

    pub(super) fn note_end(&mut self, id: String, why: &'static str) {
        if self.ended.len() >= REMEMBERED {
            self.ended.pop_front();
        }
        self.ended.push_back((id, why));
    }

    pub(super) fn unknown(&self, id: &str) -> Refusal {
        let ended = self.ended.iter().rfind(|(known, _)| known == id);
        let (message, why) = match ended {
            Some((id, why)) => (format!("trace \"{id}\" has ended"), *why),
            None => (
                format!(
                    "there is no trace \"{}\"",
                    id.chars().take(60).collect::<String>().escape_debug()
                ),
                "an id is of one run of the node",
            ),
        };
        let finding = Finding::new("id", message).with_help(format!("{why}; ask for a new one"));
        Refusal::of(Code::UnknownName, vec![finding])
    }
}
