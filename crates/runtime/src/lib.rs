//! **A node in any program**: the threads of its tasks, its ports and its telemetry.
//!
//! Nothing here speaks to the terminal or to a service manager.
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

pub mod alarms;
mod bindings;
mod inputs;
mod layouts;
mod limiter;
mod ports;
mod task;
mod telemetry;

pub use bindings::Desk;
pub use layouts::{Resolver, announcers};
pub use limiter::Limiter;
pub use task::{Job, Outcome, Ready, run};
pub use telemetry::{Tap, Telemetry};
