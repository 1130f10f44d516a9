//! The report of a cyclic task.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::summary::Summary;

/// What one cyclic task did and cost. The distributions cover the cycles that ran after the
/// warm-up. What was not measured is `None`, `null` in JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskReport {
    /// Name of the task.
    pub name: String,
    /// Period of the task, in ns.
    pub period_ns: u64,
    /// Offset of its releases on the grid of its node, in ns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_ns: Option<u64>,
    /// Why it has this phase, if `phase = "auto"` chose it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_reason: Option<String>,
    /// How the task waited: `sleep`, `hybrid` or `spin`.
    pub wake: String,
    /// How long before a release a hybrid wait woke up, at the end of the run, in ns; `null` for
    /// other waits.
    pub margin_ns: Option<u64>,
    /// Scheduler that the kernel granted: `fifo:80`, `other`.
    pub scheduler: String,
    /// CPU that the task was pinned to; `null` if it could move.
    pub cpu: Option<usize>,
    /// Why that CPU was chosen, among all or among several that were named; otherwise absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu_reason: Option<String>,
    /// Cycles that ran, including the warm-up.
    pub cycles: u64,
    /// Cycles at the beginning that no distribution includes.
    pub warm_up_cycles: u64,
    /// Releases that never ran because the previous cycle took too long or the wake-up came too
    /// late.
    pub missed: u64,
    /// Cycles that ended after the next release; `null` for an arm of a bench, which does not count
    /// them.
    pub overruns: Option<u64>,
    /// Cycles that ran but that no distribution includes, because their records were dropped;
    /// `null` for an arm of a bench, which does not count them.
    pub lost_records: Option<u64>,
    /// First instruction of the cycle minus its due time; for a task that follows a service, up to where
    /// it begins to wait for a frame.
    pub release_jitter_ns: Summary,
    /// End of the cycle (frame sent) minus its start.
    pub execution_ns: Summary,
    /// Frame sent minus due time.
    pub response_ns: Summary,
    /// Absolute difference between the interval of two starts and the interval of their due times.
    pub period_error_ns: Summary,
    /// Cycles whose frame came while the task watched for it, of a task that follows a service, including the
    /// warm-up; absent for other tasks, as the next four.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub followed: Option<u64>,
    /// Cycles whose frame lay ready at the release: it came before, or the task woke up late.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found_ready: Option<u64>,
    /// Cycles that began without a new frame, when the time for it was up, including the warm-up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timed_out: Option<u64>,
    /// First instruction of a cycle minus its due time, including the wait for its frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follow_wait_ns: Option<Summary>,
    /// Publish time of the task's last frame in a cycle minus publish time of the frame that the cycle
    /// began with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follow_latency_ns: Option<Summary>,
    /// CPU time of the task's thread per elapsed time, 0 to 1, including time spent spinning.
    pub cpu_fraction: Option<f64>,
    /// Allocations in the task's thread after the warm-up that are not the IPC library's: 0, unless a
    /// block of the program's own allocates.
    pub allocations: Option<u64>,
    /// Allocations by the IPC library after the warm-up: one per frame, in the slack, and some for
    /// each peer that it connects.
    pub ipc_allocations: Option<u64>,
    /// Page faults without I/O after the warm-up, including those that the IPC library causes when
    /// it connects a peer.
    pub minor_faults: Option<u64>,
    /// Page faults with I/O.
    pub major_faults: Option<u64>,
    /// Times the thread gave up its CPU, as a sleep does.
    pub voluntary_switches: Option<u64>,
    /// Times the kernel took the CPU away from the thread.
    pub involuntary_switches: Option<u64>,
    /// Block steps that ended with an error status.
    pub block_errors: Option<u64>,
    /// Samples that their declared type could not hold.
    pub input_rejects: Option<u64>,
    /// Whether its inputs were ok.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<InputReport>,
    /// Changes in the number of a port's peers that the task observed. If one peer leaves and
    /// another joins between two checks, the number does not change.
    pub connects: Option<u64>,
    /// Connections to a peer that failed at first and were retried.
    pub connect_errors: Option<u64>,
    /// Snapshots of the signals that telemetry left out because earlier ones had not been
    /// collected.
    pub lost_snapshots: Option<u64>,
    /// The distributions, keyed by the names of their summaries: HdrHistogram's V2 format,
    /// deflated, in base64 (starts with `HISTFAAA`).
    pub histograms: BTreeMap<String, String>,
}

/// Whether an input of a task was ok, that is, had a fresh and good sample.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct InputReport {
    /// Name of the input.
    pub name: String,
    /// Its unit, if the configuration gives it one.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Whether it was ok at the end.
    pub ok: bool,
    /// How often it ceased to be ok.
    pub falls: u64,
    /// Total time in which it was not ok, including the wait for its first sample.
    pub not_ok_ns: u64,
}

impl TaskReport {
    /// Page faults of both kinds.
    pub fn faults(&self) -> Option<u64> {
        Some(self.minor_faults? + self.major_faults?)
    }
}
