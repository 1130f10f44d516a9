//! The changes that operators made.

use serde::{Deserialize, Serialize};

use crate::{Entry, PendingEntry};

params! {
    /// Parameters of `journal`: which entries.
    Journal: looks JournalParams -> JournalResult {
        /// The first one's `sequence`; the oldest that is kept without it.
        optional since "since": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }
}

/// Result of `journal`: a page of its entries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalResult {
    /// How many there are from `since` on.
    pub total: u64,
    /// The oldest of them, as many as `limit` and a message allow.
    pub entries: Vec<Entry>,
    /// Requests that tasks have not applied yet, after which they are in the journal: an entry for each task.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pending: Vec<PendingEntry>,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> JournalResult {
    use crate::{Action, AppliedChange, AskedBy, Change, Value, Values};

    let text = || Some(String::new());
    let by = AskedBy { client: text(), process: Some(0), comment: text() };
    let entry = Entry {
        sequence: 1,
        transaction: 1,
        action: Action::Set,
        task: String::new(),
        cycle: 0,
        unix_ns: 0,
        until_cycle: Some(0),
        undone: Some(0),
        changes: vec![Change {
            name: String::new(),
            before: Value::Bool(true),
            after: None,
            value_type: text(),
        }],
        left_out: 1,
        by: by.clone(),
        configuration: Some("".into()),
        applied: Some(AppliedChange {
            file: Some(String::new()),
            sha256: String::new(),
            added: 0,
            removed: 0,
            changed: 0,
            limits: vec![String::new()],
        }),
    };
    let pending = PendingEntry {
        transaction: 1,
        action: Action::Set,
        task: String::new(),
        cycle: 0,
        names: vec![String::new()],
        values: Values::default(),
        types: [("NAME".to_owned(), String::new())].into(),
        by,
    };
    JournalResult { total: 1, entries: vec![entry], pending: vec![pending] }
}
