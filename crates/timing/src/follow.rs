//! The timing of cycles that begin with their data.

use crate::distribution::Distribution;
use crate::task::CycleRecord;

/// What a cycle of a task that follows its data tells beside its [`CycleRecord`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FollowRecord {
    /// First clock reading at or after the release, in ns: from then on the cycle waited for data.
    pub ready_ns: u64,
    /// Cycles that began with new data since the loop started, including this one.
    pub followed: u64,
    /// Cycles that began without new data, because the time was up, including this one.
    pub timed_out: u64,
    /// Publish time of the cycle's last frame minus that of the frame that it began with, in ns; `None`
    /// if there is no such frame, or its stamp is of another clock.
    pub latency_ns: Option<u64>,
}

/// Collects how long cycles waited for their data, and how soon they answered it.
#[derive(Debug, Clone, Default)]
pub(crate) struct FollowTiming {
    pub(crate) wait: Distribution,
    pub(crate) latency: Distribution,
    pub(crate) followed: u64,
    pub(crate) timed_out: u64,
}

impl FollowTiming {
    /// The counts, which stand even where earlier records were lost.
    pub(crate) fn count(&mut self, follow: &FollowRecord) {
        self.followed = self.followed.max(follow.followed);
        self.timed_out = self.timed_out.max(follow.timed_out);
    }

    /// A cycle behind the warm-up.
    pub(crate) fn record(&mut self, record: &CycleRecord, follow: &FollowRecord) {
        self.wait.record(record.start_ns.saturating_sub(record.release_ns));
        if let Some(latency_ns) = follow.latency_ns {
            self.latency.record(latency_ns);
        }
    }
}
