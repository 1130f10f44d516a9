//! Lets a node send that goes on from its retained state.

use serde::{Deserialize, Serialize};

params! {
    /// Parameters of `start`: none.
    Start: changes StartParams -> StartResult {}
}

/// Result of `start`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartResult {
    /// Whether the node waited for it; if not, it sent already.
    pub waited: bool,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> StartResult {
    StartResult { waited: true }
}
