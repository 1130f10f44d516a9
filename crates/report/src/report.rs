//! The report of a run: one JSON document, the same shape from every verb.

use std::collections::BTreeMap;
use std::time::SystemTime;

use isochrone_machine::{CheckResult, Environment};
use isochrone_timing::{LinkReport, Summary, TaskReport, Warning};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::bench::{Comparison, LeftOut, Outlier, TurnReport};

/// The report of a run: its activity and punctuality. `Display` prints a table for a terminal.
///
/// Times are integers in nanoseconds. A reader ignores unknown keys and uses defaults for missing
/// ones, so that versions can read each other's reports; only `isochrone` is required.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of the program that wrote the report.
    pub isochrone: String,
    /// The program, if it is one of your own with the verbs of isochrone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program: Option<ProgramVersion>,
    /// Command line without the program name.
    #[serde(default)]
    pub command: Vec<String>,
    /// Start of the run: RFC 3339, UTC, whole seconds.
    #[serde(default)]
    pub started: String,
    /// The machine that it ran on.
    #[serde(default)]
    pub environment: Environment,
    /// Rights that were refused and other reasons to treat the numbers with care.
    #[serde(default)]
    pub warnings: Vec<Warning>,
    /// The cyclic tasks.
    #[serde(default)]
    pub tasks: Vec<TaskArm>,
    /// The streams of frames that were received.
    #[serde(default)]
    pub links: Vec<LinkArm>,
    /// The node's recording, if it was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<RecordingReport>,
    /// The cost of block instances.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<CostReport>,
    /// How each arm of a bench compares with the first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub comparisons: Vec<Comparison>,
    /// Comparisons that the samples do not support, each with how much longer to run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// The doctor's findings on the machine before the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<CheckResult>,
    /// Whether the run was ended before its time.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ended_early: bool,
}

impl Report {
    /// A report of this version for a run that starts now, without tasks and links.
    pub fn new(command: Vec<String>, environment: Environment) -> Self {
        Self {
            isochrone: env!("CARGO_PKG_VERSION").to_owned(),
            command,
            environment,
            ..Self::default()
        }
        .started_at(SystemTime::now())
    }

    /// The same of a run that started at another time, at the latest in the year 9999.
    #[must_use]
    pub fn started_at(self, time: SystemTime) -> Self {
        let time = Timestamp::try_from(time).unwrap_or(Timestamp::MAX);
        Self { started: time.strftime("%Y-%m-%dT%H:%M:%SZ").to_string(), ..self }
    }
}

/// A program with the verbs of isochrone, and its own version.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ProgramVersion {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// What a node's recording has.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordingReport {
    /// Its file, as it was named.
    pub file: String,
    /// Cycles in the file, of all tasks.
    pub cycles: u64,
    /// Cycles that ran and are not in the file.
    pub lost: u64,
    /// Entries of the journal in the file.
    pub entries: u64,
    /// Size of the file, without the index at its end.
    pub bytes: u64,
    /// Whether it has everything that the node did.
    pub is_complete: bool,
}

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

pub(crate) fn is_zero(number: &u64) -> bool {
    *number == 0
}
