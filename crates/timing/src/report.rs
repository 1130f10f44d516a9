//! The report of a run: one JSON document, the same shape from every verb.

use std::collections::BTreeMap;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::bench::{BlockReport, Comparison, Outlier};
use crate::doctor::Finding;
use crate::environment::Environment;
use crate::summary::Summary;

/// What a run did and how punctual it was. `Display` is the table for a terminal.
///
/// Times are integer nanoseconds. When read, unknown keys are ignored and missing ones take their
/// default, so that versions can read each other's reports; only `isochrone` is required.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of the program that wrote the report.
    pub isochrone: String,
    /// The command line, without the program.
    #[serde(default)]
    pub command: Vec<String>,
    /// When the run began: RFC 3339, UTC, whole seconds.
    #[serde(default)]
    pub started: String,
    /// Where it ran.
    #[serde(default)]
    pub environment: Environment,
    /// What was refused, and other reasons to read the numbers with care.
    #[serde(default)]
    pub warnings: Vec<Warning>,
    /// The cyclic tasks.
    #[serde(default)]
    pub tasks: Vec<TaskReport>,
    /// The streams of frames that were received.
    #[serde(default)]
    pub links: Vec<LinkReport>,
    /// What block instances cost.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<CostReport>,
    /// How the arms of a bench compare with the first one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Comparison>,
    /// What the doctor found on the machine beforehand.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
    /// Whether somebody ended the run before its time.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ended_early: bool,
}

impl Report {
    /// A report of a run that starts now, of this version, still without tasks and links.
    pub fn new(command: Vec<String>, environment: Environment) -> Self {
        Self {
            isochrone: env!("CARGO_PKG_VERSION").to_owned(),
            command,
            started: Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
            environment,
            ..Self::default()
        }
    }
}

/// A reason to read the numbers with care, and the way out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Warning {
    /// Stable code, such as `rt_denied`.
    pub code: String,
    /// What happened and why.
    pub message: String,
    /// What to do about it, in one line; empty if there is nothing to do.
    pub remedy: String,
}

/// The timing of one cyclic task; the distributions are of the cycles that ran after the warm-up.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskReport {
    /// Name of the task.
    pub name: String,
    /// Its period, in ns.
    pub period_ns: u64,
    /// What else ran meanwhile, as the bench named it: `idle`, `cpu`; empty if nobody asked.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub load: String,
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
    /// Cycles that ended after the next release.
    pub overruns: u64,
    /// Cycles that ran but are in no distribution, because their records were dropped.
    pub lost_records: u64,
    /// First instruction of the cycle minus its due time.
    pub release_jitter_ns: Summary,
    /// The same with the releases that were missed, each as late as it would have been; of arms of
    /// a bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_jitter_corrected_ns: Option<Summary>,
    /// The same without the invalid blocks; of arms of a bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_jitter_valid_ns: Option<Summary>,
    /// End of the cycle (frame sent) minus its start.
    pub execution_ns: Summary,
    /// Frame sent minus due time.
    pub response_ns: Summary,
    /// |interval between two starts - interval between their due times|.
    pub period_error_ns: Summary,
    /// CPU time of the task's thread per elapsed time, 0 to 1; waiting by spinning counts.
    pub cpu_fraction: f64,
    /// Allocations from a release until the frames were sent: none but what the IPC library needs
    /// for a peer that came just then.
    pub allocations: u64,
    /// Allocations by the IPC library in the slack: one for each frame.
    pub ipc_allocations: u64,
    /// Page faults without I/O.
    pub minor_faults: u64,
    /// Page faults with I/O.
    pub major_faults: u64,
    /// Times that the thread gave up its CPU, as a sleep does.
    pub voluntary_switches: u64,
    /// Times that the CPU was taken away.
    pub involuntary_switches: u64,
    /// Block steps that ended with an error status.
    pub block_errors: u64,
    /// Samples that their declared type could not hold.
    pub input_rejects: u64,
    /// How often the number of a port's peers was seen to change while the task ran; one that left
    /// and one that joined between two looks are not seen.
    pub connects: u64,
    /// Connections to a peer that failed at first, and were tried again.
    pub connect_errors: u64,
    /// Snapshots of the signals that did not become telemetry, because nobody fetched those before.
    pub lost_snapshots: u64,
    /// The distributions themselves, by the names that their summaries have here, as
    /// [`Distribution::encode`](crate::Distribution::encode) writes them.
    pub histograms: BTreeMap<String, String>,
    /// The turns of an arm of a bench.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockReport>,
    /// The latest releases of an arm of a bench, the latest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<Outlier>,
}

