//! The side of an arm that measures.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isochrone_timing::Distribution;

use super::end::{End, EndError};
use super::turn::{self, Received, SenderCounts, Span, Terms};

/// What the thread that measures has of an arm.
pub(super) trait Measuring {
    /// Waits until the nodes of the arm send; an arm without nodes has none to wait for.
    fn await_nodes(&mut self, _stop: &AtomicBool) -> Result<(), EndError> {
        Err(EndError::Gone)
    }

    /// Has a turn, and adds its samples.
    fn turn(&mut self, turn: &Turn<'_>, samples: &mut Samples) -> Result<Passed, EndError>;
}

/// What is left to do on this side once the peer has opened its end.
pub(super) type MeasuringOpening = Box<dyn FnOnce() -> Result<Box<dyn Measuring>, EndError>>;

/// A turn of the thread that measures.
pub(super) struct Turn<'a> {
    pub(super) span: &'a Span,
    /// Between two messages; `None`: each is sent when the one before has come back.
    pub(super) period_ns: Option<u64>,
    pub(super) terms: Terms,
    pub(super) stop: &'a Arc<AtomicBool>,
}

/// The samples of a turn.
#[derive(Default)]
pub(super) struct Samples {
    pub(super) times: Distribution,
    pub(super) stages: Stages,
}

impl Samples {
    pub(super) fn clear(&mut self) {
        self.times.clear();
        self.stages.clear();
    }
}

/// The age of a value at every stage of its way through nodes; empty for other arms.
#[derive(Debug, Clone, Default)]
pub(super) struct Stages {
    /// When the cycle was due that read it.
    pub(super) age_at_release: Distribution,
    /// When the node sent it on.
    pub(super) age_at_publish: Distribution,
    /// When it had arrived here.
    pub(super) end_to_end: Distribution,
}

impl Stages {
    pub(super) fn merge(&mut self, other: &Self) {
        self.age_at_release.merge(&other.age_at_release);
        self.age_at_publish.merge(&other.age_at_publish);
        self.end_to_end.merge(&other.end_to_end);
    }

    pub(super) fn clear(&mut self) {
        self.age_at_release.clear();
        self.age_at_publish.clear();
        self.end_to_end.clear();
    }
}

/// What came of a turn beside its samples.
#[derive(Default)]
pub(super) struct Passed {
    pub(super) received: Received,
    /// Where this thread has sent, instead of the peer.
    pub(super) sent: Option<SenderCounts>,
    /// Cycles of the last node that had no new value to send, of nodes that follow.
    pub(super) timed_out: Option<u64>,
}

/// An end of a transport, with the peer at the other one.
pub(super) struct Connected(pub(super) Box<dyn End>);

impl Measuring for Connected {
    fn turn(&mut self, turn: &Turn<'_>, samples: &mut Samples) -> Result<Passed, EndError> {
        let Turn { span, terms, stop, .. } = *turn;
        let (end, times) = (self.0.as_mut(), &mut samples.times);
        let received = match turn.period_ns {
            Some(_) => turn::receive_paced(end, span, terms, stop, times)?,
            None => turn::ping(end, span, terms, stop, times)?,
        };
        Ok(Passed { received, ..Passed::default() })
    }
}
