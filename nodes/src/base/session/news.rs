//! Messages between the screen and the session that asks the node.

use std::collections::BTreeMap;

use isochrone_control::{
    ActiveAlarm, DescribeResult, Entry, Force, Hold, ProcessAlarm, SignalDescription, Value, Values,
};
use isochrone_timing::CycleStartCounts;

/// From the session to the screen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum News {
    /// The node answers: for the first time, again, or with another configuration.
    Joined {
        node: DescribeResult,
        signals: Vec<SignalDescription>,
    },
    Described(DescribeResult),
    Values(ReadValues),
    Alarms(Vec<ActiveAlarm>),
    /// The process alarms that stand or that nobody has acknowledged.
    ProcessAlarms(Vec<ProcessAlarm>),
    Forces(Vec<Force>),
    /// Entries of the journal that came since, perhaps with some that are known.
    Journal(Vec<Entry>),
    /// Cycles that telemetry shows.
    Timing(Vec<Sample>),
    Done(CompletedOrder),
    /// An order that the node did not carry out.
    Refused {
        order: Order,
        why: String,
    },
    /// The node does not answer any more; it is looked for.
    Lost {
        absence: Absence,
        why: String,
    },
}

/// The state of a node that does not answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Absence {
    /// It has ended, and its forces with it.
    Ended,
    /// It may go on: its process is stopped, or it is starting.
    Silent,
}

/// Values, and the flags of those that have some.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ReadValues {
    pub(crate) values: Values,
    pub(crate) quality: BTreeMap<String, Vec<String>>,
}

/// The timing of one cycle of a task.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sample {
    pub(crate) task: String,
    pub(crate) cycle: u64,
    /// When it was received, ns of `CLOCK_MONOTONIC`.
    pub(crate) at_ns: u64,
    pub(crate) release_jitter_ns: u64,
    /// Of a task that follows its data.
    pub(crate) follow: Option<FollowSample>,
}

/// How a cycle of a task that follows its data began, and how the cycles until then did.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct FollowSample {
    pub(crate) begun: CycleStartCounts,
    pub(crate) wait_ns: u64,
    /// `None`: the cycle began without a frame, or sent none.
    pub(crate) latency_ns: Option<u64>,
}

/// An order that the node carried out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CompletedOrder {
    pub(crate) order: Order,
    /// `None`: it changed no value.
    pub(crate) transaction: Option<u64>,
    pub(crate) before: Values,
    /// The first cycle of each task with it.
    pub(crate) cycles: Vec<(String, u64)>,
    pub(crate) warnings: Vec<String>,
}

/// From the screen to the session.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Wish {
    /// The signals whose values are wanted from now on.
    Watch(Vec<String>),
    /// The node was changed: how it is now is wanted at once.
    Look,
    /// An order that found no place of its own.
    Order(Order),
}

/// Something that the node is to do.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Order {
    /// The value is also there as people read it.
    Set {
        name: String,
        value: Value,
        to: String,
        comment: Option<String>,
    },
    Force {
        name: String,
        value: Value,
        to: String,
        hold: Hold,
        comment: Option<String>,
    },
    Release {
        name: String,
    },
    /// With what is taken back, in words.
    Undo {
        transaction: u64,
        what: String,
    },
    /// The occurrences of a process alarm up to one.
    Acknowledge {
        alarm: String,
        occurrence: u64,
        comment: Option<String>,
    },
}

impl Order {
    /// The signal that it is about; an undo and an acknowledgement name none.
    pub(crate) fn signal(&self) -> Option<&str> {
        match self {
            Self::Set { name, .. } | Self::Force { name, .. } | Self::Release { name } => {
                Some(name)
            }
            Self::Undo { .. } | Self::Acknowledge { .. } => None,
        }
    }

    /// Whether the node keeps a reason for it.
    pub(crate) fn takes_reason(&self) -> bool {
        matches!(self, Self::Set { .. } | Self::Force { .. } | Self::Acknowledge { .. })
    }

    /// Why it is given.
    pub(crate) fn comment(&self) -> Option<&str> {
        match self {
            Self::Set { comment, .. }
            | Self::Force { comment, .. }
            | Self::Acknowledge { comment, .. } => comment.as_deref(),
            Self::Release { .. } | Self::Undo { .. } => None,
        }
    }

    /// The place of the reason for it; `None`: the node keeps none.
    pub(crate) fn comment_mut(&mut self) -> Option<&mut Option<String>> {
        match self {
            Self::Set { comment, .. }
            | Self::Force { comment, .. }
            | Self::Acknowledge { comment, .. } => Some(comment),
            Self::Release { .. } | Self::Undo { .. } => None,
        }
    }
}

/// As people read it.
impl std::fmt::Display for Order {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Set { name, to, .. } => write!(f, "set {name} to {to}"),
            Self::Force { name, to, hold: Hold::Seconds(seconds), .. } => {
                write!(f, "force {name} to {to} for {seconds} s")
            }
            Self::Force { name, to, hold: Hold::UntilReleased, .. } => {
                write!(f, "force {name} to {to} until it is released")
            }
            Self::Release { name } => write!(f, "release {name}"),
            Self::Acknowledge { alarm, occurrence, .. } => {
                write!(f, "acknowledge {alarm} {occurrence}")
            }
            Self::Undo { transaction, what } => {
                write!(f, "undo transaction {transaction}: {what}")
            }
        }
    }
}
