//! Permissions of operators.

use serde::{Deserialize, Serialize};

/// What others may do to the values of a running node, as `[node] control` says. Each allows what those before it
/// do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// Nothing: there is no control service.
    Off,
    /// Read them.
    Read,
    /// Set parameters.
    #[default]
    Set,
    /// Force signals, and change the configuration.
    Force,
}

impl Access {
    /// All choices.
    pub const ALL: [Self; 4] = [Self::Off, Self::Read, Self::Set, Self::Force];

    /// The word in configurations: `off`, `read`, `set` or `force`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Read => "read",
            Self::Set => "set",
            Self::Force => "force",
        }
    }
}
