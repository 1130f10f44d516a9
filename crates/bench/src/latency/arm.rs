//! An arm: one way from a process to another.

use std::fmt;

use isochrone_ipc::ForRealTime;
use isochrone_timing::Warning;

use super::bench_node::{BenchNode, NodePlace, NodeSite};
use super::end::{EndError, Opening, Rendezvous};
use super::measuring::{Connected, Measuring, MeasuringOpening};
use super::pace::SendPace;

/// What an arm is. Each is a file in `arms`; what an arm through nodes has beyond a plain transport has a
/// default.
pub(super) trait Transport: Sync {
    /// Its name in reports and on the command line.
    fn name(&self) -> &'static str;

    /// What it is, for the help of the command line.
    fn help(&self) -> &'static str;

    /// Opens the end of either side, which `place` names. The measuring one comes first, then its peer, then
    /// both are connected.
    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError>;

    /// Opens the measuring side.
    fn open_measuring(
        &self,
        place: &Rendezvous<'_>,
    ) -> Result<ForRealTime<MeasuringOpening>, EndError> {
        let connected = |opening: Opening| -> MeasuringOpening {
            Box::new(move || Ok(Box::new(Connected(opening()?)) as Box<dyn Measuring>))
        };
        Ok(self.open(place)?.map(connected))
    }

    /// Whether its receiver can sleep in the kernel until a message comes.
    fn can_block(&self) -> bool {
        false
    }

    /// Whether the peer sends or answers; otherwise the thread that measures sends and reads, and watches only
    /// while a message is on its way.
    fn has_peer(&self) -> bool {
        true
    }

    /// Whether it has messages of this size at this pace.
    fn has(&self, _values: usize, _pace: SendPace) -> bool {
        true
    }

    /// Where its nodes run, first to last.
    fn node_places(&self, _site: &NodeSite) -> Vec<NodePlace> {
        Vec::new()
    }

    /// Its nodes in these places, for messages with this period.
    fn nodes(&self, _period_ns: Option<u64>, _places: &[NodePlace]) -> Vec<BenchNode> {
        Vec::new()
    }

    /// When to begin to send in a round of `rounds`, not before `earliest_ns`.
    fn start_ns(
        &self,
        earliest_ns: u64,
        _period_ns: Option<u64>,
        _round: usize,
        _rounds: usize,
    ) -> u64 {
        earliest_ns
    }

    /// Why its numbers are doubtful where its nodes run.
    fn warning(&self, _site: &NodeSite) -> Option<Warning> {
        None
    }
}

/// A way from one process to another.
#[derive(Clone, Copy)]
pub struct Arm(&'static dyn Transport);

impl Arm {
    pub(super) const fn of(transport: &'static dyn Transport) -> Self {
        Self(transport)
    }

    pub(super) const fn transport(self) -> &'static dyn Transport {
        self.0
    }

    /// Its name in reports.
    pub fn as_str(self) -> &'static str {
        self.0.name()
    }

    /// Whether its receiver can sleep in the kernel until a message comes.
    pub fn can_block(self) -> bool {
        self.0.can_block()
    }

    /// Whether another process sends or answers; otherwise one thread sends and reads.
    pub fn has_peer(self) -> bool {
        self.0.has_peer()
    }
}

impl PartialEq for Arm {
    fn eq(&self, other: &Self) -> bool {
        self.as_str() == other.as_str()
    }
}

impl Eq for Arm {}

impl fmt::Debug for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl fmt::Display for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
