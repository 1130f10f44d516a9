//! The threads of the page: how one is started, and how they lock what they share.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use crate::failure::Failure;

/// The state after a panic of another thread is still usable.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a thread that nobody waits for.
pub(super) fn start_thread(name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), Failure> {
    let thread = thread::Builder::new().name(name.into()).spawn(run);
    thread.map(drop).map_err(Failure::thread)
}
