//! The thread that measures. It owns the measuring ends and has a CPU for itself.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, Sender};

use isochrone_cyclic::{GrantRefusal, ThreadRequest};
use isochrone_ipc::ForRealTime;
use isochrone_runtime::RealTimeThread;
use isochrone_timing::Distribution;

use super::arm::Arm;
use super::end::{EndError, Rendezvous};
use super::measuring::{Measuring, MeasuringOpening, Passed, Samples, Stages, Turn};
use super::turn::{Received, SenderCounts, Span, Terms};

/// What the thread is told to do.
pub(super) enum Job {
    /// The peer has opened its ends: connect with them.
    Connect,
    /// Wait until the nodes of an arm send.
    AwaitNodes(usize),
    /// Have a turn with an arm; messages are sent with this period, or, with `None`, each when the one before
    /// has come back.
    Turn { arm: usize, span: Span, period_ns: Option<u64> },
}

/// What it answers.
pub(super) enum Answer {
    /// Its ends are open.
    Open {
        thread: u32,
        refusals: Vec<GrantRefusal>,
    },
    Done,
    TurnResult(Box<TurnResult>),
}

/// The result of a turn.
pub(super) struct TurnResult {
    pub(super) samples: Distribution,
    pub(super) received: Received,
    pub(super) stages: Stages,
    /// Where this thread has sent, instead of the peer.
    pub(super) sent: Option<SenderCounts>,
    /// Cycles without a new value, of nodes that follow.
    pub(super) timed_out: Option<u64>,
}

/// An arm, as far as it has come.
enum Line {
    Opening(Option<MeasuringOpening>),
    Connected(Box<dyn Measuring>),
}

/// Does jobs until there are no more.
pub(super) fn run(
    place: &Rendezvous<'_>,
    arms: &[Arm],
    request: ThreadRequest,
    stop: &Arc<AtomicBool>,
    jobs: &Receiver<Job>,
    answers: &Sender<Result<Answer, String>>,
) {
    let open = |arm: &Arm| {
        let opened = arm.transport().open_measuring(place);
        let line = opened.map(|opening| opening.map(|opening| Line::Opening(Some(opening))));
        line.map_err(|error| named(arm, &error))
    };
    let lines = match arms.iter().map(open).collect::<Result<ForRealTime<Vec<Line>>, String>>() {
        Ok(lines) => lines,
        Err(error) => return drop(answers.send(Err(error))),
    };
    let measurer = lines.map(|lines| Measurer {
        lines,
        terms: Terms { values: place.values, wait: place.wait },
        samples: Samples::default(),
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
            Job::Turn { arm, span, period_ns } => {
                let terms = measurer.terms;
                let turn = Turn { span: &span, period_ns, terms, stop };
                measurer.turn(arm, &turn).map_err(name)
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
    samples: Samples,
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
        let Some(Line::Connected(line)) = self.lines.get_mut(arm) else {
            return Err(EndError::Gone);
        };
        line.await_nodes(stop)?;
        Ok(Answer::Done)
    }

    fn turn(&mut self, arm: usize, turn: &Turn<'_>) -> Result<Answer, EndError> {
        let Self { lines, samples, .. } = self;
        let Some(Line::Connected(line)) = lines.get_mut(arm) else { return Err(EndError::Gone) };
        samples.clear();
        let Passed { received, sent, timed_out } = line.turn(turn, samples)?;
        let (samples, stages) = (samples.times.clone(), samples.stages.clone());
        Ok(Answer::TurnResult(Box::new(TurnResult { samples, received, stages, sent, timed_out })))
    }
}
