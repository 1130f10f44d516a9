//! The configuration that runs, and another in its place.

use serde::{Deserialize, Serialize};

use super::{ByTask, Part};
use crate::{ChangedValue, Finding, Tuned};

/// Of `save`: a piece of the configuration with the values of now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveResult {
    /// Length of the whole text in bytes.
    pub total: u64,
    /// The text from byte `offset` on, as much as a message holds.
    pub configuration: String,
}

/// Of `apply`: what the new configuration changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ApplyResult {
    /// The transaction's number; `None` after `dry_run`.
    #[serde(default)]
    pub transaction: Option<u64>,
    /// Each task's first cycle with it; empty after `dry_run`.
    pub tasks: ByTask<Part>,
    /// What to know of it: the journal does not have it, or not all tasks.
    #[serde(default)]
    pub warnings: Vec<Finding>,
    /// Blocks that are new.
    pub added: Vec<String>,
    /// Blocks that are gone.
    pub removed: Vec<String>,
    /// Blocks that keep their state.
    pub kept: Vec<String>,
    /// Pins and wires that differ.
    pub changed: Vec<String>,
    /// What those pins had and were given, as many as fit; none if they are more than ten thousand.
    #[serde(default)]
    pub values: Vec<ChangedValue>,
    /// How many more values the answer has no room for.
    #[serde(default)]
    pub values_left_out: usize,
    /// Parameters that keep a value which was set, though the new configuration has another.
    #[serde(default)]
    pub tuned: Vec<Tuned>,
    /// Limits that differ: what they were and are.
    #[serde(default)]
    pub limits: Vec<String>,
    /// What the change costs the task whose slack it takes most of, ns.
    pub cost_ns: u64,
    /// After `dry_run`: why it would be refused now, for want of time between two cycles.
    #[serde(default)]
    pub refused: Option<String>,
}
