//! Signals and their values.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::ByTask;
use crate::{Role, Values};

/// Of `signals`: a page of them.
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
    /// Its unit, if it has one.
    pub unit: Option<String>,
    /// What it is.
    pub role: Role,
    /// Its task.
    pub task: String,
    /// Whether a force holds it.
    pub forced: bool,
    /// Whether `[[protect]]` takes it out of reach; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub protected: Option<bool>,
    /// Of a parameter that `[limits]` bounds: least and greatest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<[f64; 2]>,
    /// Whether it can also be NaN, which is no value: of a `callOB`, whose block then runs with the period of
    /// its own task.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub can_be_unset: bool,
    /// What it is for.
    pub doc: String,
}

/// Of `get`: a page of values, all of a task of one cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GetResult {
    /// How many there are on all pages. Pages are of different cycles.
    pub total: u64,
    /// The cycle of each task's values.
    pub tasks: ByTask<ReadAt>,
    /// The values.
    pub values: Values,
    /// By the name of a signal the flags that a frame with it alone would carry, if any; an input's `ok`
    /// and `age` have none. `None`: the node does not say.
    #[serde(default)]
    pub quality: Option<BTreeMap<String, Vec<String>>>,
}

/// When values were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReadAt {
    /// The cycle, after its blocks were stepped.
    pub cycle: u64,
    /// When it was due, ns of `CLOCK_MONOTONIC`.
    pub release_ns: u64,
}
