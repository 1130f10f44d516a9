//! Gives the node another configuration.

use serde::{Deserialize, Serialize};

use super::{ByTask, Part};
use crate::{ChangedValue, Finding, Tuned};

params! {
    /// Parameters of `apply`: the new configuration.
    Apply: changes ApplyParams -> ApplyResult {
        /// Its TOML text.
        required configuration "configuration": String,
        /// The file that holds it; for the journal.
        optional file "file": Option<String>,
        /// Only say what it would change and cost.
        optional dry_run "dry_run": Option<bool>,
        /// Apply it even if that costs cycles.
        optional allow_missed "allow_missed": Option<bool>,
        /// Why; for the journal.
        optional comment "comment": Option<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }
}

/// Result of `apply`: what the new configuration changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ApplyResult {
    /// The transaction's number; `None` after `dry_run`.
    #[serde(default)]
    pub transaction: Option<u64>,
    /// Each task's first cycle with it; empty after `dry_run`.
    pub tasks: ByTask<Part>,
    /// Warnings: the journal does not have it, or not all tasks have it.
    #[serde(default)]
    pub warnings: Vec<Finding>,
    /// Blocks and variables that are added.
    pub added: Vec<String>,
    /// Blocks and variables that are removed.
    pub removed: Vec<String>,
    /// Blocks that keep their state.
    pub kept: Vec<String>,
    /// Pins, wires and initial values of variables that differ.
    pub changed: Vec<String>,
    /// The values of those pins before and after, as many as fit; none if there are more than ten thousand.
    #[serde(default)]
    pub values: Vec<ChangedValue>,
    /// How many more values the answer has no room for.
    #[serde(default)]
    pub values_left_out: usize,
    /// Parameters that keep a value that was set, although the new configuration has another.
    #[serde(default)]
    pub tuned: Vec<Tuned>,
    /// Limits that differ: before and after.
    #[serde(default)]
    pub limits: Vec<String>,
    /// Alarms of which occurrences are lost that nobody has acknowledged, as the alarm is gone or has another condition.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lost_alarms: Vec<String>,
    /// What the change costs the task whose slack it takes most of, ns.
    pub cost_ns: u64,
    /// After `dry_run`: why it would be refused now, if there is too little time between two cycles.
    #[serde(default)]
    pub refused: Option<String>,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> ApplyResult {
    use crate::Given;

    let super::SetResult { tasks, warnings, .. } = super::set::example();
    ApplyResult {
        transaction: Some(1),
        tasks,
        warnings,
        added: Vec::new(),
        removed: Vec::new(),
        kept: Vec::new(),
        changed: Vec::new(),
        values: vec![ChangedValue {
            name: String::new(),
            before: Given::Value(true.into()),
            after: Given::Wire { wire: String::new() },
            value_type: Some(String::new()),
        }],
        values_left_out: 0,
        tuned: vec![Tuned {
            name: String::new(),
            value: true.into(),
            configured: true.into(),
            value_type: Some(String::new()),
        }],
        limits: Vec::new(),
        lost_alarms: vec![String::new()],
        cost_ns: 0,
        refused: Some(String::new()),
    }
}
