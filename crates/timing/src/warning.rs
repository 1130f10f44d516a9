//! Reasons to read numbers with care.

use serde::{Deserialize, Serialize};

/// A reason to read the numbers with care, and the way out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Warning {
    /// Stable code, such as `rt_denied`.
    pub code: String,
    /// What happened and why.
    pub message: String,
    /// What to do about it, in one line; empty if there is nothing to do.
    pub remedy: String,
}
