use super::*;

const PERIOD_NS: u64 = 1_000_000;

/// Of a task whose frames came so long before each release; `None`: its cycle had none.
fn late_frames(ages_ns: impl IntoIterator<Item = Option<i64>>) -> Option<LateFrames> {
    late_frames_of(|cycle| cycle, ages_ns)
}

/// The same, where so many frames were sent until a cycle.
fn late_frames_of(
    sent: impl Fn(u64) -> u64,
    ages_ns: impl IntoIterator<Item = Option<i64>>,
) -> Option<LateFrames> {
    let mut arrivals = Arrivals::default();
    let mut timed_out = 0;
    for (age_ns, cycle) in ages_ns.into_iter().zip(0..) {
        timed_out += u64::from(age_ns.is_none());
        let release_ns = 7_000_000_000 + cycle * PERIOD_NS;
        let record = CycleRecord { cycle, release_ns, ..CycleRecord::default() };
        let frame_ns = age_ns.map(|age_ns| release_ns.wrapping_add_signed(-age_ns));
        let begun = CycleStartCounts { timed_out, ..CycleStartCounts::default() };
        let follow = FollowRecord { frame_ns, sent: sent(cycle), begun, ..FollowRecord::default() };
        arrivals.record(&record, &follow, PERIOD_NS);
    }
    match arrivals.punctuality(PERIOD_NS) {
        Punctuality::Late(late) => Some(late),
        _ => None,
    }
}

#[test]
fn frames_that_nearly_all_lie_there_with_an_old_age_at_the_release_are_late() {
    let ages = |age_ns| (0..100).map(move |_| Some(age_ns));
    let late = late_frames(ages(400_000)).unwrap();
    let (median_ns, age_ns, in_vain) = (600_000, 400_000, None);
    let expected = LateFrames { median_ns, p99_ns: median_ns, age_ns, in_vain };
    assert_eq!(late, expected);
    let jitters = (0..100).map(|n| Some(if n < 95 { 400_000 } else { 300_000 }));
    assert_eq!(late_frames(jitters).unwrap().p99_ns, 700_000);
    let mostly = (0..100).map(|n| Some(if n % 20 == 0 { -50_000 } else { 400_000 }));
    assert!(late_frames(mostly).is_some(), "most of them");
    let every_other = || (0..100).map(|n| (n % 2 == 0).then_some(400_000));
    let slower = late_frames_of(|cycle| cycle / 2, every_other()).unwrap();
    assert_eq!(slower.in_vain, None, "those there are");
}

#[test]
fn frames_for_which_cycles_time_out_are_late_whenever_they_come() {
    let in_vain = |ages: &mut dyn Iterator<Item = Option<i64>>| late_frames(ages)?.in_vain;
    let mut every_other = (0..100).map(|n| (n % 2 == 0).then_some(400_000));
    let expected = InVain { timed_out: 50, cycles: 99, scattered: false };
    assert_eq!(in_vain(&mut every_other), Some(expected));
    let mut scattered = (0..100).map(|n| (n % 2 == 0).then_some(300_000 + n * 4_000));
    assert!(in_vain(&mut scattered).unwrap().scattered, "at any time");
    let mut some =
        (0..100).map(|n| (n % 8 > 0).then_some(if n % 8 == 1 { 600_000 } else { -50_000 }));
    let some = in_vain(&mut some).unwrap();
    assert_eq!((some.timed_out, some.cycles), (12, 99));
    let ends = (0..100).map(|n| (n < 50).then_some(400_000));
    assert_eq!(late_frames_of(|cycle| 10 * cycle.min(50), ends), None, "a faster source has ended");
    let mut few = (0..100).map(|n| (n % 15 > 0).then_some(-50_000));
    assert_eq!(in_vain(&mut few), None);
}

#[test]
fn frames_that_are_young_or_come_in_time_are_not_late() {
    let ages = |age_ns| (0..100).map(move |_| Some(age_ns));
    assert_eq!(late_frames(ages(90_000)), None, "they hardly wait");
    assert_eq!(late_frames(ages(-90_000)), None, "they are waited for");
    let drifts = (0..100).map(|n| Some(10_000 * n - 300_000));
    assert_eq!(late_frames(drifts), None, "the source drifts through the grid");
    assert_eq!(late_frames([None; 100]), None, "none came");
    assert_eq!(late_frames(ages(400_000).take(5)), None, "too few to judge");
    let sent_hz = |hz: u64| late_frames_of(move |cycle| 7 + cycle * hz / 1000, ages(400_000));
    assert!(sent_hz(1_010).is_some());
    assert_eq!(sent_hz(1_100), None, "the newest frame of a faster source is not late");
    let slower = (0..100).map(|n| (n % 5 < 4).then_some(n % 20 * 47_500));
    let slower = late_frames_of(|cycle| cycle * 4 / 5, slower);
    assert_eq!(slower, None, "a source of another period drifts, too");
}

#[test]
fn the_sum_of_stretches_is_what_one_long_stretch_would_be() {
    let [mut whole, mut sum, mut stretch] = [(); 3].map(|()| Arrivals::default());
    for cycle in 0..200_u64 {
        let release_ns = 7_000_000_000 + cycle * PERIOD_NS;
        let record = CycleRecord { cycle, release_ns, ..CycleRecord::default() };
        let frame_ns = (cycle % 3 > 0).then(|| release_ns - 400_000);
        let begun = CycleStartCounts { timed_out: cycle / 3 + 1, ..CycleStartCounts::default() };
        let follow = FollowRecord { frame_ns, sent: cycle, begun, ..FollowRecord::default() };
        whole.record(&record, &follow, PERIOD_NS);
        stretch.record(&record, &follow, PERIOD_NS);
        if cycle % 70 == 69 {
            sum.add(&stretch);
            stretch.clear();
        }
    }
    sum.add(&stretch);
    assert!(matches!(whole.punctuality(PERIOD_NS), Punctuality::Late(_)));
    assert_eq!(sum.punctuality(PERIOD_NS), whole.punctuality(PERIOD_NS));
}
