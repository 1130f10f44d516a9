//! This process as one of two, as all its threads know it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use isochrone_ipc::{Seat, TwinPage};

use crate::task::clocks::unix_ns;

/// This process as one of two. All is read and written without waiting.
#[derive(Debug)]
pub(crate) struct Twin {
    seat: Arc<Seat>,
    /// The term with which this process holds the node, or did last; 0: it never has.
    own: AtomicU64,
    /// The first 16 digits of the SHA-256 of its configuration.
    configuration: AtomicU64,
    /// After how many silent releases it takes over.
    pub(crate) after: u32,
    /// Whether there is a standby that wants the state.
    is_wanted: AtomicBool,
    /// What the standby said last; `None`: none follows. Of ordinary threads.
    standby: Mutex<Option<Standby>>,
    /// Whether the holder died too early.
    is_orphaned: AtomicBool,
    /// For each task the newest state that came.
    received: Box<[Received]>,
    /// How many words each task's state may have.
    most_words: OnceLock<Box<[usize]>>,
}

/// What a standby says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Standby {
    pub(crate) process: u32,
    /// Whether it has had a state of each task.
    pub(crate) is_complete: bool,
    /// The entry of the journal after the last one that its desk has; 0: it has nothing.
    pub(crate) desk: u64,
    /// For each task the cycle after the one whose state it has.
    pub(crate) next_cycles: Vec<u64>,
}

impl Standby {
    /// Whether it has what was done to a task in a cycle, with this entry of the journal.
    pub(crate) fn has(&self, task: usize, cycle: u64, sequence: u64) -> bool {
        let next = self.next_cycles.get(task).copied().unwrap_or(u64::MAX);
        self.desk > sequence && next > cycle
    }
}

/// The newest state of a task that came.
#[derive(Debug, Default)]
struct Received {
    /// With the term of this holder.
    term: AtomicU64,
    /// The cycle after which it was, and one.
    next_cycle: AtomicU64,
}

impl Twin {
    /// In this seat, with so many tasks.
    pub(crate) fn new(seat: Arc<Seat>, configuration: u64, after: u32) -> Self {
        let own = AtomicU64::new(seat.term().unwrap_or(0));
        let received = seat.places().iter().map(|_| Received::default()).collect();
        let (is_wanted, is_orphaned) = (AtomicBool::new(false), AtomicBool::new(false));
        let (configuration, standby) = (AtomicU64::new(configuration), Mutex::default());
        let most_words = OnceLock::new();
        Self {
            seat,
            own,
            configuration,
            after,
            is_wanted,
            standby,
            is_orphaned,
            received,
            most_words,
        }
    }

    /// The seat.
    pub(crate) fn seat(&self) -> &Arc<Seat> {
        &self.seat
    }

    /// The term with which this process holds the node; `None`: the other one does.
    #[inline]
    pub(crate) fn term(&self) -> Option<u64> {
        let own = self.own.load(Ordering::Acquire);
        (own != 0 && self.seat.page().term() == own).then_some(own)
    }

    /// Whether this process holds the node.
    pub(crate) fn holds(&self) -> bool {
        self.term().is_some()
    }

    /// When the node's grid begins, in ns of `CLOCK_MONOTONIC`: that of the holder, or this if this process is the holder,
    /// with these first cycles of its tasks.
    pub(crate) fn start(&self, epoch_ns: u64, first_cycles: &[u64]) -> u64 {
        let page = self.seat.page();
        if !self.holds() {
            return page.epoch_ns().unwrap_or(epoch_ns);
        }
        let places = self.seat.places().iter().copied();
        page.set_configuration(self.configuration());
        page.set_grid(epoch_ns, places.zip(first_cycles.iter().copied()));
        epoch_ns
    }

    /// The first 16 digits of the SHA-256 of this process's configuration.
    pub(crate) fn configuration(&self) -> u64 {
        self.configuration.load(Ordering::Acquire)
    }

    /// For each task how many words its state may have, as long as this process runs.
    pub(crate) fn most_words(&self) -> &[usize] {
        self.most_words.get().map_or(&[], |words| words)
    }

    /// Sets that, before the tasks open their ports.
    pub(crate) fn set_most_words(&self, most_words: Box<[usize]>) {
        let _ = self.most_words.set(most_words);
    }

    /// Keeps the other process from joining until this one, which holds the node, has another configuration.
    ///
    /// # Errors
    /// It has joined already, or holds the node itself, and is this one.
    pub(crate) fn begin_change(&self) -> Result<(), u32> {
        if !self.holds() {
            return Err(self.seat.other_process().unwrap_or(0));
        }
        // Who joins takes the seat first and then looks for the configuration: it is seen here, or sees that it has to
        // wait.
        self.seat.page().hide_configuration();
        if self.seat.has_twin() {
            self.end_change(None);
            return Err(self.seat.other_process().unwrap_or(0));
        }
        Ok(())
    }

