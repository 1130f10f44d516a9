//! Every cycle of selected signals of one task.

use serde::{Deserialize, Serialize};

params! {
    /// Parameters of `trace`: the `signals` of a new trace, or the `id` of one to renew or end.
    Trace: looks TraceParams -> TraceResult {
        /// Names and globs of signals of one task.
        optional signals "signals": Option<Vec<String>>,
        /// The id of a trace.
        optional id "id": Option<String>,
        /// Whether to end it.
        optional end "end": Option<bool>,
    }
}

/// Result of `trace`: where the rows are, and what is in them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TraceResult {
    /// The id with which it is renewed and ended.
    pub id: String,
    /// The frame service that has a frame for each cycle.
    pub service: String,
    /// The task of the signals.
    pub task: String,
    /// From release to release, ns.
    pub period_ns: u64,
    /// The channels before the signals: the timing of the cycle, as in telemetry.
    pub timing: Vec<String>,
    /// The signals, in the order in which they were named.
    pub signals: Vec<TracedSignal>,
}

/// A signal of a trace.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TracedSignal {
    /// Its name.
    pub name: String,
    /// `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`.
    #[serde(rename = "type")]
    pub value_type: String,
    /// Its unit, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> TraceResult {
    let signal =
        TracedSignal { name: String::new(), value_type: String::new(), unit: Some(String::new()) };
    TraceResult {
        id: String::new(),
        service: String::new(),
        task: String::new(),
        period_ns: 0,
        timing: vec![String::new()],
        signals: vec![signal],
    }
}
