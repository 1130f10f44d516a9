//! The peers of a port: how many there are, and failed connections to them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use iceoryx2::port::{DegradationAction, DegradationFn};

/// Counts peers that join and leave, and failed connections to them.
#[derive(Debug, Default)]
pub(crate) struct Peers {
    /// How many there are, as last seen.
    present: Arc<AtomicUsize>,
    changes: u64,
    failures: Arc<AtomicU64>,
}

impl Peers {
    /// A handler that counts a failed connection and lets the port go on with the others.
    ///
    /// iceoryx2's own handler logs a warning, and it runs inside `send` and `receive`.
    pub(crate) fn counting_handler(&self) -> impl DegradationFn + use<> {
        let failures = Arc::clone(&self.failures);
        move |_, _: &_| {
            failures.fetch_add(1, Ordering::Relaxed);
            DegradationAction::Ignore
        }
    }

    /// What counts the failures, for another thread.
    pub(crate) fn failure_count(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.failures)
    }

    /// How many peers there are, for another thread.
    pub(crate) fn present(&self) -> Arc<AtomicUsize> {
        Arc::clone(&self.present)
    }

    /// Records how many peers there are; whether that has changed.
    ///
    /// One that leaves and one that joins between two looks are no change here. Their identities
    /// would tell, but iceoryx2 0.10 lists those through a copy that it allocates, and keeps the
    /// counter of its changes to itself.
    pub(crate) fn note(&mut self, present: usize) -> bool {
        let changed = present != self.present.load(Ordering::Relaxed);
        if changed {
            self.present.store(present, Ordering::Relaxed);
            self.changes += 1;
        }
        changed
    }

    /// How often the number of peers was seen to change: at most as often as peers joined and left.
    pub(crate) fn changes(&self) -> u64 {
        self.changes
    }

    /// How many connections failed.
    pub(crate) fn failures(&self) -> u64 {
        self.failures.load(Ordering::Relaxed)
    }
}
