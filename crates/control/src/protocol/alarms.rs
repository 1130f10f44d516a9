//! What is wrong now.

use serde::{Deserialize, Serialize};

params! {
    /// Of `alarms`: which page.
    Alarms: looks AlarmsParams -> AlarmsResult {
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
    }
}

/// Of `alarms`: a page of what is wrong now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmsResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub alarms: Vec<ActiveAlarm>,
}

/// A block that reports an error or needs a caution, an input that is not ok, or what is wrong with the frames of
/// a service.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ActiveAlarm {
    /// The block, input or service.
    pub name: String,
    /// What kind it is of, such as `other_writer` or `limits_off`; `None`: a block's error, or an input that is not ok.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<String>,
    /// The block's status word; an input has none.
    pub status: Option<u16>,
    /// What that means.
    pub meaning: String,
    /// Its task.
    #[serde(default)]
    pub task: String,
    /// The task's cycle since when it is so.
    pub since_cycle: u64,
    /// When that cycle was due, ns of UTC since 1970; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since_unix_ns: Option<u64>,
    /// How often it came.
    pub count: u64,
}

/// With every member that it can have.
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
