//! Dropping under the domain's lock.

use std::ops::Deref;
use std::sync::{Arc, Mutex};

use super::Domain;
use super::lock::{DomainLock, LockGuard};

/// Something of iceoryx2 that is dropped under the lock: its name in the file system may be that of its
/// successor, which must not be removed in its place.
#[derive(Debug)]
pub(crate) struct EndsLocked<T> {
    // Fields are dropped in the order of their declaration.
    _ending: Ending,
    thing: T,
    _held: Arc<Mutex<Option<LockGuard>>>,
    /// What is left of it is removed after all else.
    _domain: Option<Domain>,
}

impl<T> EndsLocked<T> {
    /// `domain` lasts as long as `thing`.
    pub(super) fn new(thing: T, lock: &DomainLock, domain: Option<Domain>) -> Self {
        let held = Arc::new(Mutex::new(None));
        let ending = Ending { lock: lock.clone(), held: Arc::clone(&held) };
        Self { _ending: ending, thing, _held: held, _domain: domain }
    }
}

impl<T> Deref for EndsLocked<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.thing
    }
}

/// Takes the lock when it is dropped.
#[derive(Debug)]
struct Ending {
    lock: DomainLock,
    held: Arc<Mutex<Option<LockGuard>>>,
}

impl Drop for Ending {
    fn drop(&mut self) {
        // An end must not fail. Without the lock it is as safe as iceoryx2 makes it.
        let held = self.lock.acquire_to_end().ok();
        if let Ok(mut place) = self.held.lock() {
            *place = held;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use crate::IsolatedDomain;

    use super::*;

    #[test]
    fn what_ends_locked_is_dropped_under_the_lock() {
        struct Probe(DomainLock, Arc<AtomicBool>);
        impl Drop for Probe {
            fn drop(&mut self) {
                self.1.store(self.0.try_acquire().unwrap().is_none(), Ordering::Relaxed);
            }
        }
        let domain = IsolatedDomain::new("isotest").unwrap();
        std::fs::create_dir_all(domain.root_path()).unwrap();
        let lock = DomainLock::of(domain.config(), "somebody");
        let was_locked = Arc::new(AtomicBool::new(false));
        drop(EndsLocked::new(Probe(lock.clone(), Arc::clone(&was_locked)), &lock, None));
        assert!(was_locked.load(Ordering::Relaxed));
        assert!(lock.try_acquire().unwrap().is_some());
    }
}
