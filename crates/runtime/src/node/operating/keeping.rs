//! The journal of a running node: a change is acknowledged once it is known whether its line was written.

use std::collections::VecDeque;

use isochrone_control::desk::{OrderOutcome, Unwritten};

use crate::keeping::journal::{Fate, Journal, JournalError, Mark, WriterProgress, Writing};
use crate::task::clocks::unix_ns;
use crate::task::faults::Active;

/// The outcome of a request.
#[derive(Debug, Clone)]
pub(crate) struct RequestOutcome {
    pub(crate) done: OrderOutcome,
    /// Why the journal does not have it, if it should.
    pub(crate) unwritten: Option<Unwritten>,
}

/// The journal, if there is one, and the outcomes that wait for it.
#[derive(Default)]
pub(super) struct Keeping {
    journal: Option<Writing>,
    held: VecDeque<(Mark, OrderOutcome)>,
    /// How often writing the journal has failed, and since which cycle of the first task it fails.
    failures: u64,
    unwritten_since: Option<u64>,
}

impl Keeping {
    /// Starts writing a journal of this name, which its thread opens.
    pub(super) fn start(
        &mut self,
        name: String,
        open: impl FnOnce() -> Result<Journal, JournalError> + Send + 'static,
    ) -> Result<(), JournalError> {
        self.journal = Some(Writing::start(name, open)?);
        Ok(())
    }

    /// The same at a takeover. Where the thread cannot be started, changes are refused.
    pub(super) fn go_on(
        &mut self,
        name: String,
        open: impl FnOnce() -> Result<Journal, JournalError> + Send + 'static,
    ) {
        let started = Writing::start(name.clone(), open);
        self.journal = Some(started.unwrap_or_else(|error| Writing::failed(name, &error)));
    }

    /// Journals an outcome and holds it until the fate of its line is known; returns it at once if it needs no line.
    pub(super) fn hold(&mut self, done: OrderOutcome) -> Option<OrderOutcome> {
        let mark = match (&done, &mut self.journal) {
            (OrderOutcome::Applied(entry), Some(journal)) => journal.note(entry),
            _ => None,
        };
        let Some(mark) = mark else { return Some(done) };
        self.held.push_back((mark, done));
        None
    }

    /// Whether an outcome waits for its line.
    pub(super) fn holds_any(&self) -> bool {
        !self.held.is_empty()
    }

    /// The progress of the journal, in a cycle of the first task; `None`: there is no journal.
    pub(super) fn look(&mut self, cycle: u64) -> Option<WriterProgress> {
        let progress = self.journal.as_mut()?.progress();
        match (&progress.unwritten, self.unwritten_since) {
            (Some(_), None) => {
                self.unwritten_since = Some(cycle);
                self.failures += 1;
            }
            (None, Some(_)) => self.unwritten_since = None,
            _ => {}
        }
        Some(progress)
    }

    /// The next outcome that need not wait any longer: its line is written, or cannot be for now.
    pub(super) fn next(&mut self, progress: &WriterProgress) -> Option<RequestOutcome> {
        let unwritten = match progress.fate(self.held.front()?.0) {
            Fate::Waits => return None,
            Fate::Written => None,
            Fate::Unwritten(why) => Some(why),
        };
        let (_, done) = self.held.pop_front()?;
        Some(RequestOutcome { done, unwritten })
    }

    /// The alarm while the journal cannot be written.
    pub(super) fn alarm(&self, unwritten: Option<&Unwritten>) -> Option<Active> {
        let why = unwritten?;
        let until = match why {
            Unwritten::ForNow(_) => "it can be",
            Unwritten::ForGood(_) => "the node is started again",
        };
        let meaning = format!("{}; changes are refused until {until}", why.reason());
        Some(Active::of_node("journal", meaning, self.unwritten_since?, self.failures))
    }

    /// Begins to end the journal.
    pub(super) fn begin_end(&mut self) {
        if let Some(journal) = &mut self.journal {
            journal.begin_end(unix_ns());
        }
    }

    /// Leaves the journal to the other process of the node, and the outcomes with it.
    pub(super) fn give_up(&mut self) {
        self.held.clear();
        self.journal.take().into_iter().for_each(Writing::leave);
    }

    /// Takes the journal out, so that its end is waited for without the lock.
    pub(super) fn take(&mut self) -> Option<Writing> {
        self.journal.take()
    }
}
