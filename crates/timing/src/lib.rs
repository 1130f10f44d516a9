//! **How well** it went: cycle records, distributions, the environment, and the report of a run.
//!
//! Plain data goes in, from the loop ([`CycleRecord`]) and from a subscriber ([`FrameRecord`]);
//! a [`Report`] comes out, as JSON (serde, both ways), as a table (`Display`), as a page ([`html`])
//! and in the formats of other tools ([`hgrm`], [`hlog`], [`cyclictest_histogram`]). Nothing here
//! runs on the real-time thread: records reach this crate through a ring.
//!
//! A number is only reported when the samples support it, see [`Summary`].
//!
//! [`examine`] says beforehand what a machine does to jitter, and the way out; it changes nothing.
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

mod bench;
mod distribution;
mod doctor;
mod environment;
mod link;
mod machine;
mod output;
mod report;
mod summary;
mod task;
mod units;

pub use bench::{
    Block, BlockReport, Blocks, Compared, Comparison, Disturbance, Gate, LoopArm, Measured,
    Outcome, Outlier, PERCENTILES, Percentile, RESOLUTION_NS, Ratio, Rule, RuleError, TOLERANCE,
    Verdict, compare_reports, overall, ratio, supports, turns,
};
pub use distribution::{DecodeError, Distribution, HIGHEST_NS};
pub use doctor::{Examination, Finding, NoSuchCpu, Severity, examine};
pub use environment::Environment;
pub use link::{FrameRecord, LinkTiming};
pub use machine::Machine;
pub use output::{
    ComparisonTable, Series, Timeline, cyclictest_histogram, hgrm, histogram_svg, hlog, html,
    percentiles_svg, pictures, scaling_svg, timeline_svg,
};
pub use report::{CostReport, LinkReport, Report, TaskReport, Warning};
pub use summary::Summary;
pub use task::{CycleRecord, DEFAULT_WARM_UP_CYCLES, TaskTiming};
