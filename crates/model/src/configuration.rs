//! The changes that a new configuration makes in a running node.

use serde::{Deserialize, Serialize};

use crate::Value;

/// What another configuration changes, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChangeSummary {
    /// Variables and blocks that are new: by their name, or some of a block's instances as `ramp.3 to ramp.7`.
    pub added: Vec<String>,
    /// Variables and blocks that are gone.
    pub removed: Vec<String>,
    /// Blocks that go on with their state and outputs.
    pub kept: Vec<String>,
    /// Input pins of those that have another constant or another wire, and variables with another initial value;
    /// `*` stands for all instances of a block.
    pub changed: Vec<String>,
    /// Limits that differ, as `ramp.*.rate: 0.0 to 50.0 -> 0.0 to 20.0`, or `none` for no limits.
    pub limits: Vec<String>,
}

/// The source of an input pin's value, or of an output that an expression computes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Given {
    /// The value itself: a constant, or what was set.
    Value(Value),
    /// A wire, or an expression.
    Wire {
        /// The signal that it comes from, or the text of the expression.
        wire: String,
    },
}

/// A pin that an `apply` changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChangedValue {
    /// Its name; `*` stands for all instances of a block.
    pub name: String,
    /// Its source before.
    pub before: Given,
    /// Its source in the new configuration.
    pub after: Given,
    /// The type of its values: `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`; `None`: the node's version does not say.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub value_type: Option<String>,
}

/// A parameter that keeps a value which was set, and which the new configuration does not have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tuned {
    /// Its name.
    pub name: String,
    /// The value that it has and keeps.
    pub value: Value,
    /// The value in the new configuration.
    pub configured: Value,
    /// The type of its values: `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`; `None`: the node's version does not say.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub value_type: Option<String>,
}
