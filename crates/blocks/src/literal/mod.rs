//! Literals of IEC 61131-3 that are more than digits: times, and numbers with a base.

mod amount;
mod based;
mod time;

pub use amount::{AmountError, UNITS, amount_ns};
pub use based::{Based, parse_based};
pub use time::{parse_time_ms, parse_time_ns};
