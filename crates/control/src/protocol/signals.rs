//! The signals of the node.

use serde::{Deserialize, Serialize};

use crate::Role;

params! {
    /// Parameters of `signals`: which ones.
    Signals: looks SignalsParams -> SignalsResult {
        /// A name or a glob; all signals without it.
        optional pattern "match": Option<String>,
        /// How many to leave out.
        optional offset "offset": Option<u64>,
        /// At most so many; 1000 without it.
        optional limit "limit": Option<u64>,
    }
}

/// Result of `signals`: a page of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalsResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on, as many as `limit` and a message allow.
    pub signals: Vec<SignalDescription>,
}

/// A signal of `signals`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SignalDescription {
    /// Its name.
    pub name: String,
    /// `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`.
    #[serde(rename = "type")]
    pub value_type: String,
    /// Its unit, if one is known: that of the configuration, of its block's type or, for an input, the announced one.
    pub unit: Option<String>,
    /// What the configuration says that it, or its block, is for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
    /// Its role.
    pub role: Role,
    /// Its task.
    pub task: String,
    /// Whether a force holds it.
    pub forced: bool,
    /// Whether `[[protect]]` covers it; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub protected: Option<bool>,
    /// For a parameter that `[limits]` bounds: least and greatest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<[f64; 2]>,
    /// Whether it can also be NaN, for no value: a `callOB`, whose block then runs with the period of its own task.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub can_be_unset: bool,
    /// Its purpose.
    pub doc: String,
}

impl SignalDescription {
    /// What it is for: the comment of the configuration, then its purpose in its block.
    pub fn purpose(&self) -> String {
        let parts = self.comment.iter().chain([&self.doc]).map(String::as_str);
        parts.collect::<Vec<_>>().join(" · ")
    }
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> SignalsResult {
    let signal = SignalDescription {
        name: String::new(),
        value_type: String::new(),
        unit: None,
        comment: Some(String::new()),
        role: Role::Input,
        task: String::new(),
        forced: false,
        protected: Some(false),
        limits: Some([0.0, 1.0]),
        can_be_unset: true,
        doc: String::new(),
    };
    SignalsResult { total: 1, signals: vec![signal] }
}
