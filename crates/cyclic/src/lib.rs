//! **When** a cycle runs: an absolute-grid cyclic executor and the real-time set-up of its thread.
//!
//! Cycle `k` of a task is due at `epoch + phase + k * period` on `CLOCK_MONOTONIC`. Due times are
//! never derived from the moment a cycle actually ran, so the grid cannot drift, and tasks that
//! share an epoch share the grid. Every missed release is counted.
//!
//! A task may follow its data ([`Cyclic::wait_for_data`]): it then begins its cycle with the data, never
//! before its release and a given time after it at the latest. The grid stays the same.
//!
//! Real-time contract: [`Cyclic::wait`] and [`Cyclic::finished`] do not allocate, take no lock,
//! cannot panic, and make no system call except the sleep. Everything that the system can refuse
//! happens beforehand, in [`prepare_process`] and [`prepare_thread`], which report each [`GrantRefusal`]
//! with its reason and remedy and continue with what was granted.
//!
//! ```
//! use std::sync::{Arc, atomic::AtomicBool};
//! use isochrone_cyclic::{Clock, Cyclic, Monotonic, Schedule, Wake};
//!
//! let stop = Arc::new(AtomicBool::new(false));
//! let epoch_ns = Monotonic.now_ns() + 1_000_000;
//! let mut cyclic = Cyclic::new(Monotonic, Schedule::every(1_000_000, Wake::Sleep), epoch_ns, stop);
//! for _ in 0..3 {
//!     let Some(release) = cyclic.wait() else { break };
//!     assert_eq!((release.release_ns - epoch_ns) % 1_000_000, 0);
//!     cyclic.finished(Monotonic.now_ns());
//! }
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

mod alloc;
mod clock;
mod cyclic;
mod follow;
mod margin;
mod pace;
mod prompt;
mod realtime;
#[cfg(test)]
mod simulated;
mod usage;
mod wait;

pub use alloc::{CountingAllocator, counts_allocations, thread_allocations};
pub use clock::{Clock, Monotonic};
pub use cyclic::{Cyclic, MAX_BURST, Release, StopReason};
pub use follow::{FollowStart, FollowedData, Look};
pub use isochrone_model::{
    CycleStart, CycleStartCounts, EPOCH_GRID_NS, EPOCH_OFFSET_NS, Margin, MissLimit, Overrun,
    Schedule, Wake, epoch_after_ns, phase_between_ticks_ns,
};
pub use pace::Pace;
pub use prompt::PromptWakeUps;
pub use realtime::{
    GrantRefusal, PREFAULTED_STACK_BYTES, Pinning, PreparedThread, ProcessGrant, ThreadGrant,
    ThreadRequest, lock_new_memory_as_touched, prepare_process, prepare_thread, touch_new_memory,
};
pub use usage::{ThreadUsage, thread_usage};
pub use wait::{Awake, WakeUps};
