//! Hands the node over to the process that stands by.

use serde::{Deserialize, Serialize};

params! {
    /// Parameters of `switch`: none.
    Switch: changes SwitchParams -> SwitchResult {}
}

/// Result of `switch`: the node is handed over after the cycle that runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SwitchResult {
    /// The process that holds the node until then.
    pub holder: u32,
    /// The process that takes it over.
    pub standby: u32,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> SwitchResult {
    SwitchResult { holder: 1, standby: 2 }
}
