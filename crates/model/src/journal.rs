//! Changes by operators: entries of the journal, and pending ones.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::{Types, Value, Values};

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Action {
    /// Parameters were set.
    Set,
    /// Signals were forced.
    Force,
    /// Forces were released.
    Release,
    /// A force came to its end.
    Expiry,
    /// A transaction was taken back.
    Undo,
    /// The configuration was changed. Its changes are the parameters that have a new constant.
    Apply,
    /// Occurrences of a process alarm were acknowledged. Its change has the name of the alarm, and the number of the last
    /// occurrence that was acknowledged before and is now.
    Ack,
}

impl Action {
    /// Its word in a journal: `set`, `force`, `release`, `expiry`, `undo`, `apply`, `ack`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Set => "set",
            Self::Force => "force",
            Self::Release => "release",
            Self::Expiry => "expiry",
            Self::Undo => "undo",
            Self::Apply => "apply",
            Self::Ack => "ack",
        }
    }
}

/// The word.
impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// A value that was changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The signal.
    pub name: String,
    /// The value before.
    pub before: Value,
    /// The value now; `None` if it comes from a wire or a block.
    pub after: Option<Value>,
    /// The type of its values: `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`; `None`: the node's version did not say.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub value_type: Option<String>,
}

/// Who asked for a change, and why. Empty: the program that runs the node.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AskedBy {
    /// Who it was, as they call themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub client: Option<String>,
    /// The process of the client, if iceoryx2 knows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<u32>,
    /// The comment on the request.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// An entry of the journal: a change of one task, before one of its cycles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Counts the entries of a node, from 1.
    pub sequence: u64,
    /// The transaction that it belongs to; that of the force, for an expiry.
    pub transaction: u64,
    /// What was done.
    pub action: Action,
    /// The task.
    pub task: String,
    /// The first cycle with it.
    pub cycle: u64,
    /// When that was known, ns of UTC since 1970.
    pub unix_ns: u64,
    /// For a force: the first cycle without it, unless it lasts until it is released.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_cycle: Option<u64>,
    /// For an undo: the transaction that was taken back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undone: Option<u64>,
    /// The values that it changed.
    pub changes: Vec<Change>,
    /// How many more values it changed, of an entry that is too long for an answer.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub left_out: u64,
    /// Who asked for it.
    #[serde(flatten)]
    pub by: AskedBy,
    /// For a change of the configuration: the new text. Answers of a node leave it out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<Arc<str>>,
    /// For a change of the configuration: the extent of the change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub applied: Option<AppliedChange>,
}

/// Which configuration was applied, and how much of it was new.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AppliedChange {
    /// The file that holds it, as the client says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// SHA-256 of its text, hexadecimal.
    pub sha256: String,
    /// How many variables and blocks, or ranges of instances, it added.
    pub added: u64,
    /// How many it removed.
    pub removed: u64,
    /// How many pins, wires and initial values differ in those that it kept.
    pub changed: u64,
    /// Its limits that differ from those before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<String>,
}

/// A transaction that a task has not come to yet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PendingEntry {
    /// Its number.
    pub transaction: u64,
    /// What it will do: `set`, `force`, `release` or `undo`.
    pub action: Action,
    /// Its task.
    pub task: String,
    /// The cycle that it waits for.
    pub cycle: u64,
    /// The signals that it will change.
    pub names: Vec<String>,
    /// The values that it will give them; none for a release.
    #[serde(default)]
    pub values: Values,
    /// By the name of a signal the type of these values; empty: the node's version does not say.
    #[serde(default, skip_serializing_if = "Types::is_empty")]
    pub types: Types,
    /// Who asked for it.
    #[serde(flatten)]
    pub by: AskedBy,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}
