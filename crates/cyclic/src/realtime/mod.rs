//! Real-time set-up: what to ask of the system before the first cycle, and what it granted.

mod new_memory;
mod os;
mod prepared;
mod process;
mod refusal;
mod thread;

pub use new_memory::{lock_new_memory_as_touched, touch_new_memory};
pub(crate) use os::thread_counters;
pub use prepared::PreparedThread;
pub use process::{ProcessGrant, prepare_process};
pub use refusal::GrantRefusal;
pub use thread::{PREFAULTED_STACK_BYTES, Pinning, ThreadGrant, ThreadRequest, prepare_thread};

#[cfg(test)]
mod simulated_os;
