//! The thread that measures. It owns the measuring ends and has a CPU for itself.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, Sender};

use isochrone_cyclic::{Refusal, ThreadRequest};
use isochrone_ipc::ForRealTime;
use isochrone_runtime::RealTimeThread;
use isochrone_timing::Distribution;

use super::arms::Arm;
use super::end::{End, EndError, Opening, Place};
use super::follow_path::FollowPath;
use super::node_path::{NodeOutput, Stages};
use super::transports;
use super::turn::{self, Received, Sent, Span, Terms};

/// What the thread is told to do.
pub(super) enum Job {
    /// The peer has opened its ends: connect with them.
    Connect,
    /// Wait until the nodes of an arm send.
    AwaitNodes(usize),
    /// Have a turn with an arm.
    Turn { arm: usize, span: Span, exchange: Exchange },
}

/// Which way messages go in a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exchange {
    /// From the peer, at its pace.
    OneWay,
    /// To the peer and back.
    RoundTrip,
    /// Through nodes that follow, sent with this period.
    Followed { period_ns: u64 },
}

/// What it answers.
pub(super) enum Answer {
    /// Its ends are open.
    Open {
        thread: u32,
        refusals: Vec<Refusal>,
    },
    Done,
    Taken(Box<Taken>),
}

/// The result of a turn.
pub(super) struct Taken {
    pub(super) samples: Distribution,
    pub(super) received: Received,
    /// Of the way through nodes.
    pub(super) stages: Option<Stages>,
    /// Where this thread has sent, instead of the peer.
    pub(super) sent: Option<Sent>,
    /// Cycles without a new value, of nodes that follow.
    pub(super) timed_out: Option<u64>,
}

/// An arm, as far as it has come.
enum Line {
    Opening(Option<Opening>),
    Connected(Box<dyn End>),
    Node(Box<NodeOutput>),
    Followed(Box<FollowPath>),
}

/// Does jobs until there are no more.
pub(super) fn run(
    place: &Place<'_>,
    arms: &[Arm],
    request: ThreadRequest,
    stop: &Arc<AtomicBool>,
    jobs: &Receiver<Job>,
    answers: &Sender<Result<Answer, String>>,
) {
    let open = |arm: &Arm| {
        let line = match arm {
            Arm::Node => NodeOutput::open(place)
                .map(|output| output.map(|output| Line::Node(Box::new(output)))),
            Arm::Follow | Arm::Chain => FollowPath::open(*arm, place)
                .map(|path| path.map(|path| Line::Followed(Box::new(path)))),
            _ => transports::open(*arm, place)
                .map(|opening| opening.map(|opening| Line::Opening(Some(opening)))),
        };
        line.map_err(|error| named(arm, &error))
    };
    let lines = match arms.iter().map(open).collect::<Result<ForRealTime<Vec<Line>>, String>>() {
        Ok(lines) => lines,
        Err(error) => return drop(answers.send(Err(error))),
    };
    let measurer = lines.map(|lines| Measurer {
        lines,
        terms: Terms { values: place.values, wait: place.wait },
        samples: Distribution::new(),
        stages: Stages::default(),
    });
    let (mut measurer, grant) = RealTimeThread::prepare(request, measurer);
    let thread = rustix::thread::gettid().as_raw_nonzero().get().cast_unsigned();
    let mut answer = Ok(Answer::Open { thread, refusals: grant.refusals });
    // Whoever gives the jobs has gone when nobody takes the answer.
    while answers.send(answer).is_ok() {
        let Ok(job) = jobs.recv() else { break };
        let arm = match job {
            Job::Connect => None,
            Job::AwaitNodes(arm) | Job::Turn { arm, .. } => arms.get(arm),
        };
        let name = |error| arm.map_or_else(|| format!("{error}"), |arm| named(arm, &error));
        answer = match job {
            Job::Connect => measurer.connect(arms),
            Job::AwaitNodes(arm) => measurer.await_nodes(arm, stop).map_err(name),
            Job::Turn { arm, span, exchange } => {
                measurer.turn(arm, &span, exchange, stop).map_err(name)
            }
        };
    }
}

fn named(arm: &Arm, error: &EndError) -> String {
    format!("arm \"{arm}\": {error}")
}

struct Measurer {
    lines: Vec<Line>,
    terms: Terms,
    // Used again in every turn, so that their memory has been touched before.
    samples: Distribution,
    stages: Stages,
}

impl Measurer {
    fn connect(&mut self, arms: &[Arm]) -> Result<Answer, String> {
        for (line, arm) in self.lines.iter_mut().zip(arms) {
            if let Line::Opening(opening) = line
                && let Some(opening) = opening.take()
            {
                *line = Line::Connected(opening().map_err(|error| named(arm, &error))?);
            }
        }
        Ok(Answer::Done)
    }

    fn await_nodes(&mut self, arm: usize, stop: &AtomicBool) -> Result<Answer, EndError> {
        match self.lines.get_mut(arm) {
            Some(Line::Node(output)) => output.await_node(stop)?,
            Some(Line::Followed(path)) => path.await_nodes(stop)?,
            _ => return Err(EndError::Gone),
        }
        Ok(Answer::Done)
    }

    fn turn(
        &mut self,
        arm: usize,
        span: &Span,
        exchange: Exchange,
        stop: &Arc<AtomicBool>,
    ) -> Result<Answer, EndError> {
        let (terms, samples, stages) = (self.terms, &mut self.samples, &mut self.stages);
        samples.clear();
        stages.clear();
        let (mut sent, mut timed_out) = (None, None);
        let mut has_stages = true;
        let received = match (self.lines.get_mut(arm), exchange) {
            (Some(Line::Connected(end)), Exchange::OneWay) => {
                has_stages = false;
                turn::receive_paced(end.as_mut(), span, terms, stop, samples)?
            }
            (Some(Line::Connected(end)), Exchange::RoundTrip) => {
                has_stages = false;
                turn::ping(end.as_mut(), span, terms, stop, samples)?
            }
            (Some(Line::Node(output)), _) => output.receive(span, stop, samples, stages)?,
            (Some(Line::Followed(path)), Exchange::Followed { period_ns }) => {
                let passed = path.measure(span, period_ns, stop, samples, stages)?;
                (sent, timed_out) = (Some(passed.sent), Some(passed.timed_out));
                passed.received
            }
            _ => return Err(EndError::Gone),
        };
        let stages = has_stages.then(|| stages.clone());
        let samples = samples.clone();
        Ok(Answer::Taken(Box::new(Taken { samples, received, stages, sent, timed_out })))
    }
}
