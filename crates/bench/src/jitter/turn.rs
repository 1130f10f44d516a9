//! A turn of any arm: its input and its result.

use std::ops::Range;
use std::time::Duration;

use isochrone_cyclic::{ThreadGrant, ThreadRequest, ThreadUsage};
use isochrone_ipc::Domain;
use isochrone_processes::Stop;
use isochrone_timing::{CycleRecord, FollowRecord, Warning};

use crate::watch::Watch;

/// What is not counted at the beginning of a turn.
pub(super) const WARM_UP: Duration = Duration::from_millis(200);

/// A turn: for how long, and who wants to know.
pub(super) struct Turn<'a> {
    /// Without the warm-up.
    pub(super) counted: Duration,
    pub(super) stop: &'a Stop,
    pub(super) domain: &'a Domain,
    /// Called some fifty times a second.
    pub(super) pass: &'a dyn Fn(),
}

/// How an arm's loop runs: the same for all arms that take turns.
#[derive(Clone, Copy)]
pub(super) struct Terms {
    pub(super) period_ns: u64,
    pub(super) phase_ns: u64,
    pub(super) request: ThreadRequest,
    pub(super) cpu: usize,
}

/// What came of a turn.
pub(super) struct TurnResult {
    pub(super) records: Vec<CycleRecord>,
    /// The rest of each record, of a task that follows its data; empty for others.
    pub(super) follows: Vec<FollowRecord>,
    /// What counts: from when to when releases were due. `None`: it ended in its warm-up.
    pub(super) counted: Option<Range<u64>>,
    pub(super) watch: Watch,
    /// What the loop's thread itself tells of faults and preemptions; `None`: the watch knows.
    pub(super) thread_usage: Option<ThreadUsage>,
    /// What the kernel granted; `None` of another program.
    pub(super) grant: Option<ThreadGrant>,
    pub(super) margin_ns: Option<u64>,
    pub(super) used: Option<Used>,
    /// What came up meanwhile.
    pub(super) warnings: Vec<Warning>,
}

/// What a turn used, after its warm-up.
#[derive(Clone, Copy)]
pub(super) struct Used {
    pub(super) cpu_ns: u64,
    pub(super) elapsed_ns: u64,
    /// Faults and switches; `None` of another program's thread.
    pub(super) usage: Option<ThreadUsage>,
}

impl Used {
    /// Both together.
    pub(super) fn and(self, other: Self) -> Self {
        let usage = self.usage.zip(other.usage).map(|(one, other)| ThreadUsage {
            cpu_ns: one.cpu_ns + other.cpu_ns,
            minor_faults: one.minor_faults + other.minor_faults,
            major_faults: one.major_faults + other.major_faults,
            voluntary_switches: one.voluntary_switches + other.voluntary_switches,
            involuntary_switches: one.involuntary_switches + other.involuntary_switches,
        });
        let (cpu_ns, elapsed_ns) = (self.cpu_ns + other.cpu_ns, self.elapsed_ns + other.elapsed_ns);
        Self { cpu_ns, elapsed_ns, usage }
    }
}

/// How many cycles a turn has at most, the warm-up's and the one after the end included.
pub(super) fn cycles(period_ns: u64, counted: Duration) -> usize {
    ((WARM_UP + counted).as_nanos() as u64 / period_ns.max(1)) as usize + 2
}
