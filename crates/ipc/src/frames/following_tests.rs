use proptest::prelude::*;

use super::*;

const SECOND_NS: u64 = 1_000_000_000;

fn plain(writer: u128, sequence: u64, now_ns: u64) -> Arrival {
    Arrival { writer, term: 0, sequence, is_last: false, now_ns }
}

/// Writers of this machine.
fn near<const COUNT: usize>(writers: [u128; COUNT]) -> [Writer; COUNT] {
    writers.map(|id| Writer { id, is_far: false, is_twin: false })
}

/// Takes frames of one writer, 1 ms apart.
fn sequences(sequences: impl IntoIterator<Item = u64>) -> WriterCounts {
    let mut following = Following::new();
    for (index, sequence) in sequences.into_iter().enumerate() {
        let now_ns = index as u64 * 1_000_000;
        assert_eq!(following.judge(&plain(1, sequence, now_ns)), Verdict::Take);
    }
    following.counts()
}

#[test]
fn a_gap_in_the_sequence_is_a_loss_of_exactly_that_many() {
    let counts = sequences([0, 1, 5, 6, 8]);
    assert_eq!((counts.received, counts.lost, counts.restarts), (5, 4, 0));
}

#[test]
fn joining_a_running_publisher_is_no_loss() {
    assert_eq!(sequences([1_000, 1_001]).lost, 0);
}

#[test]
fn a_sequence_that_goes_back_is_a_restart_and_no_loss() {
    let counts = sequences([10, 11, 0, 1, 3]);
    assert_eq!((counts.lost, counts.restarts), (1, 1));
}

#[test]
fn a_publisher_that_restarts_before_each_frame_is_seen() {
    assert_eq!(sequences([0, 0, 0]).restarts, 2);
}

#[test]
fn a_sequence_that_alternates_between_its_ends_is_restarts_and_no_loss() {
    let counts = sequences((0..1_000).map(|n| if n % 2 == 0 { 0 } else { u64::MAX }));
    assert_eq!((counts.lost, counts.restarts), (0, 999));
}

#[test]
fn what_a_slow_reader_misses_of_a_fast_publisher_is_a_loss() {
    let mut following = Following::new();
    following.judge(&plain(1, 0, 0));
    // A reader that looks once a second, and a publisher at 1 MHz.
    following.judge(&plain(1, 1_000_000, SECOND_NS));
    assert_eq!((following.counts().lost, following.counts().restarts), (999_999, 0));
    // More than any publisher sends in a second.
    following.judge(&plain(1, 100_000_000, 2 * SECOND_NS));
    assert_eq!((following.counts().lost, following.counts().restarts), (999_999, 1));
}

#[test]
fn a_higher_term_is_followed_at_once_and_a_lower_one_is_not() {
    let mut following = Following::new();
    let with_term = |term: u64| Arrival { term, ..plain(term.into(), 7, 5) };
    assert_eq!(following.judge(&with_term(10)), Verdict::Take);
    assert_eq!(following.judge(&with_term(11)), Verdict::Take);
    assert_eq!(following.judge(&with_term(10)), Verdict::Stranger);
    assert_eq!(following.judge(&with_term(11)), Verdict::Take);
    let counts = following.counts();
    assert_eq!((counts.restarts, counts.lost, counts.received), (2, 0, 3), "7 after 7 is one too");
}

#[test]
fn a_sender_that_comes_back_through_another_port_goes_on_and_what_it_sent_meanwhile_is_lost() {
    let mut following = Following::new();
    let through = |writer: u128, term: u64, sequence: u64, now_ns: u64| Arrival {
        term,
        ..plain(writer, sequence, now_ns)
    };
    following.judge(&through(1, 10, 7, 0));
    following.look(&near([2]));
    assert_eq!(following.judge(&through(2, 10, 12, SECOND_NS / 4)), Verdict::Take);
    assert_eq!((following.counts().lost, following.counts().restarts), (4, 0));
    // One that began anew, and one that says nothing of its term, may be anybody.
    following.look(&near([3]));
    assert_eq!(following.judge(&through(3, 10, 3, SECOND_NS / 2)), Verdict::Take);
    following.look(&near([4]));
    assert_eq!(following.judge(&through(4, 0, 9, SECOND_NS)), Verdict::Take);
    following.look(&near([5]));
    assert_eq!(following.judge(&through(5, 0, 19, 2 * SECOND_NS)), Verdict::Take);
    assert_eq!((following.counts().lost, following.counts().restarts), (4, 3));
}

#[test]
fn a_second_writer_is_counted_and_not_taken_as_long_as_the_first_is_heard() {
    let mut following = Following::new();
    for cycle in 0..5_000 {
        let now_ns = cycle * 1_000_000;
        assert_eq!(following.judge(&plain(1, cycle, now_ns)), Verdict::Take);
        assert_ne!(following.judge(&plain(2, cycle * 1_000, now_ns)), Verdict::Take);
        if following.has_stranger() {
            following.look(&near([1, 2]));
        }
    }
    let counts = following.counts();
    assert_eq!((counts.received, counts.lost, counts.restarts), (5_000, 0, 0));
    assert_eq!(counts.other_writers, 5_000);
}

#[test]
fn the_successor_of_a_writer_that_has_left_is_taken_and_never_counted_as_another() {
    let mut following = Following::new();
    following.judge(&plain(1, 900, 0));
    assert_eq!(following.judge(&plain(2, 0, 1_000)), Verdict::Stranger);
    following.look(&near([2]));
    assert_eq!(following.judge(&plain(2, 1, 2_000)), Verdict::Take);
    let counts = following.counts();
    assert_eq!((counts.other_writers, counts.restarts, counts.lost), (0, 1, 0));
}

