//! Sets parameters, in one transaction.

use serde::{Deserialize, Serialize};

use super::ByTask;
use crate::{At, Finding, Types, Values, Written};

params! {
    /// Parameters of `set`: one transaction.
    Set: changes SetParams -> SetResult {
        /// The new values.
        required values "values": Values<Written>,
        /// The cycle, where all values are of one task; the next one without it.
        optional at "at": Option<At>,
        /// Why; for the journal.
        optional comment "comment": Option<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }
}

/// Result of `set`, `release` and `undo`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetResult {
    /// The transaction's number.
    pub transaction: u64,
    /// Each task's first cycle that was stepped with the new values.
    pub tasks: ByTask<Part>,
    /// The values before.
    pub before: Values,
    /// The values now; after a release, those that come neither from a wire nor from a block.
    #[serde(default)]
    pub after: Values,
    /// By the name of a signal the type of these values, as many as fit; empty: the node's version does not say.
    #[serde(default, skip_serializing_if = "Types::is_empty")]
    pub types: Types,
    /// Warnings about the new values: a block will report an error with them, a force holds another value, or the
    /// block does not read them now.
    pub warnings: Vec<Finding>,
}

/// One task's part of a transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The cycle.
    pub cycle: u64,
    /// Whether the cycle is still to come: it was more than a second ahead at the time of the answer.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pending: bool,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> SetResult {
    SetResult {
        transaction: 1,
        tasks: [("TASK".to_owned(), Part { cycle: 0, pending: true })].into(),
        before: Values::default(),
        after: Values::default(),
        types: [("NAME".to_owned(), String::new())].into(),
        warnings: vec![Finding::new("", "").with_help("")],
    }
}
