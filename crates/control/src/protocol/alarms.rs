//! The active alarms: what is wrong with the node, and apart from that the process alarms.

#[cfg(test)]
use crate::{AlarmChange, AlarmMoment, AlarmSeverity, AlarmState, AskedBy, Value};
use crate::{AlarmEntry, ProcessAlarm};
use serde::{Deserialize, Serialize};

params! {
    /// Parameters of `alarms`: which page.
    Alarms: looks AlarmsParams -> AlarmsResult {
        /// How many to leave out, of the alarms and then of the process alarms.
        optional offset "offset": Option<u64>,
        /// At most so many.
        optional limit "limit": Option<u64>,
        /// The first event's `sequence`; none without it.
        optional since "since": Option<u64>,
    }
}

/// Result of `alarms`: a page of the active alarms, and of the process alarms.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct AlarmsResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub alarms: Vec<ActiveAlarm>,
    /// How many process alarms there are on all pages.
    #[serde(default)]
    pub process_total: u64,
    /// Process alarms that stand, that nobody has acknowledged, or that cannot be evaluated. They go on where `alarms`
    /// end: the first of them is number `total`.
    #[serde(default)]
    pub process: Vec<ProcessAlarm>,
    /// The events of process alarms from `since` on, the oldest first, as many as `limit` and a message allow.
    #[serde(default)]
    pub events: Vec<AlarmEntry>,
    /// The `sequence` of the newest event; 0: there was none.
    #[serde(default)]
    pub newest_event: u64,
    /// How many changes of process alarms no turn of the node saw, as a cycle found no room to tell of them.
    #[serde(default)]
    pub lost_events: u64,
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

impl AlarmsResult {
    /// How many alarms there are on all pages, and those of this page: of the node, then of the process.
    pub fn page(self) -> (u64, Vec<ListedAlarm>) {
        let alarms = self.alarms.into_iter().map(ListedAlarm::Node);
        let process = self.process.into_iter().map(ListedAlarm::Process);
        (self.total + self.process_total, alarms.chain(process).collect())
    }
}

/// An alarm of either kind.
#[derive(Debug, Clone, PartialEq)]
pub enum ListedAlarm {
    /// Something is wrong with the node.
    Node(ActiveAlarm),
    /// A process alarm.
    Process(ProcessAlarm),
}

impl ListedAlarm {
    /// Sorts the alarms of all pages by their kind.
    pub fn sorted(all: Vec<Self>) -> (Vec<ActiveAlarm>, Vec<ProcessAlarm>) {
        let (mut of_node, mut of_process) = (Vec::new(), Vec::new());
        for alarm in all {
            match alarm {
                Self::Node(alarm) => of_node.push(alarm),
                Self::Process(alarm) => of_process.push(alarm),
            }
        }
        (of_node, of_process)
    }
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
    let process = process_example();
    let event = AlarmEntry {
        sequence: 1,
        alarm: String::new(),
        task: String::new(),
        severity: process.severity,
        change: AlarmChange::Came,
        occurrence: 1,
        at: process.first.unwrap(),
        value_type: String::new(),
        left_out: 1,
        by: AskedBy { client: Some(String::new()), process: Some(0), comment: Some(String::new()) },
    };
    AlarmsResult {
        total: 1,
        alarms: vec![alarm],
        process_total: 1,
        process: vec![process],
        events: vec![event],
        newest_event: 1,
        lost_events: 0,
    }
}

/// A process alarm with every member that it can have.
#[cfg(test)]
pub(super) fn process_example() -> ProcessAlarm {
    let moment = AlarmMoment { cycle: 0, unix_ns: 0, value: Value::Bool(true) };
    ProcessAlarm {
        name: String::new(),
        task: String::new(),
        severity: AlarmSeverity::Warning,
        text: String::new(),
        when: String::new(),
        state: AlarmState::ActiveUnacknowledged,
        evaluated: true,
        signal: String::new(),
        value_type: String::new(),
        occurrence: 1,
        unacknowledged: 1,
        first: Some(moment),
        last: Some(moment),
    }
}
