//! The result of a check.

use serde::{Deserialize, Serialize};

/// How much a finding matters to a real-time task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// As it should be.
    Ok,
    /// Worth knowing when reading numbers; also used for what could not be determined.
    Note,
    /// Makes cycles late, and can be changed.
    Warning,
    /// A real-time task does not get what it asks for.
    Problem,
}

/// The result of one check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckResult {
    /// Stable name of the check, such as `preemption`.
    pub code: String,
    /// How much it matters: `ok`, `note`, `warning` or `problem`.
    pub severity: Severity,
    /// What was found; starts with `unknown` if it could not be read.
    pub value: String,
    /// Parts of the value, if it has parts.
    pub details: Vec<String>,
    /// Where it was read.
    pub source: String,
    /// Its effect on jitter.
    pub effect: String,
    /// A command or setting that changes it, on one line; `null` if there is nothing to do.
    pub fix: Option<String>,
    /// Whether the setting has no effect on this machine.
    pub inert: bool,
    /// Why the setting has no effect; `null` if it has one.
    pub inert_why: Option<String>,
}
