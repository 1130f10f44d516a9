//! The text of the configuration with the running values.

use serde::{Deserialize, Serialize};

params! {
    /// Of `save`: which piece.
    Save: looks SaveParams -> SaveResult {
        /// From which byte on.
        optional offset "offset": Option<u64>,
    }
}

/// Of `save`: a piece of the configuration with the values of now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveResult {
    /// Length of the whole text in bytes.
    pub total: u64,
    /// The text from byte `offset` on, as much as a message holds.
    pub configuration: String,
}

/// With every member that it can have.
#[cfg(test)]
pub(super) fn example() -> SaveResult {
    SaveResult { total: 0, configuration: String::new() }
}
