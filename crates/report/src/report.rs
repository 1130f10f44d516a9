//! The report of a run: one JSON document, the same shape from every verb.

use std::collections::BTreeMap;

use isochrone_machine::{Environment, Finding};
use isochrone_timing::{LinkReport, Summary, TaskReport, Warning};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::bench::{Comparison, LeftOut, Outlier, TurnReport};

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
    pub tasks: Vec<TaskArm>,
    /// The streams of frames that were received.
    #[serde(default)]
    pub links: Vec<LinkArm>,
    /// What block instances cost.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<CostReport>,
    /// How the arms of a bench compare with the first one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Comparison>,
    /// Comparisons that the samples do not allow, and how much longer to run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
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

/// A cyclic task: of a node, or an arm of a bench.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskArm {
    /// What it did and cost.
    #[serde(flatten)]
    pub task: TaskReport,
    /// What else ran meanwhile, as the bench named it: `idle`, `cpu`; empty if nobody asked.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub load: String,
    /// The same with the releases that were missed, each as late as it would have been; of arms of
    /// a bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_jitter_corrected_ns: Option<Summary>,
    /// The same without the invalid turns; of arms of a bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_jitter_valid_ns: Option<Summary>,
    /// The turns of an arm of a bench.
    #[serde(alias = "blocks", skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<TurnReport>,
    /// The latest releases of an arm of a bench, the latest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<Outlier>,
}

impl From<TaskReport> for TaskArm {
    fn from(task: TaskReport) -> Self {
        Self { task, ..Self::default() }
    }
}

/// A stream of frames: of a node, or an arm of a bench.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkArm {
    /// What came over it.
    #[serde(flatten)]
    pub link: LinkReport,
    /// Values in a frame of an arm of a bench; 0 if it is none.
    #[serde(skip_serializing_if = "is_zero")]
    pub values: u64,
    /// Frames per second that an arm of a bench was to send; `null`: each as soon as the one before
    /// was answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paced_hz: Option<f64>,
    /// Due time of the cycle that sent the frame minus the publishing of the oldest sample behind it:
    /// the age of the value when the node was to read it; of an arm of a bench.
    pub age_at_release_ns: Summary,
    /// The turns of an arm of a bench.
    #[serde(alias = "blocks", skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<TurnReport>,
}

impl From<LinkReport> for LinkArm {
    fn from(link: LinkReport) -> Self {
        Self { link, ..Self::default() }
    }
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
    /// The distributions themselves, by name, encoded as those of a task.
    pub histograms: BTreeMap<String, String>,
    /// The turns in which it was measured.
    #[serde(alias = "blocks")]
    pub turns: Vec<TurnReport>,
}

pub(crate) fn is_zero(number: &u64) -> bool {
    *number == 0
}
