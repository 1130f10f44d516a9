//! The text of the configuration with the running values.

use serde::{Deserialize, Serialize};

params! {
    /// Parameters of `save`: which piece.
    Save: looks SaveParams -> SaveResult {
        /// From which byte on.
        optional offset "offset": Option<u64>,
    }
}

/// Result of `save`: a piece of the configuration with the current values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveResult {
    /// Length of the whole text in bytes.
    pub total: u64,
    /// The text from byte `offset` on, as much as a message holds.
    pub configuration: String,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> SaveResult {
    SaveResult { total: 0, configuration: String::new() }
}