/// The timing of one stream of frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkReport {
    /// The service, or the transport that is an arm of a bench.
    pub service: String,
    /// Values in a frame of an arm of a bench; 0 if it is none.
    #[serde(skip_serializing_if = "is_zero")]
    pub values: u64,
    /// Frames per second that an arm of a bench was to send; `None`: each as soon as the one before
    /// was answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paced_hz: Option<f64>,
    /// Frames received, or sent by the node that reports.
    pub frames: u64,
    /// Frames published and not received, or that could not be sent. A control input reads the
    /// newest frame, so a faster publisher loses by design.
    pub lost: u64,
    /// Times that a publisher began anew, or that another one was followed.
    pub restarts: u64,
    /// Frames of other publishers than the one that is followed; they are not read.
    #[serde(skip_serializing_if = "is_zero")]
    pub other_writers: u64,
    /// Frames whose stamps lay in the receiver's future: of another clock. Their ages count from
    /// their arrival, and no latency is taken of them.
    #[serde(skip_serializing_if = "is_zero")]
    pub future_stamps: u64,
    /// Frames that arrived with stamps more than a second older than any wait here explains: of
    /// another clock, or held up while they were sent. They count as old as they say.
    #[serde(skip_serializing_if = "is_zero")]
    pub past_stamps: u64,
    /// Frames that could not be read, because nobody had announced their layout yet.
    #[serde(skip_serializing_if = "is_zero")]
    pub unknown_layouts: u64,
    /// Frames received per second.
    pub rate_hz: Option<f64>,
    /// Received minus published: the last hop.
    pub one_way_ns: Summary,
    /// Received minus the publishing of the oldest sample behind the frame, at the beginning of its
    /// way through all nodes.
    pub end_to_end_ns: Summary,
    /// Published minus the publishing of the oldest sample behind the frame: the age of the value
    /// when the last node sent it on.
    pub age_at_publish_ns: Summary,
    /// Due time of the cycle that sent the frame minus the publishing of the oldest sample behind it:
    /// the age of the value when the node was to read it; of an arm of a bench.
    pub age_at_release_ns: Summary,
    /// The distributions themselves, by name; see [`TaskReport::histograms`].
    pub histograms: BTreeMap<String, String>,
    /// The turns of an arm of a bench.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocks: Vec<BlockReport>,
}

/// What instances of blocks cost.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CostReport {
    /// The block type, or `mixed`: the chain saw, scale, ramp.
    pub name: String,
    /// Instances in the task.
    pub instances: u64,
    /// Cycles that the task was stepped, the warm-up included.
    pub cycles: u64,
    /// First cycles of the turns, which are in no distribution: other arms' data was in the caches.
    pub warm_up_cycles: u64,
    /// Time of one instance in one cycle, in picoseconds; a sample is the mean of a batch of cycles.
    pub step_ps: Summary,
    /// The distributions themselves, by name; see [`TaskReport::histograms`].
    pub histograms: BTreeMap<String, String>,
    /// The turns in which it was measured.
    pub blocks: Vec<BlockReport>,
}

pub(crate) fn is_zero(number: &u64) -> bool {
    *number == 0
}
