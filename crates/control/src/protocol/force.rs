//! Holds signals at values, in one transaction.

use serde::{Deserialize, Serialize};

use super::{ByTask, Part};
use crate::{At, Finding, Hold, Types, Values, Written};

params! {
    /// Parameters of `force`: one transaction.
    Force: changes ForceParams -> ForceResult {
        /// The values to hold the signals at.
        required values "values": Values<Written>,
        /// For how long.
        required seconds "seconds": Hold,
        /// The cycle, where all values are of one task; the next one without it.
        optional at "at": Option<At>,
        /// Why; for the journal.
        optional comment "comment": Option<String>,
        /// Who; for the journal.
        optional client "client": Option<String>,
    }
}

/// Result of `force`: the values, and when the force ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForceResult {
    /// The transaction's number.
    pub transaction: u64,
    /// Each task's first cycle with the force.
    pub tasks: ByTask<Part>,
    /// The values before.
    pub before: Values,
    /// The forced values.
    #[serde(default)]
    pub after: Values,
    /// By the name of a signal the type of these values, as many as fit; empty: the node's version does not say.
    #[serde(default, skip_serializing_if = "Types::is_empty")]
    pub types: Types,
    /// Blocks that will report an error with the new values.
    pub warnings: Vec<Finding>,
    /// Each task's first cycle without the force; `None`: until it is released.
    pub until: ByTask<Option<u64>>,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> ForceResult {
    let super::SetResult { transaction, tasks, before, after, types, warnings } =
        super::set::example();
    ForceResult { transaction, tasks, before, after, types, warnings, until: ByTask::new() }
}
