//! What the methods answer.

mod alarms;
mod changes;
mod configurations;
mod describing;
mod journal;
mod signals;
mod tracing;

use std::collections::BTreeMap;

pub use alarms::{ActiveAlarm, AlarmsResult};
pub use changes::{Force, ForceResult, ForcesResult, Part, SetResult};
pub use configurations::{ApplyResult, ChangedValue, Given, SaveResult, Tuned};
pub use describing::{
    Access, ConfigurationOrigin, DescribeResult, Followed, LastSecond, Placement, TaskDescription,
};
pub use journal::{
    Action, AppliedChange, AskedBy, Change, JournalEntry, JournalResult, PendingEntry,
};
pub use signals::{GetResult, ReadAt, Role, SignalDescription, SignalsResult};
pub use tracing::{TraceResult, TracedSignal};

/// By the name of a task.
pub type ByTask<T> = BTreeMap<String, T>;
