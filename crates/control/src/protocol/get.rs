//! Values of signals.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::ByTask;
use crate::{Types, Values};

params! {
    /// Parameters of `get`: which values.
    Get: looks GetParams -> GetResult {
        /// Names and globs, at most 4096.
        required names "names": Vec<String>,
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many; 4096 without it.
        optional limit "limit": Option<u64>,
        /// Whether to answer with their types, too.
        optional types "types": Option<bool>,
    }
}

/// Result of `get`: a page of values. The values of a task are all of one cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GetResult {
    /// How many there are on all pages. Pages are of different cycles.
    pub total: u64,
    /// The cycle of each task's values.
    pub tasks: ByTask<ReadAt>,
    /// The values.
    pub values: Values,
    /// By the name of a signal the flags that a frame with it alone would carry, if any; an input's `ok`
    /// and `age` have none. `None`: the node does not say.
    #[serde(default)]
    pub quality: Option<BTreeMap<String, Vec<String>>>,
    /// By the name of a signal its type, of all values of the page; `None`: they were not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub types: Option<Types>,
}

/// When values were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReadAt {
    /// The cycle, after its blocks were stepped.
    pub cycle: u64,
    /// When it was due, ns of `CLOCK_MONOTONIC`.
    pub release_ns: u64,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> GetResult {
    GetResult {
        total: 0,
        tasks: [("TASK".to_owned(), ReadAt { cycle: 0, release_ns: 0 })].into(),
        values: Values::default(),
        quality: Some(BTreeMap::new()),
        types: Some(Types::new()),
    }
}
