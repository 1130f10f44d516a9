//! The journal of a running node: what was done is acknowledged when it is known what has become of its line.

use std::collections::VecDeque;

use isochrone_control::desk::{OrderOutcome, Unwritten};

use crate::clocks::unix_ns;
use crate::faults::Active;
use crate::journal::{Fate, Journal, JournalError, Mark, WriterProgress, Writing};

/// What came back of a request.
#[derive(Debug, Clone)]
pub(crate) struct RequestOutcome {
    pub(crate) done: OrderOutcome,
    /// Why the journal does not have it, where it should.
    pub(crate) unwritten: Option<Unwritten>,
}

/// The journal, if there is one, and what waits for it.
#[derive(Default)]
pub(super) struct Keeping {
    journal: Option<Writing>,
    held: VecDeque<(Mark, OrderOutcome)>,
    /// How often the journal could not be written, and since which cycle of the first task it cannot be.
    failures: u64,
    unwritten_since: Option<u64>,
}

impl Keeping {
    /// Writes into a journal that has begun.
    pub(super) fn start(&mut self, journal: Journal) -> Result<(), JournalError> {
        self.journal = Some(Writing::start(journal)?);
        Ok(())
    }

    /// Writes what was done, and keeps it until its fate is known; returns what needs no line.
    pub(super) fn hold(&mut self, done: OrderOutcome) -> Option<OrderOutcome> {
        let mark = match (&done, &mut self.journal) {
            (OrderOutcome::Applied(entry), Some(journal)) => journal.note(entry),
            _ => None,
        };
        let Some(mark) = mark else { return Some(done) };
        self.held.push_back((mark, done));
        None
    }

    /// Whether something waits for its line.
    pub(super) fn holds_any(&self) -> bool {
        !self.held.is_empty()
    }

    /// How the journal stands, in a cycle of the first task; `None`: there is none.
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

    /// The next that waits no longer: the journal has it, or cannot have it now.
    pub(super) fn next(&mut self, progress: &WriterProgress) -> Option<RequestOutcome> {
        let unwritten = match progress.fate(self.held.front()?.0) {
            Fate::Waits => return None,
            Fate::Written => None,
            Fate::Unwritten(why) => Some(why),
        };
        let (_, done) = self.held.pop_front()?;
        Some(RequestOutcome { done, unwritten })
    }

    /// That the journal cannot be written, while it cannot.
    pub(super) fn alarm(&self, unwritten: Option<&Unwritten>) -> Option<Active> {
        let why = unwritten?;
        let until = match why {
            Unwritten::ForNow(_) => "it can be",
            Unwritten::ForGood(_) => "the node is started again",
        };
        let meaning = format!("{}; changes are refused until {until}", why.reason());
        let (since_cycle, count) = (self.unwritten_since?, self.failures);
        let name = "journal".to_owned();
        Some(Active { name, code: None, status: None, meaning, since_cycle, count })
    }

    /// Has the journal end.
    pub(super) fn begin_end(&mut self) {
        if let Some(journal) = &mut self.journal {
            journal.begin_end(unix_ns());
        }
    }

    /// The journal, whose end is to be waited for without a lock.
    pub(super) fn take(&mut self) -> Option<Writing> {
        self.journal.take()
    }
}
