use proptest::prelude::*;

use super::*;

const PERIOD_NS: u64 = 10_000_000;
const MAX_AGE_NS: u64 = 100_000_000;

fn freshness(on_stale: OnStale, bad: Bad) -> Freshness {
    let plan = plan(on_stale, bad);
    Freshness::new(&plan, Accepted::of_service(&plan), PERIOD_NS)
}

fn plan(on_stale: OnStale, bad: Bad) -> InputPlan {
    InputPlan {
        unit: String::new(),
        comment: String::new(),
        name: "x".into(),
        value_type: PinType::Lreal,
        service: None,
        binding: isochrone_engine::config::Binding::Channel(0),
        default: 1.0,
        range: None,
        finite: true,
        max_age_ns: Some(MAX_AGE_NS),
        on_stale,
        bad,
        feedback: false,
        span: 0..0,
    }
}

fn int() -> Freshness {
    taking(Accepted::all_of(PinType::Int))
}

fn taking(accepted: Accepted) -> Freshness {
    Freshness { accepted, ..freshness(OnStale::Hold, Bad::Ignore) }
}

fn sample(value: f64, sampled_ns: u64) -> Sample {
    Sample { value, sampled_ns, source_ns: sampled_ns - 5, flags: Flags::NONE }
}

#[test]
fn an_input_without_a_sample_reads_its_default_and_is_not_ok() {
    let mut input = freshness(OnStale::Hold, Bad::Ignore);
    let reading = input.read(50);
    let flags = Flags::SUBSTITUTE;
    let age_s = f64::INFINITY;
    assert_eq!(reading, InputReading { value: 1.0, ok: false, age_s, source_ns: 0, flags });
    assert_eq!(input.state(), InputState::Waiting);
}

#[test]
fn a_sample_is_ok_until_it_is_older_than_max_age() {
    let mut input = freshness(OnStale::Hold, Bad::Ignore);
    assert!(input.offer(sample(7.0, 1_000)));
    let reading = input.read(1_000 + MAX_AGE_NS);
    let (age_s, flags) = (0.1, Flags::NONE);
    assert_eq!(reading, InputReading { value: 7.0, ok: true, age_s, source_ns: 995, flags });
    let reading = input.read(1_001 + MAX_AGE_NS);
    assert_eq!((reading.value, reading.ok, reading.flags), (7.0, false, Flags::STALE));
    assert_eq!((input.state(), reading.source_ns), (InputState::Stale, 995));
    assert!(input.offer(sample(8.0, 2_000 + MAX_AGE_NS)));
    assert!(input.read(2_000 + MAX_AGE_NS).ok);
    assert_eq!(input.tally(), Tally { falls: 1, not_ok_ns: 999 });
}

#[test]
fn a_stale_input_reads_its_default_if_it_says_so_and_keeps_its_age() {
    let mut input = freshness(OnStale::Default, Bad::Ignore);
    input.offer(sample(7.0, 1_000));
    let reading = input.read(1_000 + 2 * MAX_AGE_NS);
    let flags = Flags::STALE | Flags::SUBSTITUTE;
    assert_eq!(reading, InputReading { value: 1.0, ok: false, age_s: 0.2, source_ns: 0, flags });
}

#[test]
fn a_sample_that_the_type_cannot_hold_leaves_the_one_before_and_is_told_until_a_good_one_comes() {
    let mut input = int();
    assert!(!input.offer(sample(f64::NAN, 1_000)));
    assert_eq!(input.read(1_000).flags, Flags::SUBSTITUTE | Flags::REJECTED);
    assert!(input.offer(sample(3.0, 2_000)));
    assert!(!input.offer(sample(0.5, 3_000)));
    let reading = input.read(3_000);
    assert_eq!((reading.value, reading.ok, reading.flags), (3.0, false, Flags::REJECTED));
    assert_eq!(input.state(), InputState::Rejected(0.5));
    let short = Missing::Channel { channel: 1, values: 1 };
    for why in [Missing::Layout, Missing::Signal, short] {
        input.miss(Flags::NONE, why);
        assert_eq!(input.read(3_000).flags, Flags::REJECTED);
        assert_eq!(input.state(), InputState::Missing(why));
        assert!(
            !input.state().is_like(InputState::Missing(Missing::Channel { channel: 2, values: 1 }))
        );
    }
    input.offer(sample(4.0, 4_000));
    assert!(input.read(4_000).ok);
}

