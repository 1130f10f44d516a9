//! A node that goes on from its retained state, and sends nothing before it is told to.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::Operating;
use crate::task::faults::Active;

impl Operating {
    /// Has the tasks send nothing until [`start_sending`](Self::start_sending).
    pub(crate) fn hold(&mut self, is_held: &Arc<AtomicBool>) {
        is_held.store(true, Ordering::Relaxed);
        self.is_held = Arc::clone(is_held);
    }

    /// Lets the tasks send; whether they did not.
    pub(crate) fn start_sending(&self) -> bool {
        self.is_held.swap(false, Ordering::Relaxed)
    }

    /// The alarm while the tasks send nothing.
    pub(crate) fn held_alarm(&self) -> Option<Active> {
        let meaning = "the node goes on from its retained state and sends nothing before it is told to, with the verb \
                       `start`";
        let since_cycle = self.lanes.first().map_or(0, |lane| lane.first_cycle);
        let alarm = || Active::of_node("warm_start", meaning.to_owned(), since_cycle, 1);
        self.is_held.load(Ordering::Relaxed).then(alarm)
    }
}