#[test]
fn what_a_writer_left_behind_is_still_taken() {
    let mut following = Following::new();
    following.judge(&plain(1, 0, 0));
    following.look(&near([]));
    assert_eq!(following.judge(&plain(1, 1, 1)), Verdict::Take);
    assert_eq!(following.counts().restarts, 0);
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

/// One writer here, and a link.
const NEAR_AND_FAR: [Writer; 2] = [
    Writer { id: 1, is_far: false, is_twin: false },
    Writer { id: 2, is_far: true, is_twin: false },
];

#[test]
fn a_writer_of_another_machine_replaces_one_of_this_machine_only_when_that_is_over() {
    let from = |writer: u128, term: u64, now_ns: u64| Arrival { term, ..plain(writer, 0, now_ns) };
    let mut following = Following::new();
    following.judge(&from(1, 10, 0));
    assert!(following.must_look(&from(2, 11, 0)), "it may be of this machine");
    following.look(&NEAR_AND_FAR);
    assert!(!following.must_look(&from(2, 11, 0)));
    assert_eq!(following.judge(&from(2, 11, 0)), Verdict::Leave);
    assert_eq!(following.judge(&from(2, 12, SECOND_NS - 1)), Verdict::Leave);
    assert_eq!(following.counts().other_writers, 2);
    assert_eq!(following.judge(&from(2, 12, SECOND_NS)), Verdict::Take);
    // Once the one of this machine is heard again, whoever of them started first.
    assert_eq!(following.judge(&from(1, 10, SECOND_NS)), Verdict::Take);
    assert_eq!(following.judge(&from(2, 13, SECOND_NS)), Verdict::Leave);
    // It says that it ends, or is gone.
    following.judge(&Arrival { is_last: true, ..from(1, 10, SECOND_NS) });
    assert_eq!(following.judge(&from(2, 13, SECOND_NS)), Verdict::Take);
}

#[test]
fn a_writer_of_this_machine_that_has_no_term_waits_for_the_end_of_a_far_one() {
    let mut following = Following::new();
    let far = |now_ns: u64| Arrival { term: 5, ..plain(2, 0, now_ns) };
    following.look(&NEAR_AND_FAR);
    following.judge(&far(0));
    assert_eq!(following.judge(&plain(1, 0, 0)), Verdict::Leave);
    assert_eq!(following.judge(&plain(1, 0, SECOND_NS)), Verdict::Take);
    assert_eq!(following.judge(&far(SECOND_NS)), Verdict::Leave);
}

proptest! {
    #[test]
    fn received_and_lost_frames_add_up_to_those_published(
        received in prop::collection::btree_set(0u64..1_000, 1..200),
    ) {
        let published = received.last().unwrap() - received.first().unwrap() + 1;
        let counts = sequences(received);
        prop_assert_eq!(counts.received + counts.lost, published);
        prop_assert_eq!(counts.restarts, 0);
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
            let arrival = Arrival { term, ..plain(writer, sequence, now_ns) };
            taken += u64::from(following.judge(&arrival) == Verdict::Take);
            if looks {
                following.look(&near([0, 1]));
            }
        }
        let counts = following.counts();
        prop_assert_eq!(counts.received, taken);
        prop_assert!(counts.restarts < taken.max(1));
        let possible = (now_ns / SHORTEST_NS).saturating_add(taken.saturating_mul(ALWAYS_POSSIBLE));
        prop_assert!(counts.lost <= possible, "{} of {possible}", counts.lost);
    }
}

/// Two processes that stand in for each other.
const TWINS: [Writer; 2] = [
    Writer { id: 1, is_far: false, is_twin: true },
    Writer { id: 2, is_far: false, is_twin: true },
];

/// A frame of one of them.
fn of_twin(writer: u128, term: u64, sequence: u64, now_ns: u64) -> Arrival {
    Arrival { writer, term, sequence, is_last: false, now_ns }
}

#[test]
fn a_twin_that_takes_over_is_the_same_writer_whose_missing_frames_are_lost() {
    let mut following = Following::new();
    following.look(&TWINS);
    assert_eq!(following.judge(&of_twin(1, 10, 5, 0)), Verdict::Take);
    assert_eq!(following.judge(&of_twin(2, 11, 8, 3)), Verdict::Take);
    let WriterCounts { lost, restarts, other_writers, .. } = following.counts();
    assert_eq!((lost, restarts, other_writers), (2, 0, 0));
}

#[test]
fn a_frame_of_a_twin_that_was_taken_over_is_dropped_whatever_became_of_the_other() {
    let mut following = Following::new();
    following.look(&TWINS);
    following.judge(&of_twin(2, 11, 8, 0));
    let late_ns = 5 * longest_silence_ns(0);
    assert_eq!(following.judge(&of_twin(1, 10, 9, 1)), Verdict::Leave);
    assert_eq!(following.judge(&of_twin(1, 10, 10, late_ns)), Verdict::Leave);
    following.look(&TWINS[..1]);
    assert_eq!(following.judge(&of_twin(1, 10, 11, late_ns)), Verdict::Leave);
    let WriterCounts { superseded, other_writers, .. } = following.counts();
    assert_eq!((superseded, other_writers), (3, 0));
    assert_eq!(following.judge(&of_twin(1, 12, 9, late_ns)), Verdict::Take);
}
