//! Another configuration on its way to its place.

use std::sync::Arc;

use isochrone_model::{Code, Refusal};

use crate::desk::fixed::Fixed;
use crate::desk::journal::Applied;
use crate::desk::permissions::Permissions;
use crate::desk::signals::{Kept, Signals};
use crate::desk::warnings::Warnings;

/// A configuration that is on its way to the tasks.
#[derive(Debug)]
pub(in crate::desk::operator) struct Next {
    pub(in crate::desk::operator) signals: Arc<Signals>,
    pub(super) permissions: Permissions,
    pub(super) warnings: Warnings,
    pub(super) fixed: Arc<Fixed>,
    pub(super) kept: Kept,
    pub(super) applied: Arc<Applied>,
    pub(super) number: u64,
    pub(super) returned: Vec<bool>,
    /// For each task the slots of parameters and variables that it gives another value, in ascending order.
    pub(super) given: Vec<Box<[u32]>>,
}

impl Next {
    /// Whether a task has its new engine.
    pub(in crate::desk::operator) fn has_returned(&self, task: usize) -> bool {
        self.returned.get(task).copied().unwrap_or_default()
    }

    pub(in crate::desk::operator) fn permissions(&self) -> &Permissions {
        &self.permissions
    }

    /// The refusal of requests that have to wait until all tasks have it.
    pub(in crate::desk::operator) fn refusal(&self) -> Refusal {
        let message =
            format!("transaction {} changes the configuration at this moment", self.number);
        Refusal::one(Code::Busy, "", message, "ask again when it has")
    }

    /// Whether it gives a parameter or a variable of a task another value; `slot` is that in the new engine.
    pub(in crate::desk::operator) fn gives(&self, task: usize, slot: u32) -> bool {
        self.given.get(task).is_some_and(|given| given.binary_search(&slot).is_ok())
    }

    /// The slot in the new engine of a task for one in the old.
    pub(in crate::desk::operator) fn slot(&self, task: usize, slot: u32) -> Option<u32> {
        self.kept.slot(task, slot as usize).map(|slot| slot as u32)
    }
}
