//! Which writer of a service a reader follows, and what its sequence says. No ports, no clock.
//!
//! A reader follows one writer at a time. It changes to a writer with a higher `term` at once, to any other when the
//! one before has ended, left or been silent for a while. Until then, frames of other writers are counted and not
//! read.
//!
//! Two processes that stand in for each other are one writer. Of these, a frame with a lower term than one that was seen
//! is never read: it is of one that was stopped and did not know that the other had taken over.
//!
//! A writer on this machine takes precedence over one on another machine, whose frames arrive by a link: terms of two
//! machines are not comparable, and readers on both would change over to the writer that started last.

/// How long a writer may be silent before another one is taken, in ns: 1 s, or three periods where those
/// are longer. A `period_ns` of 0 is one that the writer did not announce.
pub fn longest_silence_ns(period_ns: u64) -> u64 {
    period_ns.saturating_mul(3).max(1_000_000_000)
}

/// No sender is faster than a frame in this time: iceoryx2 alone takes longer to send one.
const SHORTEST_NS: u64 = 100;
/// A jump of this many frames is a loss however little time has passed: frames that waited in a buffer were sent
/// before the reader's clock was read.
const ALWAYS_POSSIBLE: u64 = 65_536;

/// The most writers that a service of ours has places for.
const MAX_PRESENT: usize = 8;

/// A frame as it arrives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrival {
    /// Its sender: the id of the port.
    pub(crate) writer: u128,
    pub(crate) term: u64,
    pub(crate) sequence: u64,
    /// Whether its sender is ending.
    pub(crate) is_last: bool,
    /// The reader's clock.
    pub(crate) now_ns: u64,
}

/// A writer of a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Writer {
    /// The port's id.
    pub(crate) id: u128,
    /// Whether it is a link, which passes on frames of a writer on another machine.
    pub(crate) is_far: bool,
    /// Whether it is one of two processes that stand in for each other.
    pub(crate) is_twin: bool,
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

/// Counts of the frames and writers seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct WriterCounts {
    pub(crate) received: u64,
    pub(crate) lost: u64,
    pub(crate) restarts: u64,
    pub(crate) other_writers: u64,
    pub(crate) superseded: u64,
}

/// Follows one writer. Never allocates after `new`.
#[derive(Debug)]
pub(crate) struct Following {
    followed: Option<FollowedWriter>,
    silence_ns: u64,
    /// Writers known to be there, among them the one that is followed.
    present: Vec<Writer>,
    /// Unread frames of strangers, until it is known whether those are second writers.
    undecided: u64,
    counts: WriterCounts,
}

#[derive(Debug)]
struct FollowedWriter {
    writer: u128,
    term: u64,
    sequence: u64,
    heard_ns: u64,
    /// Whether its last frame said that it ends: the port of a link stays.
    has_ended: bool,
    has_left: bool,
    /// As was known when it was looked up last.
    is_twin: bool,
}

impl Following {
    pub(crate) fn new() -> Self {
        Self {
            followed: None,
            silence_ns: longest_silence_ns(0),
            present: Vec::with_capacity(MAX_PRESENT),
            undecided: 0,
            counts: WriterCounts::default(),
        }
    }

    /// Sets the period that the writer announced, in ns.
    pub(crate) fn set_period(&mut self, period_ns: u64) {
        self.silence_ns = longest_silence_ns(period_ns);
    }

    /// Whether [`look`](Self::look) must come before the frame is judged: its term would make it the successor
    /// of the writer that is followed, if no link lies between them.
    pub(crate) fn must_look(&self, arrival: &Arrival) -> bool {
        let Some(followed) = &self.followed else { return false };
        let [new, old] = [arrival.writer, followed.writer].map(|writer| self.is_far(writer));
        let may_follow = arrival.term > followed.term || old == Some(true) && arrival.term > 0;
        // Also of one that was looked up: a link opens the end by which it is known last.
        let is_open = new != Some(true) || old.is_none();
        arrival.writer != followed.writer
            && may_follow
            && is_open
            && self.present.len() < MAX_PRESENT
    }