#[test]
fn a_frame_in_doubt_is_taken_and_handed_on_or_taken_for_stale() {
    let doubted = Sample { flags: Flags::ERROR | Flags::FORCED, ..sample(9.0, 2_000) };
    let mut input = freshness(OnStale::Hold, Bad::Ignore);
    input.offer(doubted);
    let reading = input.read(2_000);
    let handed_on = Flags::UPSTREAM | Flags::FORCED;
    assert_eq!((reading.value, reading.ok, reading.flags), (9.0, true, handed_on));

    let mut input = freshness(OnStale::Hold, Bad::Stale);
    input.offer(sample(7.0, 1_000));
    assert!(input.offer(doubted), "it is not rejected");
    let reading = input.read(2_000);
    let flags = Flags::STALE | Flags::UPSTREAM;
    assert_eq!((reading.value, reading.ok, reading.flags), (7.0, false, flags));
    assert_eq!(input.state(), InputState::Doubted(doubted.flags));
    input.offer(Sample { flags: Flags::FORCED, ..sample(8.0, 3_000) });
    let reading = input.read(3_000);
    assert_eq!((reading.value, reading.ok, reading.flags), (8.0, true, Flags::FORCED));
}

#[test]
fn the_last_frame_of_a_sender_makes_the_input_stale_at_once() {
    let mut input = freshness(OnStale::Hold, Bad::Ignore);
    input.offer(Sample { flags: Flags::STOPPED, ..sample(7.0, 1_000) });
    let reading = input.read(1_000);
    assert_eq!((reading.value, reading.ok, reading.flags), (7.0, false, Flags::STALE));
    assert_eq!(input.state(), InputState::Stopped);
    input.offer(sample(8.0, 2_000));
    assert!(input.read(2_000).ok);
}

#[test]
fn a_ramp_goes_to_the_default_and_back_one_step_a_cycle() {
    // 50 a second in cycles of 10 ms: 0.5 a cycle.
    let mut input = freshness(OnStale::Ramp(50.0), Bad::Ignore);
    let mut now_ns = 1_000;
    input.offer(sample(1.75, now_ns));
    let mut run = |input: &mut Freshness, cycles: usize| -> Vec<(f64, Flags)> {
        let cycle = |_| {
            now_ns += PERIOD_NS;
            let reading = input.read(now_ns);
            (reading.value, reading.flags)
        };
        (0..cycles).map(cycle).collect()
    };
    let (none, substitute) = (Flags::NONE, Flags::SUBSTITUTE);
    let on_the_way = [(1.5, substitute), (1.75, none), (1.75, none)];
    assert_eq!(run(&mut input, 3), on_the_way, "the first sample is no step either");
    run(&mut input, 7);
    let stale = Flags::STALE | substitute;
    assert_eq!(run(&mut input, 3), [(1.25, stale), (1.0, stale), (1.0, stale)]);
    input.offer(sample(2.0, 1_000 + 13 * PERIOD_NS));
    assert_eq!(run(&mut input, 2), [(1.5, substitute), (2.0, none)]);
    input.offer(sample(9.0, 1_000 + 15 * PERIOD_NS));
    assert_eq!(run(&mut input, 1), [(9.0, none)], "a sample that it follows is no ramp");
}

fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("a number", |value| value.is_finite())
}

