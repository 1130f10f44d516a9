//! Benchmarks of what affects a controller, run on the code that ships: how late its cycles start
//! ([`jitter`]), how long a value takes from one process to another ([`latency`]), and what a block
//! costs ([`engine`]).
//!
//! Each is measured with arms in alternating turns, so that disturbances of the machine affect all
//! of them. A bench takes its settings, a [`Stop`](isochrone_processes::Stop) that ends it early,
//! and an [`Onlooker`] that receives its progress; it returns parts of a
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
mod peer_process;
mod watch;

pub use error::BenchError;
pub use onlooker::{NoView, Onlooker, View};
pub use watch::allowed_cpus;
