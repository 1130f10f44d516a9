//! The parts of a report that measured something: tasks, links and costs, with their turns.

use std::collections::BTreeMap;

use isochrone_machine::{Cause, Disturbance};
use isochrone_timing::{LinkReport, Summary, TaskReport};
use serde::{Deserialize, Serialize};

/// A cyclic task of a node, or an arm of a bench.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TaskArm {
    /// What it did and cost.
    #[serde(flatten)]
    pub task: TaskReport,
    /// Background load during the run, as the bench named it: `idle`, `cpu`; empty if none was
    /// selected.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub load: String,
    /// Release jitter with one sample for each missed release, as late as it would have been; only
    /// for arms of a bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_jitter_corrected_ns: Option<Summary>,
    /// The corrected release jitter without the invalid turns; only for arms of a bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_jitter_valid_ns: Option<Summary>,
    /// The turns of an arm of a bench.
    #[serde(alias = "blocks", skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<TurnReport>,
    /// The latest releases of an arm of a bench, starting with the latest.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outliers: Vec<Outlier>,
}

impl From<TaskReport> for TaskArm {
    fn from(task: TaskReport) -> Self {
        Self { task, ..Self::default() }
    }
}

/// A stream of frames of a node, or an arm of a bench.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LinkArm {
    /// What was received over it.
    #[serde(flatten)]
    pub link: LinkReport,
    /// Values per frame in an arm of a bench; 0 otherwise.
    #[serde(skip_serializing_if = "is_zero")]
    pub values: u64,
    /// Frames per second that an arm of a bench was set to send; `null` if it sent each as soon as
    /// the previous one was answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paced_hz: Option<f64>,
    /// Cycles of the last node that had no new value to send, when the time to wait for one was up; only
    /// for arms of a bench through nodes that follow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timed_out: Option<u64>,
    /// Due time of the cycle that sent the frame minus the publish time of the oldest sample behind
    /// it: the age of the value when the node was due to read it; only for arms of a bench.
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

/// The cost of block instances.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CostReport {
    /// Block type, or `mixed`: the chain saw, scale, ramp.
    pub name: String,
    /// Number of instances in the task.
    pub instances: u64,
    /// Number of cycles that the task was stepped, including the warm-up.
    pub cycles: u64,
    /// Cycles at the start of each turn, which no distribution includes because the caches held
    /// other arms' data.
    pub warm_up_cycles: u64,
    /// Time of one instance in one cycle, in picoseconds. A sample is the mean over a batch of
    /// cycles.
    pub step_ps: Summary,
    /// The distributions by name, encoded like those of a task.
    pub histograms: BTreeMap<String, String>,
    /// The turns in which it was measured.
    #[serde(alias = "blocks")]
    pub turns: Vec<TurnReport>,
}

/// One turn of an arm.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TurnReport {
    /// Start of the turn, in seconds since the bench started.
    pub at_s: f64,
    /// Duration after the warm-up, in ns; 0 if the report does not say.
    #[serde(skip_serializing_if = "is_zero")]
    pub elapsed_ns: u64,
    /// Samples after the warm-up; for a loop, including one for each missed release.
    pub samples: u64,
    /// Releases missed, or messages lost, after the warm-up.
    pub missed: u64,
    /// The disturbances of the turn.
    pub disturbance: Disturbance,
    /// Why the turn says little about the arm, by the rule fixed beforehand; absent if it is valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<String>,
    /// Its samples, encoded like the histograms of a task.
    pub histogram: String,
}

/// A release that was later than most.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Outlier {
    /// Time of the release, in seconds since the bench started.
    pub at_s: f64,
    /// How late the release was, in ns; for a missed release, how late it would have been.
    pub late_ns: u64,
    /// The disturbances that the kernel counted meanwhile.
    pub cause: Cause,
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}
