//! What was done to a node, as its journal has it.

use serde::{Deserialize, Serialize};

use crate::{Entry, PendingEntry};

/// Of `journal`: a page of its entries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalResult {
    /// How many there are from `since` on.
    pub total: u64,
    /// The oldest of them, as many as `limit` and a message allow.
    pub entries: Vec<Entry>,
    /// What its tasks have not come to yet, and is in the journal from then on: an entry for each task.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pending: Vec<PendingEntry>,
}
