//! Refusals of the system: the reason, and the way out.

use std::fmt;

use thiserror::Error;

/// Something the set-up asked for and did not get. The loop runs without it, less punctually.
///
/// `Display` is the message, naming the reason; `Debug`, which a `main` prints, has the remedy as well.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{message}")]
pub struct GrantRefusal {
    code: &'static str,
    message: String,
    remedy: String,
}

impl GrantRefusal {
    /// A thread that may not lock its memory.
    pub fn of_memory(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { code: "lock_denied", message: message.into(), remedy: remedy.into() }
    }

    /// A thread that may not have its CPU.
    pub fn of_cpu(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { code: "cpu_denied", message: message.into(), remedy: remedy.into() }
    }

    /// A thread that may not have its priority.
    pub fn of_priority(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { code: "rt_denied", message: message.into(), remedy: remedy.into() }
    }

    /// Stable code for reports: `lock_denied`, `cpu_denied` or `rt_denied`.
    pub fn code(&self) -> &'static str {
        self.code
    }

    /// What to do about it, in one line.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }
}

impl fmt::Debug for GrantRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}; {}", self.remedy)
    }
}
