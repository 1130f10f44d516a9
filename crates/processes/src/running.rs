//! The running children, for an exit that drops nothing.

use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::process::{Pid, Signal, kill_process};

static RUNNING: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

/// The children that were started and have not been seen to end.
pub(crate) fn running() -> MutexGuard<'static, Vec<Pid>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Asks all of them to end.
pub(crate) fn ask_all_to_end() {
    for program in running().iter() {
        let _ = kill_process(*program, Signal::TERM);
    }
}
