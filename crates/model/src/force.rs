//! Signals that are held at a value.

use serde::{Deserialize, Serialize, Serializer};

use crate::Value;

/// A signal that is forced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Force {
    /// The signal.
    pub name: String,
    /// The forced value.
    pub value: Value,
    /// `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`; `None`: the node's version does not say.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub value_type: Option<String>,
    /// Its task's first cycle with the force.
    pub since_cycle: u64,
    /// The first cycle without it; `None`: until it is released.
    pub until_cycle: Option<u64>,
    /// Who asked for it, as they call themselves.
    pub client: Option<String>,
}

/// How long a force lasts. In JSON a number of seconds, or `null`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Hold {
    /// This many seconds, counted in cycles from the first with the force.
    Seconds(f64),
    /// Until it is released, or the node ends.
    #[default]
    UntilReleased,
}

impl Serialize for Hold {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Seconds(seconds) => serializer.serialize_some(seconds),
            Self::UntilReleased => serializer.serialize_none(),
        }
    }
}
