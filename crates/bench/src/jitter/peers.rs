//! A node whose peers stay, or join and leave all the time.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{
    Depth, Domain, FrameLayout, FramePublisher, FrameSubscriber, OpenError, Participant,
    SignalSpec, Stamp, ipc,
};
use isochrone_processes::{Child, Company};
use isochrone_runtime::TaskCpus;
use serde::{Deserialize, Serialize};

use super::node;
use super::turn::{Taken, Terms, Turn};
use crate::BenchError;

/// Values of a frame of the wide services.
const WIDE: usize = 1_000;
/// Twenty peers join in a second, and as many leave.
const JOIN_INTERVAL: Duration = Duration::from_millis(50);
/// How many are there at a time.
const VISITORS: usize = 2;
/// Between two frames of a peer that writes.
const FRAME_INTERVAL: Duration = Duration::from_millis(1);
const LEAVING: Duration = Duration::from_secs(3);

/// What a node's peers do during a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Peers {
    /// A reader and a writer of one value and of [`WIDE`] values, all the time.
    Stay,
    /// The same, one after the other.
    ComeAndGo,
}

/// Runs the node for a turn, beside a process of such peers.
pub(super) fn turn(
    arm: &str,
    peers: Peers,
    terms: &Terms,
    turn: &Turn<'_>,
) -> Result<Taken, BenchError> {
    let failed =
        |error: &dyn std::fmt::Display| BenchError::Failed(format!("arm \"{arm}\": {error}"));
    let source = Source::new("bench.toml", configuration(terms));
    let plan = Plan::new(source, &Rules::default()).map_err(|error| failed(&error))?;
    let cpus = TaskCpus::of(&plan);
    let company = Company::gather("isobench")?;
    let mut peers = PeerProcess::start(&company, peers)?;
    let taken = node::turn(arm, terms, (&plan, &cpus), &Turn { domain: company.domain(), ..*turn });
    peers.process.check()?;
    // The faults that peers cause are what is measured, and nothing that makes a turn invalid.
    Ok(Taken { told: None, ..taken? })
}

/// A node that reads and sends one value and [`WIDE`] values.
fn configuration(terms: &Terms) -> String {
    let mut text = format!(
        "[node]\nname = \"bench\"\n[[task]]\nname = \"loop\"\nperiod = \"{}ns\"\nphase = \"{}ns\"\n\
         wake = \"hybrid\"\ncpu = {}\n",
        terms.period_ns, terms.phase_ns, terms.cpu
    );
    if let Some(priority) = terms.request.priority {
        let _ = writeln!(text, "priority = {priority}");
    }
    let last = WIDE - 1;
    let signals: String = (0..last).map(|n| format!("\"saw.{n}.value\", ")).collect();
    let _ = write!(
        text,
        r#"[[input]]
name = "narrow"
service = "narrow/in"
channel = 0
[[input]]
name = "wide"
service = "wide/in"
channel = {last}
[[block]]
name = "saw"
type = "SawTooth"
count = {last}
[block.in]
incrementRange = 10
numberSteps = 100
[[output]]
service = "narrow/out"
signals = ["narrow"]
[[output]]
service = "wide/out"
signals = [{signals}"wide"]
"#
    );
    text
}

/// What the process of peers reads first. It ends when there is no more to read.
#[derive(Serialize, Deserialize)]
struct Setup {
    domain_file: PathBuf,
    peers: Peers,
}

/// The process of peers. It leaves when this is dropped.
struct PeerProcess {
    process: Child,
    orders: Option<ChildStdin>,
}

impl PeerProcess {
    /// Starts it; returns when the first peer has joined.
    fn start(company: &Company, peers: Peers) -> Result<Self, BenchError> {
        let failed = |why: &dyn std::fmt::Display| {
            BenchError::Failed(format!("the process of peers has ended: {why}"))
        };
        let mut process = company
            .start_with(&["bench", "node-peers"], |command| command.stdin(Stdio::piped()))?;
        let (Some(mut orders), Some(replies)) = (process.stdin(), process.stdout()) else {
            return Err(failed(&"it has no pipes"));
        };
        let setup = Setup { domain_file: company.domain().file(), peers };
        let setup = serde_json::to_string(&setup).map_err(|error| failed(&error))?;
        // If it has ended, there is no reply either.
        let _ = writeln!(orders, "{setup}");
        let mut reply = String::new();
        BufReader::new(replies).read_line(&mut reply).map_err(|error| failed(&error))?;
        if reply.trim_end() != READY {
            return Err(failed(&reply));
        }
        Ok(Self { process, orders: Some(orders) })
    }
}

impl Drop for PeerProcess {
    fn drop(&mut self) {
        drop(self.orders.take());
        let _ = self.process.wait_within(LEAVING);
    }
}

