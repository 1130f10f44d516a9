//! What the methods answer.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Finding, Value, Values};

/// By the name of a task.
pub type ByTask<T> = BTreeMap<String, T>;

/// What operators may do, as `[node] control` says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// Nothing: there is no service.
    Off,
    /// Look.
    Read,
    /// Also set parameters.
    Set,
    /// Also force signals and change the configuration.
    Force,
}

/// Of `describe`: what the node is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DescribeResult {
    /// Its name.
    pub node: String,
    /// The version of isochrone.
    pub version: String,
    /// What operators may do.
    pub control: Access,
    /// What it was made from.
    pub configuration: ConfigurationOrigin,
    /// When it started, ns of UTC since 1970.
    pub started_unix_ns: u64,
    /// Its tasks, in the order of the configuration.
    pub tasks: Vec<TaskDescription>,
}

/// What a node was made from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConfigurationOrigin {
    /// The file, as it was given.
    pub file: String,
    /// SHA-256 of its text, hexadecimal.
    pub sha256: String,
    /// Whether a value or the configuration was changed since.
    pub changed: bool,
}

/// A task of `describe`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskDescription {
    /// Its name.
    pub name: String,
    /// From release to release, ns.
    pub period_ns: u64,
    /// Of its first release after that of the grid, ns.
    pub phase_ns: u64,
    /// The cycle that is due by the clock.
    pub cycle: u64,
    /// The last cycle that it is known to have run; `None`: none is known yet.
    #[serde(default)]
    pub last_cycle: Option<u64>,
    /// How long it has not run, ns, where it should have: it hangs, or the node is held up. `None`: it runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stands_ns: Option<u64>,
    /// Cycles that did not run.
    pub missed: u64,
    /// Cycles that did not end before the next release.
    pub overruns: u64,
    /// How many parameters it has.
    pub parameters: u64,
    /// How many of its signals are forced.
    pub forces: u64,
    /// When it needs which CPU; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement: Option<Placement>,
}

/// When a task needs which CPU. Times in ns.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Placement {
    /// The CPU that it is pinned to; `None`: it may move.
    pub cpu: Option<u32>,
    /// What the kernel granted: `other`, or `fifo:80` with real-time priority 80.
    pub scheduler: String,
    /// How it waits for a release: `sleep`, `hybrid` or `spin`.
    pub wake: String,
    /// When its first cycle was due, on `CLOCK_MONOTONIC`.
    pub first_release_ns: u64,
    /// The longest that it watches the clock before a release.
    pub longest_watch_ns: u64,
    /// From a release to the end of its cycle, median of the last 63 cycles; `None`: no cycle was seen yet.
    pub response_ns: Option<u64>,
    /// Why it has its phase, if `phase = "auto"` chose it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_reason: Option<String>,
    /// Why that CPU was chosen; `None` if the configuration names it, or leaves the thread to the kernel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_reason: Option<String>,
    /// What its cycles begin with, if it follows a service.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub follow: Option<Followed>,
    /// The services that it publishes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sends: Vec<String>,
}

/// The service that a task follows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Followed {
    /// Its name.
    pub service: String,
    /// How long after a release the task watches the clock and the service for a frame, ns.
    pub within_ns: u64,
}

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
    /// What it is for.
    pub doc: String,
}

/// What a signal is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// A value from another process.
    Input,
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

/// Of `set`, `release` and `undo`: what happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetResult {
    /// The transaction's number.
    pub transaction: u64,
    /// Each task's first cycle that was stepped with the new values.
    pub tasks: ByTask<Part>,
    /// What the values were.
    pub before: Values,
    /// What they are; of a release, those that no wire and no block says.
    #[serde(default)]
    pub after: Values,
    /// What to know of the new values: a block will report an error with them, a force holds another, or
    /// the block does not read them now.
    pub warnings: Vec<Finding>,
}

/// Of `force`: what happened, and until when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForceResult {
    /// The transaction's number.
    pub transaction: u64,
    /// Each task's first cycle with the force.
    pub tasks: ByTask<Part>,
    /// What the values were.
    pub before: Values,
    /// Blocks that will report an error with the new values.
    pub warnings: Vec<Finding>,
    /// Each task's first cycle without the force; `None`: until it is released.
    pub until: ByTask<Option<u64>>,
}

/// One task's part of a transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// The cycle.
    pub cycle: u64,
    /// Whether it is still to come: it was more than a second ahead when this was answered.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pending: bool,
}

/// Of `forces`: a page of what is forced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ForcesResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub forces: Vec<Force>,
}

/// A signal that is forced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Force {
    /// The signal.
    pub name: String,
    /// What it is held at.
    pub value: Value,
    /// Its task's first cycle with the force.
    pub since_cycle: u64,
    /// The first cycle without it; `None`: until it is released.
    pub until_cycle: Option<u64>,
    /// Who asked for it, as they call themselves.
    pub client: Option<String>,
}

/// Of `journal`: a page of its entries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalResult {
    /// How many there are from `since` on.
    pub total: u64,
    /// The oldest of them, as many as `limit` and a message allow.
    pub entries: Vec<JournalEntry>,
    /// What waits for a cycle that it names, and is in the journal from then on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pending: Vec<PendingEntry>,
}

