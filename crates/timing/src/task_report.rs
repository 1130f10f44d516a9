//! What a cyclic task did.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::summary::Summary;

/// What one cyclic task did and cost; the distributions are of the cycles that ran after the
/// warm-up. What was not measured is `None`, `null` in JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskReport {
    /// Name of the task.
    pub name: String,
    /// Its period, in ns.
    pub period_ns: u64,
    /// How it waited: `sleep`, `hybrid` or `spin`.
    pub wake: String,
    /// How long before a release a hybrid wait was awake in the end, in ns; `null` for other waits.
    pub margin_ns: Option<u64>,
    /// The scheduler that the kernel granted: `fifo:80`, `other`.
    pub scheduler: String,
    /// The CPU it was pinned to, `null` if it could move.
    pub cpu: Option<usize>,
    /// Cycles that ran, the warm-up included.
    pub cycles: u64,
    /// First cycles that are in no distribution.
    pub warm_up_cycles: u64,
    /// Releases that never ran, because the cycle before took too long or the wake-up came too late.
    pub missed: u64,
    /// Cycles that ended after the next release; `null` for an arm of a bench, which does
    /// not count them.
    pub overruns: Option<u64>,
    /// Cycles that ran but are in no distribution, because their records were dropped;
    /// `null` for an arm of a bench, which does not count them.
    pub lost_records: Option<u64>,
    /// First instruction of the cycle minus its due time.
    pub release_jitter_ns: Summary,
    /// End of the cycle (frame sent) minus its start.
    pub execution_ns: Summary,
    /// Frame sent minus due time.
    pub response_ns: Summary,
    /// |interval between two starts - interval between their due times|.
    pub period_error_ns: Summary,
    /// CPU time of the task's thread per elapsed time, 0 to 1; waiting by spinning counts.
    pub cpu_fraction: Option<f64>,
    /// Allocations of the node itself after the warm-up, none of them in a cycle.
    pub allocations: Option<u64>,
    /// Allocations by the IPC library after the warm-up: one for each frame, in the slack, and those
    /// with which it connects a peer.
    pub ipc_allocations: Option<u64>,
    /// Page faults without I/O, after the warm-up; those with which the IPC library connects a peer
    /// are among them.
    pub minor_faults: Option<u64>,
    /// Page faults with I/O.
    pub major_faults: Option<u64>,
    /// Times that the thread gave up its CPU, as a sleep does.
    pub voluntary_switches: Option<u64>,
    /// Times that the CPU was taken away.
    pub involuntary_switches: Option<u64>,
    /// Block steps that ended with an error status.
    pub block_errors: Option<u64>,
    /// Samples that their declared type could not hold.
    pub input_rejects: Option<u64>,
    /// How often the number of a port's peers was seen to change while the task ran; one that left
    /// and one that joined between two looks are not seen.
    pub connects: Option<u64>,
    /// Connections to a peer that failed at first, and were tried again.
    pub connect_errors: Option<u64>,
    /// Snapshots of the signals that did not become telemetry, because nobody fetched those before.
    pub lost_snapshots: Option<u64>,
    /// The distributions themselves, by the names that their summaries have here: HdrHistogram's V2
    /// format, deflated, in base64 (it begins with `HISTFAAA`).
    pub histograms: BTreeMap<String, String>,
}

impl TaskReport {
    /// Page faults of both kinds.
    pub fn faults(&self) -> Option<u64> {
        Some(self.minor_faults? + self.major_faults?)
    }
}
