//! Layouts that one thread hears and another uses.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::{Announcement, LayoutWatcher, Service};

/// Carries what an ordinary thread hears of a service's layouts to a reader in a real-time thread, which looks for it
/// with one load and neither waits nor allocates until there is news: see [`SignalReader::told`](crate::SignalReader::told).
#[derive(Debug, Clone, Default)]
pub struct ToldLayouts {
    told: Arc<Told>,
    /// As of the last look of this clone. The newest stands last.
    known: Vec<Arc<Announcement>>,
    seen: u64,
}

#[derive(Debug, Default)]
struct Told {
    count: AtomicU64,
    known: Mutex<Vec<Arc<Announcement>>>,
}

impl ToldLayouts {
    /// For the thread that hears: tells what the watcher knows now.
    pub fn tell<S: Service>(&self, watcher: &LayoutWatcher<S>) {
        let mut known = self.told.known.lock().unwrap_or_else(PoisonError::into_inner);
        *known = watcher.known().iter().cloned().map(Arc::new).collect();
        self.told.count.fetch_add(1, Ordering::Release);
    }

    /// Takes what was told since the last call, unless it is being told just now; returns whether there is any.
    pub(crate) fn look(&mut self) -> bool {
        let count = self.told.count.load(Ordering::Acquire);
        if count == self.seen {
            return false;
        }
        let Ok(known) = self.told.known.try_lock() else { return false };
        self.known.clone_from(&known);
        self.seen = count;
        true
    }

    pub(crate) fn known(&self) -> &[Arc<Announcement>] {
        &self.known
    }
}
