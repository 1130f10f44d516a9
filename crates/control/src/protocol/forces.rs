//! The forces in place.

use serde::{Deserialize, Serialize};

use crate::Force;

params! {
    /// Parameters of `forces`: which page.
    Forces: looks ForcesParams -> ForcesResult {
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }
}

/// Result of `forces`: a page of the forces in place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForcesResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub forces: Vec<Force>,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> ForcesResult {
    let force = Force {
        name: String::new(),
        value: true.into(),
        value_type: Some(String::new()),
        since_cycle: 0,
        until_cycle: None,
        client: None,
    };
    ForcesResult { total: 1, forces: vec![force] }
}
