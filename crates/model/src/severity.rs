//! Severities of process alarms.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What an alarm of the process asks of those who see it.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Nothing: an event that nobody acknowledges.
    Info,
    /// A look, and an acknowledgement.
    #[default]
    Warning,
    /// Something to be done at once, and an acknowledgement.
    Critical,
}

impl Severity {
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
impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}
