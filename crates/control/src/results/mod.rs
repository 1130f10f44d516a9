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
pub use changes::{ForceResult, ForcesResult, Part, SetResult};
pub use configurations::{ApplyResult, SaveResult};
pub use describing::{ConfigurationOrigin, DescribeResult, LastSecond, Placement, TaskDescription};
pub use journal::JournalResult;
pub use signals::{GetResult, ReadAt, SignalDescription, SignalsResult};
pub use tracing::{TraceResult, TracedSignal};

/// By the name of a task.
pub type ByTask<T> = BTreeMap<String, T>;
