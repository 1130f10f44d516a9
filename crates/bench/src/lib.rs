//! What a controller feels, measured on the code that ships: how late its cycles begin ([`jitter`]),
//! how long a value takes from one process to another ([`latency`]), what a block costs ([`engine`]).
//!
//! Each is measured by arms that take turns, so that what the machine does meanwhile meets them all.
//! A bench takes its settings, a [`Stop`](isochrone_processes::Stop) that ends it early, and an
//! [`Onlooker`] who is told how far it is; it hands back parts of a
//! [`Report`](isochrone_report::Report).
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

pub mod engine;
mod error;
pub mod jitter;
pub mod latency;
mod onlooker;
mod watch;

pub use error::BenchError;
pub use onlooker::{NoView, Onlooker, View};
pub use watch::allowed_cpus;
