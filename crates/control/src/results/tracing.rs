//! A trace of signals.

use serde::{Deserialize, Serialize};

/// Of `trace`: where the rows are, and what stands in them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TraceResult {
    /// By which it is renewed and ended.
    pub id: String,
    /// The frame service that has a frame for each cycle.
    pub service: String,
    /// The task of the signals.
    pub task: String,
    /// From release to release, ns.
    pub period_ns: u64,
    /// The channels that stand before the signals: the timing of the cycle, as telemetry has it.
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
