//! What a turn needs, and what it comes to.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What all turns need.
#[derive(Debug, Clone)]
pub struct Stage {
    /// The program `isochrone`.
    pub program: PathBuf,
    /// How soon peers that were started again must have frames.
    pub within: Duration,
    /// How many faults a turn does.
    pub faults: u64,
    /// Set when the program is to end.
    pub stop: Arc<AtomicBool>,
}

impl Stage {
    /// Whether the program is to end.
    pub(super) fn is_due(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// What a turn came to.
#[derive(Debug, Clone, Default)]
pub struct Turn {
    /// How many faults were done.
    pub done: u64,
    /// What did not hold.
    pub wrong: Vec<String>,
    /// What cannot be tested here, and why.
    pub untested: Vec<String>,
    /// What was measured, with the unit: the most of each name is shown.
    pub measured: Vec<(&'static str, u64)>,
}

impl Turn {
    /// Keeps what is wrong.
    pub(super) fn keep(&mut self, wrong: impl IntoIterator<Item = String>) {
        self.wrong.extend(wrong);
    }

    /// Keeps what is wrong with one fault; what came of it otherwise.
    pub(super) fn take<T>(&mut self, found: Result<T, String>) -> Option<T> {
        found.map_err(|wrong| self.wrong.push(wrong)).ok()
    }
}
