//! The timing record of a cycle.

use isochrone_model::CycleStartCounts;

/// One cycle as the loop saw it; all times in ns of one clock. 48 bytes, to fit a ring.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CycleRecord {
    /// Index on the grid, from 0, counting missed releases.
    pub cycle: u64,
    /// Due time of the cycle.
    pub release_ns: u64,
    /// First clock reading in the cycle.
    pub start_ns: u64,
    /// Time after its frame was sent.
    pub end_ns: u64,
    /// Releases missed since the loop started.
    pub missed: u64,
    /// Overruns since the loop started, including this cycle's.
    pub overruns: u64,
}

/// The record of a cycle of a task that follows its data, in addition to its [`CycleRecord`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FollowRecord {
    /// First clock reading at or after the release, in ns: from then on the cycle waited for data.
    pub ready_ns: u64,
    /// How the cycles since the loop started came to begin, this one included.
    pub begun: CycleStartCounts,
    /// Frames since the loop started that were received of what it follows, or lost, until this cycle.
    pub sent: u64,
    /// Publish time of the frame that the cycle began with, in ns; `None` if there is no such frame, or its
    /// stamp is of another clock.
    pub frame_ns: Option<u64>,
    /// Publish time of the cycle's last frame minus that of the frame that it began with, in ns; `None`
    /// if one of them is unknown.
    pub latency_ns: Option<u64>,
}
