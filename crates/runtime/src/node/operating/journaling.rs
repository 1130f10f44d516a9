//! What a running node journals, and when.

use isochrone_control::Entry;
use isochrone_control::desk::OrderOutcome;

use super::{Operating, RequestOutcome};
use crate::keeping::journal::{Journal, JournalError, Writing};
use crate::task::faults::Active;

impl Operating {
    /// Journals what no cycle had to do.
    pub(in crate::node) fn note(&mut self, entry: Entry) {
        self.follow_role();
        let done = self.keeping.hold(OrderOutcome::Applied(entry));
        self.noted.extend(done.map(|done| RequestOutcome { done, unwritten: None }));
    }

    /// Journals all changes from now on; before the start.
    pub(crate) fn keep(&mut self, journal: Journal) -> Result<(), JournalError> {
        self.operator.continue_after(journal.last_transaction());
        self.keeping.start(journal.name(), || Ok(journal))
    }

    /// The alarm while the journal cannot be written.
    pub(crate) fn journal_alarm(&self) -> Option<Active> {
        self.keeping.alarm(self.operator.unwritten())
    }

    /// Begins to end the journal, after the last cycles were recorded.
    pub(crate) fn begin_journal_end(&mut self) {
        self.keeping.begin_end();
    }

    /// Takes the journal out, so that its end is waited for without the lock.
    pub(crate) fn take_journal(&mut self) -> Option<Writing> {
        self.keeping.take()
    }

    /// Whether a change waits for the journal.
    pub(crate) fn waits_for_journal(&self) -> bool {
        self.keeping.holds_any()
    }
}
