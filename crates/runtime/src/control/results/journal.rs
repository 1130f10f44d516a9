//! What was done to a node, as its journal has it.

use serde::{Deserialize, Serialize};

use crate::control::{Value, Values};

/// Of `journal`: a page of its entries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalResult {
    /// How many there are from `since` on.
    pub total: u64,
    /// The oldest of them, as many as `limit` and a message allow.
    pub entries: Vec<JournalEntry>,
    /// What its tasks have not come to yet, and is in the journal from then on: an entry for each task.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pending: Vec<PendingEntry>,
}

/// A transaction that is still to come.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PendingEntry {
    /// Its number.
    pub transaction: u64,
    /// What it will do: `set`, `force`, `release` or `undo`.
    pub action: String,
    /// Its task.
    pub task: String,
    /// The cycle that it waits for.
    pub cycle: u64,
    /// The signals that it will change.
    pub names: Vec<String>,
    /// The values that it will give them; none for a release.
    #[serde(default)]
    pub values: Values,
    /// Who asked for it.
    #[serde(flatten)]
    pub by: AskedBy,
}

/// Who asked for a change, and why.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AskedBy {
    /// Who it was, as they call themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub client: Option<String>,
    /// Their process, where iceoryx2 tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<u32>,
    /// What they said of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// What was done to one task before one of its cycles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry {
    /// Counts the entries, from 1.
    pub sequence: u64,
    /// The transaction that it belongs to; that of the force, for an expiry.
    pub transaction: u64,
    /// What was done.
    pub action: Action,
    /// The task.
    pub task: String,
    /// The first cycle with it.
    pub cycle: u64,
    /// When, ns of UTC since 1970.
    pub unix_ns: u64,
    /// Of a force: the first cycle without it, unless it is held until its release.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_cycle: Option<u64>,
    /// Of an undo: the transaction that was taken back.
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
    /// Of an online change, in a journal file: the new configuration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<String>,
    /// Of an online change: which configuration, and how much of it is new.
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
    /// How many blocks, or ranges of instances, it added.
    pub added: u64,
    /// How many it removed.
    pub removed: u64,
    /// How many pins and wires differ in those that it kept.
    pub changed: u64,
    /// Its limits that differ from those before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<String>,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// What an entry of the journal is about.
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
    /// The configuration was changed.
    Apply,
}

/// A value that was changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The signal.
    pub name: String,
    /// What it was.
    pub before: Value,
    /// What it is; `None` where a wire or a block says so.
    pub after: Option<Value>,
}
