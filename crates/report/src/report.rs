//! The report of a run: one JSON document, the same shape from every verb.

mod arms;

use std::time::SystemTime;

use isochrone_machine::{CheckResult, Environment};
use isochrone_model::AlarmTotals;
use isochrone_timing::Warning;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::bench::{Comparison, LeftOut};

pub use arms::{CostReport, LinkArm, Outlier, TaskArm, TurnReport};

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
    /// What the process alarms of the node did, if it has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process_alarms: Option<AlarmTotals>,
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
