//! A node whose peers stay, or join and leave all the time.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{BufRead, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{
    Depth, Domain, FrameLayout, FramePublisher, FrameSubscriber, OpenError, Participant,
    SignalSpec, Stamp, ipc,
};
use isochrone_processes::Company;
use isochrone_runtime::TaskCpus;
use serde::{Deserialize, Serialize};

use super::node;
use super::turn::{Terms, Turn, TurnResult};
use crate::BenchError;
use crate::peer_process::{PeerProcess, gone, read_orders};

/// Values of a frame of the wide services.
const WIDE: usize = 1_000;
/// Twenty peers join in a second, and as many leave.
const JOIN_INTERVAL: Duration = Duration::from_millis(50);
/// How many are there at a time.
const VISITORS: usize = 2;
/// Between two frames of a peer that writes.
const FRAME_INTERVAL: Duration = Duration::from_millis(1);

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
) -> Result<TurnResult, BenchError> {
    let failed =
        |error: &dyn std::fmt::Display| BenchError::Failed(format!("arm \"{arm}\": {error}"));
    let source = Source::new("bench.toml", configuration(terms));
    let plan = Plan::new(source, &Rules::default()).map_err(|error| failed(&error))?;
    let cpus = TaskCpus::of(&plan);
    let company = Company::gather("isobench")?;
    let setup = Setup { domain_file: company.domain().file(), peers };
    let mut peers = PeerProcess::start(&company, "node-peers", &setup)?;
    if peers.reply()?.is_empty() {
        return Err(gone("without a word"));
    }
    let result =
        node::turn(arm, terms, (&plan, &cpus), &Turn { domain: company.domain(), ..*turn });
    peers.check()?;
    // The faults that peers cause are what is measured, and nothing that makes a turn invalid.
    Ok(TurnResult { thread_usage: None, ..result? })
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

/// Is the peers of a bench, as it asks for in `orders`, until there are no more orders.
///
/// # Errors
/// No bench gives orders, or a port cannot be opened.
pub fn serve(
    orders: impl BufRead + Send + 'static,
    replies: &mut dyn Write,
) -> Result<(), BenchError> {
    let stop = Arc::new(AtomicBool::new(false));
    let lines = read_orders(orders, stop.clone());
    let setup = lines.recv().ok().and_then(|line| serde_json::from_str(&line).ok());
    let Some(Setup { domain_file, peers: what }) = setup else {
        return Err(BenchError::Usage("node-peers is started by `isochrone bench jitter`".into()));
    };
    let domain =
        Domain::from_file(&domain_file).map_err(|error| BenchError::Failed(error.to_string()))?;
    let participant = Participant::join("isochrone/node-peers", domain)?;
    let join = |kind| Peer::join(&participant, kind).map_err(failed);
    let (mut peers, mut joining) = match what {
        Peers::Stay => (KINDS.into_iter().map(join).collect::<Result<VecDeque<_>, _>>()?, None),
        Peers::ComeAndGo => (VecDeque::new(), Some(KINDS.into_iter().cycle())),
    };
    // Should nobody be there any more, it matters to nobody.
    let _ = writeln!(replies, "ready").and_then(|()| replies.flush());
    let mut next = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        if next <= Instant::now()
            && let Some(kind) = joining.as_mut().and_then(Iterator::next)
        {
            // The one that is to come may be of the same kind.
            if peers.len() >= VISITORS {
                peers.pop_front();
            }
            peers.push_back(join(kind)?);
            next += JOIN_INTERVAL;
        }
        peers.iter_mut().for_each(Peer::work);
        thread::sleep(FRAME_INTERVAL);
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
