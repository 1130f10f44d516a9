//! The roles of signals.

use serde::{Deserialize, Serialize};

/// The role of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// A value from another process.
    Input,
    /// A value that operators give; it can be set.
    Variable,
    /// A block's input pin that no wire leads to; it can be set.
    Parameter,
    /// A block's input pin that a wire leads to.
    Wired,
    /// A block's output pin.
    Output,
    /// Whether an input can be believed.
    Ok,
    /// How old an input is; the one signal that cannot be forced.
    Age,
}

impl Role {
    /// Whether operators set it, which the journal, `[limits]`, `apply` and `save` then have to do with.
    pub const fn is_settable(self) -> bool {
        matches!(self, Self::Variable | Self::Parameter)
    }
}
