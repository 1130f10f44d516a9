//! Process alarms: what the configuration says people should know of. What is wrong with the node itself is none.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{AskedBy, Value};

/// What an alarm of the process asks of those who see it.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum AlarmSeverity {
    /// Nothing: an event that nobody acknowledges.
    Info,
    /// A look, and an acknowledgement.
    #[default]
    Warning,
    /// Something to be done at once, and an acknowledgement.
    Critical,
}

impl AlarmSeverity {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Info, Self::Warning, Self::Critical];

    /// The word in configurations and answers: `info`, `warning` or `critical`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Critical => "critical",
        }
    }

    /// Whether somebody has to acknowledge an alarm of this severity.
    pub const fn needs_acknowledgement(self) -> bool {
        !matches!(self, Self::Info)
    }
}

/// The word.
impl fmt::Display for AlarmSeverity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

/// The state of a process alarm, as in ISA-18.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlarmState {
    /// Its condition does not hold, and nothing is left to acknowledge.
    Normal,
    /// Its condition holds, and nobody has acknowledged that.
    ActiveUnacknowledged,
    /// Its condition holds, and somebody has acknowledged it, or nobody needs to.
    ActiveAcknowledged,
    /// Its condition does not hold any more, and nobody has acknowledged that it did.
    ReturnedUnacknowledged,
}

impl AlarmState {
    /// The state of an alarm by its condition and by whether something is left to acknowledge.
    pub const fn of(is_active: bool, is_acknowledged: bool) -> Self {
        match (is_active, is_acknowledged) {
            (false, true) => Self::Normal,
            (true, false) => Self::ActiveUnacknowledged,
            (true, true) => Self::ActiveAcknowledged,
            (false, false) => Self::ReturnedUnacknowledged,
        }
    }

    /// Whether its condition holds.
    pub const fn is_active(self) -> bool {
        matches!(self, Self::ActiveUnacknowledged | Self::ActiveAcknowledged)
    }

    /// Whether somebody has to acknowledge it.
    pub const fn is_unacknowledged(self) -> bool {
        matches!(self, Self::ActiveUnacknowledged | Self::ReturnedUnacknowledged)
    }

    /// In words, for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::ActiveUnacknowledged => "active, unacknowledged",
            Self::ActiveAcknowledged => "active, acknowledged",
            Self::ReturnedUnacknowledged => "returned, unacknowledged",
        }
    }
}

/// When a process alarm came or went, and the value then of the signal that its condition names first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AlarmMoment {
    /// The cycle of its task.
    pub cycle: u64,
    /// When that cycle was due, ns of UTC since 1970.
    pub unix_ns: u64,
    /// The value.
    pub value: Value,
}

/// A process alarm that stands, or that nobody has acknowledged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProcessAlarm {
    /// Its name.
    pub name: String,
    /// Its task.
    pub task: String,
    /// What it asks of people.
    pub severity: AlarmSeverity,
    /// What it says to people.
    pub text: String,
    /// Its condition, as the configuration has it.
    pub when: String,
    /// Its state.
    pub state: AlarmState,
    /// Whether its condition can be evaluated; if not, it stays as it was.
    pub evaluated: bool,
    /// The signal that its condition names first, whose values these are.
    pub signal: String,
    /// The type of that: `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`.
    #[serde(rename = "type")]
    pub value_type: String,
    /// The number of its newest occurrence, from 1; 0: it was never active.
    pub occurrence: u64,
    /// How many of its occurrences nobody has acknowledged.
    pub unacknowledged: u64,
    /// When it came, for the first time since it was last acknowledged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<AlarmMoment>,
    /// When it last came or went.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<AlarmMoment>,
}

/// What the process alarms of a node did in a run, and what they were at its end.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[non_exhaustive]
pub struct AlarmTotals {
    /// How often one came.
    pub came: u64,
    /// How many stood at the end.
    pub standing: u64,
    /// How many of all had occurrences at the end that nobody had acknowledged.
    pub unacknowledged: u64,
    /// Their changes for which there was no room, so that they are in none of these numbers.
    pub lost: u64,
    /// The names of those that stood at the end.
    pub names: Vec<String>,
}

/// What a process alarm did, or what was done to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlarmChange {
    /// It became active: a new occurrence.
    Came,
    /// Its condition does not hold any more.
    Went,
    /// Its condition cannot be evaluated.
    NotEvaluated,
    /// Its condition can be evaluated again.
    Evaluated,
    /// Somebody acknowledged it.
    Acknowledged,
}

impl AlarmChange {
    /// In words, for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Came => "came",
            Self::Went => "went",
            Self::NotEvaluated => "cannot be evaluated",
            Self::Evaluated => "is evaluated again",
            Self::Acknowledged => "acknowledged",
        }
    }

    /// Whether it is about whether the condition can be evaluated.
    pub const fn is_evaluation(self) -> bool {
        matches!(self, Self::NotEvaluated | Self::Evaluated)
    }
}

/// An event of a process alarm. They are numbered by themselves, apart from the entries of operators.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AlarmEntry {
    /// Counts the events of a node, from 1.
    pub sequence: u64,
    /// The alarm.
    pub alarm: String,
    /// Its task.
    pub task: String,
    /// What it asks of people.
    pub severity: AlarmSeverity,
    /// What happened.
    pub change: AlarmChange,
    /// The occurrence that it is about; of an acknowledgement, the last one that it is about.
    pub occurrence: u64,
    /// When, and with which value; of an acknowledgement, the task's last known cycle.
    #[serde(flatten)]
    pub at: AlarmMoment,
    /// The type of the value.
    #[serde(rename = "type")]
    pub value_type: String,
    /// How many events of this alarm were left out before this one: there is one a second at most.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub left_out: u64,
    /// Who acknowledged it.
    #[serde(flatten)]
    pub by: AskedBy,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}