const READY: &str = "ready";

/// Is the peers of a bench, as it asks for in `orders`, until there are no more orders.
///
/// # Errors
/// No bench gives orders, or a port cannot be opened.
pub fn serve(
    mut orders: impl BufRead + Send + 'static,
    replies: &mut dyn Write,
) -> Result<(), BenchError> {
    let mut line = String::new();
    let _ = orders.read_line(&mut line);
    let Ok(setup) = serde_json::from_str::<Setup>(&line) else {
        return Err(BenchError::Usage("node-peers is started by `isochrone bench jitter`".into()));
    };
    let (sender, end) = channel::<()>();
    thread::spawn(move || {
        let _ = orders.read_line(&mut String::new());
        drop(sender);
    });
    let domain = Domain::from_file(&setup.domain_file)
        .map_err(|error| BenchError::Failed(error.to_string()))?;
    let participant = Participant::join("isochrone/node-peers", domain)?;
    let mut ready = || {
        let _ = writeln!(replies, "{READY}").and_then(|()| replies.flush());
    };
    match setup.peers {
        Peers::Stay => stay(&participant, &mut ready, &end),
        Peers::ComeAndGo => come_and_go(&participant, &mut ready, &end),
    }
}

fn stay(
    participant: &Participant<ipc::Service>,
    ready: &mut dyn FnMut(),
    end: &Receiver<()>,
) -> Result<(), BenchError> {
    let mut peers = Vec::new();
    for kind in KINDS {
        peers.push(Peer::join(participant, kind).map_err(failed)?);
    }
    ready();
    while end.try_recv() == Err(TryRecvError::Empty) {
        peers.iter_mut().for_each(Peer::work);
        thread::sleep(FRAME_INTERVAL);
    }
    Ok(())
}

fn come_and_go(
    participant: &Participant<ipc::Service>,
    ready: &mut dyn FnMut(),
    end: &Receiver<()>,
) -> Result<(), BenchError> {
    let mut peers = VecDeque::new();
    ready();
    let mut next = Instant::now();
    for kind in KINDS.into_iter().cycle() {
        // The one that is to come may be of the same kind.
        while peers.len() >= VISITORS {
            peers.pop_front();
        }
        peers.push_back(Peer::join(participant, kind).map_err(failed)?);
        next += JOIN_INTERVAL;
        while Instant::now() < next {
            if end.try_recv() != Err(TryRecvError::Empty) {
                return Ok(());
            }
            peers.iter_mut().for_each(Peer::work);
            thread::sleep(FRAME_INTERVAL);
        }
    }
    Ok(())
}

fn failed(error: OpenError) -> BenchError {
    BenchError::Failed(error.to_string())
}

/// One of the node's peers.
enum Peer {
    Reader(FrameSubscriber<ipc::Service>),
    Writer(FramePublisher<ipc::Service>),
}

/// The node's peers: whether they read, on which service, how many values.
const KINDS: [(bool, &str, usize); 4] = [
    (true, "narrow/out", 1),
    (false, "narrow/in", 1),
    (true, "wide/out", WIDE),
    (false, "wide/in", WIDE),
];

impl Peer {
    fn join(
        participant: &Participant<ipc::Service>,
        (reads, service, values): (bool, &str, usize),
    ) -> Result<Self, OpenError> {
        if reads {
            let reader = FrameSubscriber::open(participant, service, values, Depth::All)?;
            return Ok(Self::Reader(reader));
        }
        let signals = (0..values).map(|n| SignalSpec::new(format!("x{n}"), "LREAL")).collect();
        let layout = FrameLayout { signals, period_ns: None };
        Ok(Self::Writer(FramePublisher::open(participant, service, &layout)?.plain()))
    }

    /// Reads what is there, or sends a frame.
    fn work(&mut self) {
        match self {
            Self::Reader(reader) => while reader.next(Monotonic.now_ns()).is_some() {},
            Self::Writer(writer) => {
                writer.prepare();
                writer.send(Stamp::default(), || Monotonic.now_ns());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_cyclic::{Pinning, ThreadRequest};

    use super::*;

    #[test]
    fn the_configuration_is_one_that_runs() {
        for priority in [None, Some(80)] {
            let request = ThreadRequest { priority, cpu: Pinning::Named(1) };
            let terms = Terms { period_ns: 1_000_000, phase_ns: 30_000, request, cpu: 1 };
            let source = Source::new("bench.toml", configuration(&terms));
            let plan = Plan::new(source, &Rules::default()).unwrap();
            assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
            let settings = &plan.tasks[0].settings;
            assert_eq!((settings.period_ns, settings.phase_ns), (1_000_000, 30_000));
            assert_eq!(settings.priority, priority);
        }
    }
}
