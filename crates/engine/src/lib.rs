//! **In what order**: from a configuration file to a process image that one call steps.
//!
//! Data flows one way: TOML, [`Config`](config::Config) (as written), [`Plan`] (resolved, checked,
//! ordered), [`TaskEngine`] (image and banks), cycle. Strings and hash maps are not used beyond the
//! plan.
//!
//! ```
//! use isochrone_engine::{Plan, Rules, Source, TaskEngine};
//!
//! let text = r#"
//!     [node]
//!     name = "level"
//!     [[task]]
//!     name = "fast"
//!     period = "100ms"
//!     [[block]]
//!     name = "ramp"
//!     type = "LimRateOfChangeCI"
//!     in = { value = 25.0, setChangeRate = 10.0 }
//!     [[output]]
//!     service = "plant/level"
//!     signals = ["ramp.delayedValue"]
//! "#;
//! let plan = Plan::new(Source::new("level.toml", text), &Rules::default())?;
//! let mut engines = TaskEngine::build(&plan)?;
//! let engine = &mut engines[0];
//! let mut frame = [0.0];
//! for cycle in 0..3 {
//!     engine.step(cycle);
//!     engine.read_output(0, &mut frame);
//! }
//! assert_eq!(frame, [3.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! This crate uses no clock, operating system or IPC.
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
#![forbid(unsafe_code)]

mod alarms;
mod build;
pub mod config;
mod diagnostic;
mod diagnostics;
mod engine;
mod excerpt;
pub mod keys;
mod nearest;
pub mod orders;
mod parse;
mod pattern;
mod plan;
pub mod reference;
mod source;
mod task_settings;
mod workload;
mod worth;

pub use alarms::{AlarmEvent, AlarmWatch};
pub use build::BuildError;
pub use diagnostic::{Diagnostic, Problem};
pub use diagnostics::{Diagnostics, Excerpts};
pub use engine::{GivenSample, InputReading, Parcel, TaskEngine, TaskState, WarmStart, Wires};
pub use isochrone_model::{
    Flags, escaped, escaped_lines, format_duration_ns, format_time_ms, parse_duration_ns,
    parse_milliseconds_ns, parse_seconds, parse_time_ms,
};
pub use nearest::{KnownNames, listing, nearest_name};
pub use pattern::{Pattern, part_matches};
pub use plan::{
    AlarmPlan, BankPlan, BlockLabels, InputPart, InputPlan, Instances, LimitPlan, LinkPlan,
    OutputPlan, OwnedRules, Plan, PlanError, Rules, SignalPlan, TaskPlan, Upstream, VariablePlan,
    WirePlan, first_error, starves,
};
pub use source::{FileKind, MAX_BYTES, ReadError, Source, read_text};
pub use task_settings::TaskSettings;
pub use workload::{Workload, WorkloadSize};
