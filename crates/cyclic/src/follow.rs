//! Cycles that begin with their data: the wait between a release and the data.

use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_model::{CycleStart, CycleStartCounts};

use crate::clock::Clock;
use crate::wait::Awake;

/// What a task that follows its data does while it waits; injected so that tests need no ports.
pub trait FollowedData {
    /// Called at the wake-ups before the release, as by [`wait_with`](crate::Cyclic::wait_with).
    fn awake(&mut self, awake: Awake);

    /// Whether data of this cycle is there. Asked at the release, and from then on again and again until
    /// data is there or the time is up.
    fn has_arrived(&mut self, look: Look) -> bool;
}

/// A look at what may have come, on the clock of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// The cycle that is to begin.
    pub cycle: u64,
    /// Data that came before this, in ns, was that of the cycle before, which would have waited for it: a
    /// cycle that began without its data must not make all that follow begin a period late.
    pub since_ns: u64,
    /// The time of the look, in ns.
    pub now_ns: u64,
}

/// How a cycle that follows its data came to begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct FollowStart {
    /// The first clock reading at or after the release, in ns: where a cycle that waits for nothing
    /// begins, and this one begins to wait for data.
    pub ready_ns: u64,
    /// What made it begin.
    pub begun: CycleStart,
    /// How the cycles since the loop began came to begin, this one included.
    pub counts: CycleStartCounts,
}

/// Watches clock and port from the first look, at the release, until `latest_ns`; returns when the cycle
/// begins and why, or `None` once `stop` is set. Looks at the port at least once.
pub(crate) fn watch<C: Clock>(
    clock: &C,
    first: Look,
    latest_ns: u64,
    stop: &AtomicBool,
    follow: &mut impl FollowedData,
) -> Option<(u64, CycleStart)> {
    let Look { cycle, since_ns, mut now_ns } = first;
    if follow.has_arrived(first) {
        return Some((now_ns, CycleStart::FoundReady));
    }
    while now_ns < latest_ns {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        now_ns = clock.now_ns();
        if follow.has_arrived(Look { cycle, since_ns, now_ns }) {
            // Read again: the data may have come after the reading before, and its stamp shall not
            // lie in the future of the cycle.
            return Some((clock.now_ns(), CycleStart::Followed));
        }
    }
    Some((now_ns, CycleStart::TimedOut))
}

#[cfg(test)]
#[path = "follow_tests.rs"]
mod tests;
