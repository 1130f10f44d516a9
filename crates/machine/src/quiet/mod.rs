//! The quiet CPU: where a real-time thread is disturbed least.
//!
//! [`Observation`] looks at the CPUs for a moment; [`Observation::choose`] takes the best of them, with
//! its reasons.

mod choice;
mod observation;
mod observe;

pub use choice::{Avoided, Choice, Reason};
pub use observation::{BoundThread, DeviceInterrupts, Observation, ObservedCpu};
