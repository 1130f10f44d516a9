//! Acknowledges a process alarm.

use serde::{Deserialize, Serialize};

use crate::ProcessAlarm;

params! {
    /// Parameters of `ack`: which alarm.
    Ack: changes AckParams -> AckResult {
        /// Its name.
        required alarm "alarm": String,
        /// The last occurrence to acknowledge; the newest one without it.
        optional occurrence "occurrence": Option<u64>,
        /// Why; for the events.
        optional comment "comment": Option<String>,
        /// Who; for the events.
        optional client "client": Option<String>,
    }
}

/// Result of `ack`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AckResult {
    /// The alarm as it is now. Its state is `normal` if that was all.
    pub alarm: ProcessAlarm,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> AckResult {
    AckResult { alarm: super::alarms::process_example() }
}
