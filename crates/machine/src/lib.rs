//! **Where** it ran: what a Linux machine is, and what it does to a loop.
//!
//! A [`Machine`] reads `/proc` and `/sys`, below any root. [`Environment`] is what decides how much
//! a run's numbers are worth, [`Disturbance`] what the kernel counted against a loop meanwhile, and
//! [`examine`] says beforehand what the machine does to jitter, and the way out. Nothing is changed.
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

mod disturbance;
mod doctor;
mod environment;
mod machine;
mod throttling;

pub use disturbance::Disturbance;
pub use doctor::{Examination, Finding, NoSuchCpu, Severity, examine};
pub use environment::Environment;
pub use machine::Machine;
pub use throttling::{NoThrottling, Throttling};
