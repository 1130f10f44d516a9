//! The active alarms.

use serde::{Deserialize, Serialize};

params! {
    /// Parameters of `alarms`: which page.
    Alarms: looks AlarmsParams -> AlarmsResult {
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }
}

/// Result of `alarms`: a page of the active alarms.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmsResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub alarms: Vec<ActiveAlarm>,
}

/// An alarm: a block that reports an error or needs a caution, an input that is not ok, or frames of a service that
/// are not as expected.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ActiveAlarm {
    /// The block, input or service.
    pub name: String,
    /// Its code, such as `other_writer` or `limits_off`; `None`: a block's error, or an input that is not ok.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// The block's status word; an input has none.
    pub status: Option<u16>,
    /// Its meaning, in words.
    pub meaning: String,
    /// Its task.
    #[serde(default)]
    pub task: String,
    /// The task's cycle in which it began.
    pub since_cycle: u64,
    /// When that cycle was due, ns of UTC since 1970; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since_unix_ns: Option<u64>,
    /// How often it has begun.
    pub count: u64,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> AlarmsResult {
    let alarm = ActiveAlarm {
        name: String::new(),
        code: Some(String::new()),
        status: None,
        meaning: String::new(),
        task: String::new(),
        since_cycle: 0,
        since_unix_ns: Some(0),
        count: 1,
    };
    AlarmsResult { total: 1, alarms: vec![alarm] }
}
