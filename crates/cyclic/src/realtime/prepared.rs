//! A thread's priority, and what ends without it.

use std::ops::{Deref, DerefMut};

use super::thread::{PriorityReturn, ThreadGrant, ThreadRequest, prepare_thread};

/// What a thread owns that was prepared for real time. It stays in its thread.
///
/// What a loop leaves to be done at its end (closing ports, removing files, waiting for others) must
/// not be done with the loop's priority: the thread gives it back before `owned` is dropped, also in a
/// panic.
#[derive(Debug)]
#[must_use = "dropping it gives the priority back"]
pub struct PreparedThread<T> {
    // Dropped in this order.
    _priority: PriorityReturn,
    owned: T,
}

impl<T> PreparedThread<T> {
    /// Prepares the calling thread as [`prepare_thread`] does, for a loop with `owned`.
    pub fn prepare(request: ThreadRequest, owned: T) -> (Self, ThreadGrant) {
        // First of all, so that a panic gives the priority back too.
        let thread = Self { _priority: PriorityReturn::default(), owned };
        let grant = prepare_thread(request);
        (thread, grant)
    }
}

impl<T> Deref for PreparedThread<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.owned
    }
}

impl<T> DerefMut for PreparedThread<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.owned
    }
}
