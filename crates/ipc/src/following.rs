//! Which writer of a service a reader follows, and what its sequence says. No ports, no clock.
//!
//! One at a time. A higher `term` is followed at once; any other writer when the one before has left,
//! or was silent for a while. What the others send until then is counted and not read.

/// How long a writer may be silent before another one is taken, in ns: 1 s, or three periods where those
/// are longer. A `period_ns` of 0 is one that the writer did not announce.
pub fn longest_silence_ns(period_ns: u64) -> u64 {
    period_ns.saturating_mul(3).max(1_000_000_000)
}

/// No sender is faster than a frame in this time: iceoryx2 alone takes longer to send one.
const SHORTEST_NS: u64 = 100;
/// A jump of so many frames is a loss however little time has passed: what waits in a buffer was
/// sent before the reader's clock was read.
const ALWAYS_POSSIBLE: u64 = 65_536;

/// As many writers as a service of ours has places for.
const MAX_OTHERS: usize = 8;

/// A frame as it arrives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrival {
    /// Who sent it: the port's id.
    pub(crate) writer: u128,
    pub(crate) term: u64,
    pub(crate) sequence: u64,
    /// The reader's clock.
    pub(crate) now_ns: u64,
}

/// What is to be done with a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It is of the writer that is followed.
    Take,
    /// It is of another writer, which is known beside the one that is followed.
    Leave,
    /// It is of another writer that was not seen before: either a second one, or the successor of
    /// one that has left. [`Following::look`] settles which.
    Stranger,
}

/// What was seen of the writers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) received: u64,
    pub(crate) lost: u64,
    pub(crate) restarts: u64,
    pub(crate) other_writers: u64,
}

/// Follows one writer. Never allocates after `new`.
#[derive(Debug)]
pub(crate) struct Following {
    followed: Option<Followed>,
    silence_ns: u64,
    /// Writers known to be there beside the one that is followed.
    others: Vec<u128>,
    /// Frames of strangers that were left, until it is known whether those are second writers.
    undecided: u64,
    seen: Seen,
}

#[derive(Debug)]
struct Followed {
    writer: u128,
    term: u64,
    sequence: u64,
    heard_ns: u64,
    has_left: bool,
}

impl Following {
    pub(crate) fn new() -> Self {
        Self {
            followed: None,
            silence_ns: longest_silence_ns(0),
            others: Vec::with_capacity(MAX_OTHERS),
            undecided: 0,
            seen: Seen::default(),
        }
    }

    /// Sets the period that the writer announced, in ns.
    pub(crate) fn set_period(&mut self, period_ns: u64) {
        self.silence_ns = longest_silence_ns(period_ns);
    }

    /// Judges the next frame.
    pub(crate) fn judge(&mut self, arrival: &Arrival) -> Verdict {
        let count = |counter: &mut u64, by: u64| *counter = counter.saturating_add(by);
        let Some(followed) = &mut self.followed else {
            self.follow(arrival);
            return Verdict::Take;
        };
        if arrival.writer == followed.writer {
            let elapsed_ns = arrival.now_ns.saturating_sub(followed.heard_ns);
            match loss(followed.sequence, arrival.sequence, elapsed_ns) {
                Some(lost) => count(&mut self.seen.lost, lost),
                None => count(&mut self.seen.restarts, 1),
            }
            followed.sequence = arrival.sequence;
            followed.term = arrival.term;
            followed.heard_ns = arrival.now_ns.max(followed.heard_ns);
            count(&mut self.seen.received, 1);
            return Verdict::Take;
        }
        let silent_ns = arrival.now_ns.saturating_sub(followed.heard_ns);
        if arrival.term > followed.term || followed.has_left || silent_ns >= self.silence_ns {
            // The same sender through another port: a link between machines was started again.
            let goes_on = arrival.term != 0 && arrival.term == followed.term;
            match loss(followed.sequence, arrival.sequence, silent_ns).filter(|_| goes_on) {
                Some(lost) => count(&mut self.seen.lost, lost),
                None => count(&mut self.seen.restarts, 1),
            }
            self.follow(arrival);
            return Verdict::Take;
        }
        if self.others.contains(&arrival.writer) || self.others.len() == MAX_OTHERS {
            count(&mut self.seen.other_writers, 1);
            return Verdict::Leave;
        }
        count(&mut self.undecided, 1);
        Verdict::Stranger
    }

    fn follow(&mut self, arrival: &Arrival) {
        self.seen.received = self.seen.received.saturating_add(1);
        self.others.clear();
        self.undecided = 0;
        self.followed = Some(Followed {
            writer: arrival.writer,
            term: arrival.term,
            sequence: arrival.sequence,
            heard_ns: arrival.now_ns,
            has_left: false,
        });
    }

    /// Whether a stranger waits for [`look`](Self::look).
    pub(crate) fn has_stranger(&self) -> bool {
        self.undecided > 0
    }

    /// Takes note of who writes the service now.
    pub(crate) fn look(&mut self, present: &[u128]) {
        let Some(followed) = &mut self.followed else { return };
        followed.has_left = !present.contains(&followed.writer);
        let undecided = std::mem::take(&mut self.undecided);
        self.others.clear();
        if followed.has_left {
            return;
        }
        self.seen.other_writers = self.seen.other_writers.saturating_add(undecided);
        let others = present.iter().filter(|writer| **writer != followed.writer);
        self.others.extend(others.take(MAX_OTHERS));
    }

    /// Whether the writer that is followed has left.
    pub(crate) fn has_lost_its_writer(&self) -> bool {
        self.followed.as_ref().is_some_and(|followed| followed.has_left)
    }

    pub(crate) fn seen(&self) -> Seen {
        self.seen
    }
}

/// How many frames were lost between two of one writer that arrived `elapsed_ns` after each other;
/// `None` where the sequence began anew.
fn loss(last: u64, sequence: u64, elapsed_ns: u64) -> Option<u64> {
    let lost = sequence.checked_sub(last)?.checked_sub(1)?;
    let possible = (elapsed_ns / SHORTEST_NS).saturating_add(ALWAYS_POSSIBLE);
    (lost <= possible).then_some(lost)
}

#[cfg(test)]
#[path = "following_tests.rs"]
mod tests;