proptest! {
    #[test]
    fn a_ramp_never_overshoots_and_always_comes_nearer(
        from in finite(), to in finite(), step in 1e-300..1e300_f64,
    ) {
        let next = approach(from, to, step);
        let between = if from <= to { from..=to } else { to..=from };
        prop_assert!(between.contains(&next), "{next}");
        prop_assert!(next == to || next != from);
    }

    #[test]
    fn a_ramp_lands_exactly_on_its_target(
        from in -1e6..1e6_f64, to in -1e6..1e6_f64, cycles in 1..10_000_u32,
    ) {
        let step = (to - from).abs() / f64::from(cycles) + f64::MIN_POSITIVE;
        let mut at = from;
        // Rounding may need a step more.
        for _ in 0..=cycles {
            at = approach(at, to, step);
        }
        prop_assert_eq!(at.to_bits(), to.to_bits());
    }

    #[test]
    fn whatever_comes_the_age_is_never_negative_and_ok_says_what_the_flags_say(
        events in prop::collection::vec((0..3_u8, any::<f64>(), any::<u64>(), 0..128_u64), 1..60),
        times in prop::collection::vec(any::<u64>(), 60),
        (value_type, on_stale) in prop::sample::select(&[
            (PinType::Lreal, OnStale::Hold),
            (PinType::Lreal, OnStale::Ramp(3.0)),
            (PinType::Int, OnStale::Hold),
            (PinType::Int, OnStale::Default),
        ]),
        bad in prop::sample::select(&Bad::ALL),
    ) {
        let accepted = Accepted::all_of(value_type);
        let mut input = Freshness { accepted, ..freshness(on_stale, bad) };
        for ((what, value, sampled_ns, bits), now_ns) in events.into_iter().zip(times) {
            let flags = Flags::from_bits(bits);
            match what {
                0 => drop(input.offer(Sample { value, sampled_ns, source_ns: sampled_ns, flags })),
                1 => input.miss(flags, Missing::Layout),
                _ => {}
            }
            let reading = input.read(now_ns);
            prop_assert!(reading.age_s >= 0.0, "{reading:?}");
            prop_assert_eq!(reading.ok, input.state().is_ok());
            let own = Flags::STALE | Flags::REJECTED;
            if reading.ok {
                prop_assert!((reading.flags & own).is_empty(), "{:?}", reading);
            } else {
                prop_assert!(!(reading.flags & (own | Flags::SUBSTITUTE)).is_empty(), "{:?}", reading);
            }
            prop_assert!(value_type.holds(reading.value), "{:?}", reading);
        }
    }
}

#[test]
fn a_sample_out_of_range_is_rejected_and_the_bounds_themselves_are_not() {
    let range = Some((4.0, 20.0));
    let plan = InputPlan { range, ..plan(OnStale::Hold, Bad::Ignore) };
    let accepted = Accepted::of_service(&plan);
    let mut input = taking(accepted);
    for (value, is_taken) in
        [(4.0, true), (20.0, true), (20.000001, false), (3.9, false), (f64::NAN, false)]
    {
        assert_eq!(input.offer(sample(value, 1_000)), is_taken, "{value}");
        let reading = input.read(1_000);
        assert_eq!((reading.ok, reading.flags.contains(Flags::REJECTED)), (is_taken, !is_taken));
        assert!((4.0..=20.0).contains(&reading.value), "{value}");
    }
    assert_eq!(accepted.refusal(3.9), "which is out of its range from 4.0 to 20.0");
    assert_eq!(accepted.refusal(f64::INFINITY), "which is not finite");
}

#[test]
fn an_lreal_takes_nan_and_infinity_from_a_service_only_where_it_is_said_to() {
    let strict = plan(OnStale::Hold, Bad::Ignore);
    let lax = InputPlan { finite: false, ..strict.clone() };
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!taking(Accepted::of_service(&strict)).offer(sample(value, 1_000)));
        assert!(taking(Accepted::of_service(&lax)).offer(sample(value, 1_000)));
        assert!(taking(Accepted::all_of(PinType::Lreal)).offer(sample(value, 1_000)));
    }
}

#[test]
fn a_restored_input_is_stale_until_a_sample_comes_and_does_what_on_stale_says() {
    // A hundred a second: one a cycle.
    for (on_stale, first, second) in
        [(OnStale::Hold, 7.0, 7.0), (OnStale::Default, 1.0, 1.0), (OnStale::Ramp(100.0), 6.0, 5.0)]
    {
        let mut input = freshness(on_stale, Bad::Ignore);
        input.restore(7.0);
        for value in [first, second] {
            let reading = input.read(50);
            assert_eq!((reading.value, reading.ok, reading.age_s), (value, false, f64::INFINITY));
            assert!(reading.flags.contains(Flags::STALE) && reading.source_ns == 0);
            assert_eq!(input.state(), InputState::Restored);
        }
        assert!(input.awaits_sample());
        assert!(input.offer(sample(9.0, 60)) && !input.awaits_sample());
        assert!(input.read(60).ok);
    }
}

#[test]
fn a_restored_value_that_the_input_does_not_take_any_more_is_none() {
    let mut input = int();
    input.restore(7.5);
    assert_eq!((input.read(50).value, input.awaits_sample()), (1.0, false));
}

#[test]
fn a_sample_that_is_doubted_ends_the_wait_of_a_restored_input() {
    let mut input = freshness(OnStale::Hold, Bad::Stale);
    input.restore(7.0);
    input.offer(Sample { flags: Flags::RESTORED, ..sample(9.0, 60) });
    assert!(!input.awaits_sample() && !input.read(60).ok);
}