    /// Whether a writer is a link; `None` if it is not known to be there.
    fn is_far(&self, writer: u128) -> Option<bool> {
        self.present.iter().find(|present| present.id == writer).map(|present| present.is_far)
    }

    /// Judges the next frame.
    pub(crate) fn judge(&mut self, arrival: &Arrival) -> Verdict {
        let count = |counter: &mut u64, by: u64| *counter = counter.saturating_add(by);
        let present = &self.present;
        let Some(followed) = &mut self.followed else {
            self.follow(arrival);
            return Verdict::Take;
        };
        if arrival.writer == followed.writer {
            let elapsed_ns = arrival.now_ns.saturating_sub(followed.heard_ns);
            match loss(followed.sequence, arrival.sequence, elapsed_ns) {
                Some(lost) => count(&mut self.counts.lost, lost),
                None => count(&mut self.counts.restarts, 1),
            }
            followed.sequence = arrival.sequence;
            followed.term = arrival.term;
            followed.has_ended = arrival.is_last;
            followed.heard_ns = arrival.now_ns.max(followed.heard_ns);
            count(&mut self.counts.received, 1);
            return Verdict::Take;
        }
        let silent_ns = arrival.now_ns.saturating_sub(followed.heard_ns);
        let is_twin = |writer| present.iter().any(|known| known.id == writer && known.is_twin);
        // The one that is followed was killed, maybe, and has left.
        let are_twins = is_twin(arrival.writer) && followed.is_twin;
        if are_twins && arrival.term < followed.term {
            count(&mut self.counts.superseded, 1);
            return Verdict::Leave;
        }
        let is_far = |writer| present.iter().any(|known| known.id == writer && known.is_far);
        let goes_before = match (is_far(arrival.writer), is_far(followed.writer)) {
            (true, false) => false,
            (false, true) => arrival.term > 0,
            _ => arrival.term > followed.term,
        };
        let is_over = followed.has_left || followed.has_ended || silent_ns >= self.silence_ns;
        if goes_before || is_over {
            // The same sender through another port: a link between machines was started again.
            let goes_on = arrival.term != 0 && arrival.term == followed.term || are_twins;
            match loss(followed.sequence, arrival.sequence, silent_ns).filter(|_| goes_on) {
                Some(lost) => count(&mut self.counts.lost, lost),
                None => count(&mut self.counts.restarts, 1),
            }
            self.follow(arrival);
            return Verdict::Take;
        }
        if present.len() == MAX_PRESENT || present.iter().any(|known| known.id == arrival.writer) {
            count(&mut self.counts.other_writers, 1);
            return Verdict::Leave;
        }
        count(&mut self.undecided, 1);
        Verdict::Stranger
    }

    fn follow(&mut self, arrival: &Arrival) {
        self.counts.received = self.counts.received.saturating_add(1);
        self.undecided = 0;
        self.followed = Some(FollowedWriter {
            writer: arrival.writer,
            term: arrival.term,
            sequence: arrival.sequence,
            heard_ns: arrival.now_ns,
            has_ended: arrival.is_last,
            has_left: false,
            is_twin: self.present.iter().any(|it| it.id == arrival.writer && it.is_twin),
        });
    }

    /// Whether a stranger waits for [`look`](Self::look).
    pub(crate) fn has_stranger(&self) -> bool {
        self.undecided > 0
    }

    /// Records the current writers of the service.
    pub(crate) fn look(&mut self, present: &[Writer]) {
        self.present.clear();
        self.present.extend(present.iter().take(MAX_PRESENT));
        let Some(followed) = &mut self.followed else { return };
        let found = present.iter().find(|writer| writer.id == followed.writer);
        followed.has_left = found.is_none();
        followed.is_twin = found.map_or(followed.is_twin, |found| found.is_twin);
        let undecided = std::mem::take(&mut self.undecided);
        if !followed.has_left {
            self.counts.other_writers = self.counts.other_writers.saturating_add(undecided);
        }
    }

    /// Whether the writer that is followed has left.
    pub(crate) fn has_lost_its_writer(&self) -> bool {
        self.followed.as_ref().is_some_and(|followed| followed.has_left)
    }

    pub(crate) fn counts(&self) -> WriterCounts {
        self.counts
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
