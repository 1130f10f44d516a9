//! What became of values that were set or forced.

use serde::{Deserialize, Serialize};

use super::ByTask;
use crate::{Finding, Force, Values};

/// Of `set`, `release` and `undo`: what happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetResult {
    /// The transaction's number.
    pub transaction: u64,
    /// Each task's first cycle that was stepped with the new values.
    pub tasks: ByTask<Part>,
    /// What the values were.
    pub before: Values,
    /// What they are; of a release, those that no wire and no block says.
    #[serde(default)]
    pub after: Values,
    /// What to know of the new values: a block will report an error with them, a force holds another, or
    /// the block does not read them now.
    pub warnings: Vec<Finding>,
}

/// Of `force`: what happened, and until when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForceResult {
    /// The transaction's number.
    pub transaction: u64,
    /// Each task's first cycle with the force.
    pub tasks: ByTask<Part>,
    /// What the values were.
    pub before: Values,
    /// Blocks that will report an error with the new values.
    pub warnings: Vec<Finding>,
    /// Each task's first cycle without the force; `None`: until it is released.
    pub until: ByTask<Option<u64>>,
}

/// One task's part of a transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The cycle.
    pub cycle: u64,
    /// Whether it is still to come: it was more than a second ahead when this was answered.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pending: bool,
}

/// Of `forces`: a page of what is forced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForcesResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub forces: Vec<Force>,
}
