//! **The nouns of a node**, once: what plans, requests, journals, reports and screens all use as it is.
//!
//! Types with their conversions and formats, and no rules. [`Value`], [`Role`] and [`Flags`] are of signals;
//! [`Force`], [`Change`] and [`Entry`] of what operators did to them; [`Access`], [`Refusal`] and [`Finding`] of
//! what they may do and why not; [`Schedule`] of when a task runs. As JSON they are what docs/control.md says.
//!
//! ```
//! use isochrone_model::{Flags, Value};
//!
//! let flags = Flags::STALE | Flags::UPSTREAM;
//! assert_eq!(flags.to_string(), "STALE UPSTREAM");
//! assert_eq!(Value::from(2.5).to_string(), "2.5");
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
#![forbid(unsafe_code)]

/// What the names of the nodes' own services begin with: nobody else writes such a service.
pub const OWN_SERVICES: &str = "isochrone/";

mod access;
mod at;
mod configuration;
mod debug;
mod duration;
mod flags;
mod followed;
mod force;
mod journal;
mod number;
mod printable;
mod process_alarm;
mod refusal;
mod role;
mod schedule;
mod time;
mod value;
mod values;
mod written;

pub use access::Access;
pub use at::At;
pub use configuration::{ChangeSummary, ChangedValue, Given, Tuned};
pub use duration::{
    format_duration_ns, parse_duration_ns, parse_milliseconds_ns, parse_seconds, respelled,
};
pub use flags::Flags;
pub use followed::Followed;
pub use force::{Force, Hold};
pub use isochrone_blocks::literal::{
    AmountError, Based, UNITS, amount_ns, parse_based, parse_time_ms, parse_time_ns,
};
pub use journal::{Action, AppliedChange, AskedBy, Change, Entry, PendingEntry};
pub use number::{in_base_of, plain_number};
pub use printable::{escaped, escaped_lines};
pub use process_alarm::{
    AlarmChange, AlarmEntry, AlarmMoment, AlarmSeverity, AlarmState, AlarmTotals, ProcessAlarm,
};
pub use refusal::{Code, ConfigPlace, Finding, Refusal};
pub use role::Role;
pub use schedule::{
    CycleStart, CycleStartCounts, EPOCH_GRID_NS, EPOCH_OFFSET_NS, KERNEL_TICK_NS,
    LONGEST_ADAPTIVE_MARGIN_NS, Margin, MissLimit, Overrun, Schedule, Wake, epoch_after_ns,
    greatest_common_divisor, phase_between_ticks_ns,
};
pub use time::{TIME_FORMS, format_time_ms, in_form_of, is_time, time_help};
pub use value::{CALLING_TASK, Value};
pub use values::{Types, Values};
pub use written::{NumberError, Written, parse_bool, parse_call_ob, parse_number, parse_value};
