//! The service that a task follows.

use serde::{Deserialize, Serialize};

/// The service that a task follows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Followed {
    /// Its name.
    pub service: String,
    /// How long after a release the task watches the clock and the service for a frame, ns; less than its period.
    pub within_ns: u64,
}
