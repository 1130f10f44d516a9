//! **How well** it ran: statistics computed from records.
//!
//! Input is plain data from the loop ([`CycleRecord`]) and from a subscriber ([`FrameRecord`]);
//! output is what a task did ([`TaskReport`]) and what arrived over a link ([`LinkReport`]).
//! Nothing here runs on the real-time thread: records reach this crate through a ring.
//!
//! A number is reported only if the samples support it; see [`Summary`].
//!
//! ```
//! use isochrone_timing::{CycleRecord, TaskTiming};
//!
//! let mut timing = TaskTiming::new(1_000_000).with_warm_up(0);
//! timing.record(&CycleRecord {
//!     cycle: 0, release_ns: 5_000_000, start_ns: 5_000_090, end_ns: 5_012_000, missed: 0, overruns: 0,
//! });
//! let task = timing.report("fast");
//! assert_eq!(task.release_jitter_ns.max, Some(90));
//! assert_eq!(task.response_ns.max, Some(12_000));
//! assert_eq!(task.release_jitter_ns.p99, None, "one sample says nothing about a tail");
//! ```
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod chain;
mod chain_report;
mod distribution;
mod follow;
mod link;
mod link_report;
mod metric;
mod progress;
mod record;
mod summary;
mod task;
mod task_report;
pub mod units;
mod warning;

pub use chain::{ChainFrame, ChainTiming};
pub use chain_report::{ChainReport, HopReport};
pub use distribution::{DecodeError, Distribution, HIGHEST, encoded};
pub use follow::{Arrivals, InVain, LateFrames, Punctuality};
pub use isochrone_model::CycleStartCounts;
pub use link::{FrameRecord, LinkTiming};
pub use link_report::{Direction, LinkReport};
pub use metric::{Metric, Unit};
pub use progress::Progress;
pub use record::{CycleRecord, FollowRecord};
pub use summary::Summary;
pub use task::{TaskTiming, warm_up_cycles};
pub use task_report::{InputReport, TaskReport};
pub use warning::{Warning, WarningCode};
