//! Which writer of a service a reader follows, and what its sequence says. No ports, no clock.
//!
//! One at a time. A higher `term` is followed at once; any other writer when the one before has left,
//! or was silent for a while. What the others send until then is counted and not read.

/// How long a writer may be silent before another one is taken.
const SILENCE_NS: u64 = 1_000_000_000;
/// The same in periods, where the writer announced one.
const SILENT_PERIODS: u64 = 3;

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
            silence_ns: SILENCE_NS,
            others: Vec::with_capacity(MAX_OTHERS),
            undecided: 0,
            seen: Seen::default(),
        }
    }

    /// Sets the period that the writer announced, in ns.
    pub(crate) fn set_period(&mut self, period_ns: u64) {
        self.silence_ns = SILENCE_NS.max(period_ns.saturating_mul(SILENT_PERIODS));
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
            count(&mut self.seen.restarts, 1);
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
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    fn plain(writer: u128, sequence: u64, now_ns: u64) -> Arrival {
        Arrival { writer, term: 0, sequence, now_ns }
    }

    /// Takes frames of one writer, 1 ms apart.
    fn sequences(sequences: impl IntoIterator<Item = u64>) -> Seen {
        let mut following = Following::new();
        for (index, sequence) in sequences.into_iter().enumerate() {
            let now_ns = index as u64 * 1_000_000;
            assert_eq!(following.judge(&plain(1, sequence, now_ns)), Verdict::Take);
        }
        following.seen()
    }

    #[test]
    fn a_gap_in_the_sequence_is_a_loss_of_exactly_that_many() {
        let seen = sequences([0, 1, 5, 6, 8]);
        assert_eq!((seen.received, seen.lost, seen.restarts), (5, 4, 0));
    }

    #[test]
    fn joining_a_running_publisher_is_no_loss() {
        assert_eq!(sequences([1_000, 1_001]).lost, 0);
    }

    #[test]
    fn a_sequence_that_goes_back_is_a_restart_and_no_loss() {
        let seen = sequences([10, 11, 0, 1, 3]);
        assert_eq!((seen.lost, seen.restarts), (1, 1));
    }

    #[test]
    fn a_publisher_that_restarts_before_each_frame_is_seen() {
        assert_eq!(sequences([0, 0, 0]).restarts, 2);
    }

    #[test]
    fn a_sequence_that_alternates_between_its_ends_is_restarts_and_no_loss() {
        let seen = sequences((0..1_000).map(|n| if n % 2 == 0 { 0 } else { u64::MAX }));
        assert_eq!((seen.lost, seen.restarts), (0, 999));
    }

    #[test]
    fn what_a_slow_reader_misses_of_a_fast_publisher_is_a_loss() {
        let mut following = Following::new();
        following.judge(&plain(1, 0, 0));
        // A reader that looks once a second, and a publisher at 1 MHz.
        following.judge(&plain(1, 1_000_000, SECOND_NS));
        assert_eq!((following.seen().lost, following.seen().restarts), (999_999, 0));
        // More than any publisher sends in a second.
        following.judge(&plain(1, 100_000_000, 2 * SECOND_NS));
        assert_eq!((following.seen().lost, following.seen().restarts), (999_999, 1));
    }

    #[test]
    fn a_higher_term_is_followed_at_once_and_a_lower_one_is_not() {
        let mut following = Following::new();
        let with_term = |term: u64| Arrival { writer: term.into(), term, sequence: 7, now_ns: 5 };
        assert_eq!(following.judge(&with_term(10)), Verdict::Take);
        assert_eq!(following.judge(&with_term(11)), Verdict::Take);
        assert_eq!(following.judge(&with_term(10)), Verdict::Stranger);
        assert_eq!(following.judge(&with_term(11)), Verdict::Take);
        let seen = following.seen();
        assert_eq!((seen.restarts, seen.lost, seen.received), (2, 0, 3), "7 after 7 is one too");
    }

    #[test]
    fn a_second_writer_is_counted_and_not_taken_as_long_as_the_first_is_heard() {
        let mut following = Following::new();
        for cycle in 0..5_000 {
            let now_ns = cycle * 1_000_000;
            assert_eq!(following.judge(&plain(1, cycle, now_ns)), Verdict::Take);
            assert_ne!(following.judge(&plain(2, cycle * 1_000, now_ns)), Verdict::Take);
            if following.has_stranger() {
                following.look(&[1, 2]);
            }
        }
        let seen = following.seen();
        assert_eq!((seen.received, seen.lost, seen.restarts), (5_000, 0, 0));
        assert_eq!(seen.other_writers, 5_000);
    }

    #[test]
    fn the_successor_of_a_writer_that_has_left_is_taken_and_never_counted_as_another() {
        let mut following = Following::new();
        following.judge(&plain(1, 900, 0));
        assert_eq!(following.judge(&plain(2, 0, 1_000)), Verdict::Stranger);
        following.look(&[2]);
        assert_eq!(following.judge(&plain(2, 1, 2_000)), Verdict::Take);
        let seen = following.seen();
        assert_eq!((seen.other_writers, seen.restarts, seen.lost), (0, 1, 0));
    }

    #[test]
    fn what_a_writer_left_behind_is_still_taken() {
        let mut following = Following::new();
        following.judge(&plain(1, 0, 0));
        following.look(&[]);
        assert_eq!(following.judge(&plain(1, 1, 1)), Verdict::Take);
        assert_eq!(following.seen().restarts, 0);
    }

    #[test]
    fn another_writer_is_taken_after_a_second_of_silence_or_three_periods() {
        let silence = |period_ns: u64| {
            let mut following = Following::new();
            following.set_period(period_ns);
            following.judge(&plain(1, 0, 0));
            let is_left = |now_ns: &u64| following.judge(&plain(2, 0, *now_ns)) != Verdict::Take;
            (0..60).map(|tenths| tenths * SECOND_NS / 10).take_while(is_left).count()
        };
        assert_eq!(silence(1_000_000), 10);
        assert_eq!(silence(SECOND_NS), 30);
        assert_eq!(silence(u64::MAX), 60);
    }

    proptest! {
        #[test]
        fn received_and_lost_frames_add_up_to_those_published(
            received in prop::collection::btree_set(0u64..1_000, 1..200),
        ) {
            let published = received.last().unwrap() - received.first().unwrap() + 1;
            let seen = sequences(received);
            prop_assert_eq!(seen.received + seen.lost, published);
            prop_assert_eq!(seen.restarts, 0);
        }

        #[test]
        fn whatever_arrives_nothing_overflows_and_nothing_impossible_is_lost(
            arrivals in prop::collection::vec(
                (
                    0_u128..4,
                    prop_oneof![Just(0), Just(u64::MAX), any::<u64>()],
                    prop_oneof![Just(0), Just(u64::MAX), 0..100_u64, any::<u64>()],
                    prop_oneof![Just(0), Just(u64::MAX), 0..SECOND_NS],
                    any::<bool>(),
                ),
                0..300,
            ),
        ) {
            let mut following = Following::new();
            let (mut now_ns, mut taken) = (0_u64, 0);
            for (writer, term, sequence, later_ns, looks) in arrivals {
                now_ns = now_ns.saturating_add(later_ns);
                let arrival = Arrival { writer, term, sequence, now_ns };
                taken += u64::from(following.judge(&arrival) == Verdict::Take);
                if looks {
                    following.look(&[0, 1]);
                }
            }
            let seen = following.seen();
            prop_assert_eq!(seen.received, taken);
            prop_assert!(seen.restarts < taken.max(1));
            let possible = (now_ns / SHORTEST_NS).saturating_add(taken.saturating_mul(ALWAYS_POSSIBLE));
            prop_assert!(seen.lost <= possible, "{} of {possible}", seen.lost);
        }
    }
}