    /// Lets the other process join with the configuration of this SHA-256; `None`: with the one before.
    pub(crate) fn end_change(&self, sha256: Option<&str>) {
        if let Some(sha256) = sha256 {
            self.configuration.store(number_of(sha256), Ordering::Release);
        }
        self.seat.page().set_configuration(self.configuration());
    }

    /// Takes over from the holder of a term; whether that worked. `lost` cycles of the task have no frame, and this process
    /// was not awake in `unmet` releases.
    pub(crate) fn take_over(&self, from: u64, was_asked: bool, lost: u64, unmet: u64) -> bool {
        let (page, now) = (self.seat.page(), unix_ns());
        let Some(term) = page.take_over(from, self.seat.number(), now) else { return false };
        self.own.store(term, Ordering::Release);
        page.note_takeover(now, was_asked, lost, unmet);
        true
    }

    /// Claims the frames of a cycle of a task, by its index.
    #[inline]
    pub(crate) fn claim(&self, task: usize, cycle: u64) -> bool {
        let place = self.seat.places().get(task);
        place.is_some_and(|place| self.seat.page().claim(*place, cycle))
    }

    /// The number of a task's first cycle in the holder.
    pub(crate) fn first_cycle(&self, task: usize) -> u64 {
        let place = self.seat.places().get(task);
        place.map_or(0, |place| self.seat.page().first_cycle(*place))
    }

    /// Notes that the state after a cycle has come from the holder of a term.
    pub(crate) fn receive(&self, task: usize, term: u64, cycle: u64) {
        if let Some(received) = self.received.get(task) {
            received.next_cycle.store(cycle.saturating_add(1), Ordering::Release);
            received.term.store(term, Ordering::Release);
        }
    }

    /// Whether a state of every task has come from the holder of this term.
    pub(crate) fn is_complete(&self, term: u64) -> bool {
        self.received.iter().all(|received| received.term.load(Ordering::Acquire) == term)
    }

    /// Whether this process can take over from the holder of this term now.
    pub(crate) fn can_take_over(&self, term: u64) -> bool {
        self.is_complete(term) && self.seat.page().is_open(term)
    }

    /// Whether the standby takes over when this process ends, which holds the node.
    pub(crate) fn is_followed(&self) -> bool {
        self.term().is_some_and(|term| self.seat.page().is_open(term))
    }

    /// For each task the cycle after the one whose state came last.
    pub(crate) fn next_cycles(&self) -> impl Iterator<Item = u64> {
        self.received.iter().map(|received| received.next_cycle.load(Ordering::Acquire))
    }

    /// Whether the holder died before there was a state of each task.
    pub(crate) fn is_orphaned(&self) -> bool {
        self.is_orphaned.load(Ordering::Relaxed)
    }

    /// Notes that the holder of this term died before that, unless a task of this process has taken over meanwhile; from
    /// then on none does.
    pub(crate) fn orphan(&self, term: u64) {
        let page = self.seat.page();
        page.close_to_standby(term);
        if page.term() == term && TwinPage::seat_of(term) != self.seat.number() {
            self.is_orphaned.store(true, Ordering::Relaxed);
        }
    }

    /// Whether the state is to be sent.
    #[inline]
    pub(crate) fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed)
    }

    /// Notes what the standby said last, and has the tasks send it their states; `None`: none follows.
    pub(crate) fn set_standby(&self, standby: Option<Standby>) {
        self.is_wanted.store(standby.is_some(), Ordering::Relaxed);
        *self.lock() = standby;
    }

    /// What the standby said last; `None`: none follows. For ordinary threads.
    pub(crate) fn standby(&self) -> Option<Standby> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Option<Standby>> {
        self.standby.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The first 16 digits of a SHA-256.
pub(super) fn number_of(sha256: &str) -> u64 {
    let digits = sha256.get(..16).unwrap_or_default();
    u64::from_str_radix(digits, 16).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::{IsolatedDomain, Participant};

    use super::*;

    /// The two processes of a node, the first of which holds it with this term.
    fn twins(domain: &IsolatedDomain) -> ([Twin; 2], u64) {
        let twins = ["first", "second"].map(|name| {
            let participant = Participant::join(name, domain).unwrap();
            let seat = participant.take_seat("level", &["fast"]).unwrap();
            Twin::new(Arc::new(seat), 0, 2)
        });
        let term = twins[0].term().unwrap();
        (twins, term)
    }

    #[test]
    fn a_process_that_has_taken_over_is_no_orphan_of_the_holder_before() {
        let domain = IsolatedDomain::new("isort").unwrap();
        let ([first, second], term) = twins(&domain);
        first.seat().page().open_to_standby(term);
        assert!(second.take_over(term, false, 0, 0));
        for seen in [term, second.term().unwrap()] {
            second.orphan(seen);
            assert!(!second.is_orphaned());
        }
    }

    #[test]
    fn an_orphan_takes_over_no_more() {
        let domain = IsolatedDomain::new("isort").unwrap();
        let ([first, second], term) = twins(&domain);
        first.seat().page().open_to_standby(term);
        second.orphan(term);
        assert!(second.is_orphaned());
        assert!(!second.take_over(term, false, 0, 0));
    }
}
