//! **Where** it ran: the properties of a Linux machine and their effect on a loop.
//!
//! A [`Machine`] reads `/proc` and `/sys` below any root. [`Environment`] holds what determines how
//! far a run's numbers can be trusted, [`Disturbance`] what the kernel counted against a loop
//! during the run, and [`examine`] shows in advance how the machine affects jitter and how to fix
//! it. An [`Observation`] shows which CPU disturbs a thread least. Nothing is changed.
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
#[cfg(test)]
mod made_of_files;
mod quiet;
mod throttling;

pub use disturbance::{Cause, Disturbance};
pub use doctor::{CheckResult, Examination, NoSuchCpu, Severity, examine};
pub use environment::Environment;
pub use machine::{CpuList, GroupBudget, Machine, Mobility};
pub use quiet::{Avoided, BoundThread, Choice, DeviceInterrupts, Observation, ObservedCpu, Reason};
pub use throttling::{NoThrottling, Throttling};