/// A transaction that is still to come.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PendingEntry {
    /// Its number.
    pub transaction: u64,
    /// What it will do: `set`, `force`.
    pub action: String,
    /// Its task.
    pub task: String,
    /// The cycle that it waits for.
    pub cycle: u64,
    /// The signals that it will change.
    pub names: Vec<String>,
    /// Who asked for it, as they call themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub client: Option<String>,
    /// Their process, where iceoryx2 tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<u32>,
    /// What they said of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// What was done to one task before one of its cycles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry {
    /// Counts the entries, from 1.
    pub sequence: u64,
    /// The transaction that it belongs to; that of the force, for an expiry.
    pub transaction: u64,
    /// What was done.
    pub action: Action,
    /// The task.
    pub task: String,
    /// The first cycle with it.
    pub cycle: u64,
    /// When, ns of UTC since 1970.
    pub unix_ns: u64,
    /// Of a force: the first cycle without it, unless it is held until its release.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_cycle: Option<u64>,
    /// Of an undo: the transaction that was taken back.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undone: Option<u64>,
    /// The values that it changed.
    pub changes: Vec<Change>,
    /// How many more values it changed, of an entry that is too long for an answer.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub left_out: u64,
    /// Who asked for it, as they call themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub client: Option<String>,
    /// Their process, where iceoryx2 tells it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub process: Option<u32>,
    /// What they said of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
    /// Of an online change, in a journal file: the new configuration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub configuration: Option<String>,
    /// Of an online change: which configuration, and how much of it is new.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub applied: Option<AppliedChange>,
}

/// Which configuration was applied, and how much of it was new.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AppliedChange {
    /// The file that holds it, as the client says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// SHA-256 of its text, hexadecimal.
    pub sha256: String,
    /// How many blocks, or ranges of instances, it added.
    pub added: u64,
    /// How many it removed.
    pub removed: u64,
    /// How many pins and wires differ in those that it kept.
    pub changed: u64,
    /// Its limits that differ from those before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<String>,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// What an entry of the journal is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Action {
    /// Parameters were set.
    Set,
    /// Signals were forced.
    Force,
    /// Forces were released.
    Release,
    /// A force came to its end.
    Expiry,
    /// A transaction was taken back.
    Undo,
    /// The configuration was changed.
    Apply,
}

/// A value that was changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The signal.
    pub name: String,
    /// What it was.
    pub before: Value,
    /// What it is; `None` where a wire or a block says so.
    pub after: Option<Value>,
}

/// Of `alarms`: a page of what is wrong now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlarmsResult {
    /// How many there are on all pages.
    pub total: u64,
    /// Those from `offset` on.
    pub alarms: Vec<ActiveAlarm>,
}

/// A block that reports an error, or an input that is not ok.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ActiveAlarm {
    /// The block or input.
    pub name: String,
    /// The block's status word; an input has none.
    pub status: Option<u16>,
    /// What that means.
    pub meaning: String,
    /// Its task.
    #[serde(default)]
    pub task: String,
    /// The task's cycle since when it is so.
    pub since_cycle: u64,
    /// When that cycle was due, ns of UTC since 1970; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since_unix_ns: Option<u64>,
    /// How often it came.
    pub count: u64,
}

/// Of `save`: a piece of the configuration with the values of now.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SaveResult {
    /// Length of the whole text in bytes.
    pub total: u64,
    /// The text from byte `offset` on, as much as a message holds.
    pub configuration: String,
}

/// What an input pin has its value from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Given {
    /// The value itself: a constant, or what was set.
    Value(Value),
    /// A wire.
    Wire {
        /// The signal that it comes from.
        wire: String,
    },
}

/// A pin that an `apply` changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChangedValue {
    /// Its name; `*` stands for all instances of a block.
    pub name: String,
    /// What it had.
    pub before: Given,
    /// What the new configuration gives it.
    pub after: Given,
}

/// A parameter that keeps a value which was set, and which the new configuration does not have.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tuned {
    /// Its name.
    pub name: String,
    /// What it has and keeps.
    pub value: Value,
    /// What the new configuration says.
    pub configured: Value,
}

/// Of `apply`: what the new configuration changes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ApplyResult {
    /// The transaction's number; `None` after `dry_run`.
    #[serde(default)]
    pub transaction: Option<u64>,
    /// Each task's first cycle with it; empty after `dry_run`.
    pub tasks: ByTask<Part>,
    /// Blocks that are new.
    pub added: Vec<String>,
    /// Blocks that are gone.
    pub removed: Vec<String>,
    /// Blocks that keep their state.
    pub kept: Vec<String>,
    /// Pins and wires that differ.
    pub changed: Vec<String>,
    /// What those pins had and were given, as many as fit; none if they are more than ten thousand.
    #[serde(default)]
    pub values: Vec<ChangedValue>,
    /// How many more values the answer has no room for.
    #[serde(default)]
    pub values_left_out: usize,
    /// Parameters that keep a value which was set, though the new configuration has another.
    #[serde(default)]
    pub tuned: Vec<Tuned>,
    /// Limits that differ: what they were and are.
    #[serde(default)]
    pub limits: Vec<String>,
    /// What the change costs the task whose slack it takes most of, ns.
    pub cost_ns: u64,
    /// After `dry_run`: why it would be refused now, for want of time between two cycles.
    #[serde(default)]
    pub refused: Option<String>,
}
