use std::sync::Arc;

use isochrone_model::{Margin, Schedule, Wake};
use proptest::prelude::*;

use super::*;
use crate::cyclic::{Cyclic, Release, StopReason};
use crate::simulated::SimulatedClock;
use crate::wait::{Awake, WakeUps};

const EPOCH_NS: u64 = 1_000_000_000;
const PERIOD_NS: u64 = 1_000_000;
const WITHIN_NS: u64 = 300_000;
/// What a reading of the clock takes, and so a look at the port.
const LOOK_NS: u64 = 100;

/// A source by the instants at which it sends, and what its reader has taken.
struct Source {
    sends_ns: Vec<u64>,
    taken: usize,
    wake_ups: u64,
}

impl Source {
    fn sending(sends_ns: impl IntoIterator<Item = u64>) -> Self {
        Self { sends_ns: sends_ns.into_iter().collect(), taken: 0, wake_ups: 0 }
    }

    /// How many frames have been sent.
    fn sent(&self, now_ns: u64) -> usize {
        self.sends_ns.partition_point(|send_ns| *send_ns <= now_ns)
    }

    /// Reads the newest frame; returns how many that took out of the port.
    fn read(&mut self, now_ns: u64) -> usize {
        let sent = self.sent(now_ns);
        sent - std::mem::replace(&mut self.taken, sent)
    }
}

impl FollowedData for Source {
    fn awake(&mut self, _awake: Awake) {
        self.wake_ups += 1;
    }

    fn has_arrived(&mut self, look: Look) -> bool {
        let sent = self.sent(look.now_ns);
        sent > self.taken && self.sends_ns[sent - 1] > look.since_ns
    }
}

fn schedule() -> Schedule {
    Schedule { follow_within_ns: Some(WITHIN_NS), ..Schedule::every(PERIOD_NS, Wake::Sleep) }
}

fn clock() -> SimulatedClock {
    SimulatedClock::at(0).read_cost_ns(LOOK_NS)
}

fn following(clock: &SimulatedClock, schedule: Schedule) -> Cyclic<&SimulatedClock> {
    Cyclic::new(clock, schedule, EPOCH_NS, Arc::new(AtomicBool::new(false)))
}

/// How a cycle began, and how many frames it took out of the port.
struct Cycle {
    release: Release,
    frames: usize,
}

impl Cycle {
    fn begun(&self) -> CycleStart {
        self.release.follow.unwrap().begun
    }

    /// From the release to the start, to a look.
    fn waited_ns(&self) -> u64 {
        let waited_ns = self.release.start_ns - self.release.release_ns;
        waited_ns - waited_ns % (10 * LOOK_NS)
    }
}

/// Runs so many cycles, each of 10 us.
fn cycles(source: &mut Source, count: u64) -> Vec<Cycle> {
    let clock = clock();
    let mut cyclic = following(&clock, schedule());
    let mut cycle = |_| {
        let release = cyclic.wait_for_data(WakeUps::One, source).unwrap();
        let frames = source.read(release.start_ns);
        clock.advance_to(release.start_ns + 10_000);
        cyclic.finished(clock.now_ns());
        assert_eq!(cyclic.overruns(), 0);
        Cycle { release, frames }
    };
    (0..count).map(&mut cycle).collect()
}

/// Sends at `phase_ns` behind each release of the grid.
fn on_the_grid(phase_ns: u64, cycles: std::ops::Range<u64>) -> impl Iterator<Item = u64> {
    cycles.map(move |cycle| EPOCH_NS + cycle * PERIOD_NS + phase_ns)
}

fn waits_ns(cycles: &[Cycle]) -> Vec<u64> {
    cycles.iter().map(Cycle::waited_ns).collect()
}

#[test]
fn a_cycle_begins_with_the_frame_that_comes_after_its_release() {
    let cycles = cycles(&mut Source::sending(on_the_grid(120_000, 0..5)), 5);
    assert_eq!(waits_ns(&cycles), [120_000; 5]);
    for (k, cycle) in (0..).zip(&cycles) {
        assert_eq!((cycle.begun(), cycle.frames), (CycleStart::Followed, 1));
        assert_eq!(cycle.release.release_ns, EPOCH_NS + k * PERIOD_NS, "the grid stays");
        assert_eq!(cycle.release.follow.unwrap().ready_ns, cycle.release.release_ns);
    }
}

#[test]
fn a_frame_that_came_before_the_release_is_waited_for_no_longer_than_the_release() {
    let cycles = cycles(&mut Source::sending(on_the_grid(900_000, 0..6)), 6);
    // The first frame comes when the first cycle has given up.
    assert_eq!(cycles[0].begun(), CycleStart::TimedOut);
    for cycle in &cycles[1..] {
        assert_eq!((cycle.begun(), cycle.frames), (CycleStart::FoundReady, 1));
        assert_eq!(cycle.release.start_ns, cycle.release.release_ns, "it waited for nothing");
    }
}

#[test]
fn a_cycle_without_data_begins_when_its_time_is_up() {
    let cycles = cycles(&mut Source::sending([]), 4);
    assert_eq!(waits_ns(&cycles), [WITHIN_NS; 4]);
    let last = cycles[3].release.follow.unwrap();
    assert_eq!(last.counts, CycleStartCounts { timed_out: 4, ..CycleStartCounts::default() });
}

#[test]
fn a_faster_source_has_a_frame_ready_at_each_release_and_the_newest_is_taken() {
    let sends_ns = (0..20).map(|k| EPOCH_NS - 50_000 + k * PERIOD_NS / 4);
    let cycles = cycles(&mut Source::sending(sends_ns), 5);
    assert_eq!(waits_ns(&cycles), [0; 5]);
    assert_eq!(cycles[1..].iter().map(|cycle| cycle.frames).collect::<Vec<_>>(), [4; 4]);
}

#[test]
fn a_slower_source_leaves_cycles_to_begin_without_a_frame() {
    let sends_ns = (0..4).map(|k| EPOCH_NS + 2 * k * PERIOD_NS + 50_000);
    let cycles = cycles(&mut Source::sending(sends_ns), 6);
    assert_eq!(waits_ns(&cycles), [50_000, WITHIN_NS, 50_000, WITHIN_NS, 50_000, WITHIN_NS]);
    let last = cycles[5].release.follow.unwrap();
    assert_eq!(last.counts, CycleStartCounts { followed: 3, found_ready: 0, timed_out: 3 });
}

#[test]
fn a_source_with_jitter_is_followed_as_far_as_the_time_reaches() {
    let jitters_ns = [0, 290_000, 40_000, 310_000, 10_000];
    let sends_ns =
        jitters_ns.iter().zip(0..).map(|(jitter_ns, k)| EPOCH_NS + k * PERIOD_NS + jitter_ns);
    let cycles = cycles(&mut Source::sending(sends_ns), 6);
    // The fourth frame came too late for its cycle; the fifth cycle finds it at its release. Its own comes
    // after that, and is not what the sixth waits for.
    assert_eq!(waits_ns(&cycles), [0, 290_000, 40_000, WITHIN_NS, 0, WITHIN_NS]);
    assert_eq!(cycles.iter().map(|cycle| cycle.frames).sum::<usize>(), jitters_ns.len());
    let last = cycles[5].release.follow.unwrap();
    assert_eq!(last.counts, CycleStartCounts { followed: 2, found_ready: 2, timed_out: 2 });
}

#[test]
fn a_source_that_stops_leaves_the_grid_as_it_is() {
    let cycles = cycles(&mut Source::sending(on_the_grid(20_000, 0..3)), 6);
    assert_eq!(waits_ns(&cycles), [20_000, 20_000, 20_000, WITHIN_NS, WITHIN_NS, WITHIN_NS]);
    for (k, cycle) in (0..).zip(&cycles) {
        assert_eq!(cycle.release.release_ns, EPOCH_NS + k * PERIOD_NS);
        assert_eq!(cycle.release.missed, 0);
    }
}

#[test]
fn a_source_that_comes_back_on_another_phase_is_followed_there() {
    let sends_ns = on_the_grid(20_000, 0..3).chain(on_the_grid(250_000, 5..8));
    let cycles = cycles(&mut Source::sending(sends_ns), 8);
    let silence_ns = [WITHIN_NS; 2];
    assert_eq!(waits_ns(&cycles[..3]), [20_000; 3]);
    assert_eq!(waits_ns(&cycles[3..5]), silence_ns);
    assert_eq!(waits_ns(&cycles[5..]), [250_000; 3]);
}

#[test]
fn a_follower_that_comes_late_does_not_stay_a_frame_behind() {
    // The frame of the cycle before lies there at the first release.
    let mut source = Source::sending(on_the_grid(200_000, 0..6));
    let clock = SimulatedClock::at(EPOCH_NS + 500_000).read_cost_ns(LOOK_NS);
    let mut cyclic =
        Cyclic::new(&clock, schedule(), EPOCH_NS + PERIOD_NS, Arc::new(AtomicBool::new(false)));
    for _ in 0..5 {
        let release = cyclic.wait_for_data(WakeUps::One, &mut source).unwrap();
        source.read(release.start_ns);
        let cycle = Cycle { release, frames: 1 };
        assert_eq!((cycle.begun(), cycle.waited_ns()), (CycleStart::Followed, 200_000));
    }
}

#[test]
fn a_source_off_the_grid_drifts_through_it_without_a_frame_lost() {
    let sends_ns: Vec<u64> = (0..1_001).map(|k| EPOCH_NS + k * (PERIOD_NS + 1_000)).collect();
    let sent = sends_ns.len();
    let cycles = cycles(&mut Source::sending(sends_ns), 1_002);
    let timed_out = cycles.iter().filter(|cycle| cycle.begun() == CycleStart::TimedOut).count();
    assert_eq!(timed_out, 1, "one beat: a cycle more than frames");
    assert_eq!(cycles.iter().map(|cycle| cycle.frames).sum::<usize>(), sent);
    assert!(cycles.iter().all(|cycle| cycle.frames <= 1));
}

#[test]
fn two_tasks_that_follow_each_other_both_run_within_their_time() {
    let (first_clock, second_clock) = (clock(), clock());
    let mut first = following(&first_clock, schedule());
    let mut second = following(&second_clock, schedule());
    let (mut to_first, mut to_second) = (Source::sending([]), Source::sending([]));
    for k in 0..10 {
        let a = first.wait_for_data(WakeUps::One, &mut to_first).unwrap();
        to_first.read(a.start_ns);
        to_second.sends_ns.push(a.start_ns + 10_000);
        let b = second.wait_for_data(WakeUps::One, &mut to_second).unwrap();
        to_second.read(b.start_ns);
        to_first.sends_ns.push(b.start_ns + 10_000);
        for release in [a, b] {
            assert_eq!(release.release_ns, EPOCH_NS + k * PERIOD_NS);
            assert!(release.start_ns <= release.release_ns + WITHIN_NS + LOOK_NS);
        }
    }
}

#[test]
fn every_way_to_wait_for_the_release_goes_on_to_wait_for_data() {
    for (wake, sleeps) in
        [(Wake::Sleep, 1), (Wake::Hybrid(Margin::Fixed(80_000)), 1), (Wake::Spin, 0)]
    {
        let clock = SimulatedClock::at(EPOCH_NS - 500_000).read_cost_ns(LOOK_NS);
        let mut source = Source::sending([EPOCH_NS + 50_000]);
        let mut cyclic = following(&clock, Schedule { wake, ..schedule() });
        let release = cyclic.wait_for_data(WakeUps::One, &mut source).unwrap();
        let waited_ns = release.start_ns - EPOCH_NS;
        assert!((50_000..50_000 + 4 * LOOK_NS).contains(&waited_ns), "{wake:?}: {waited_ns}");
        assert_eq!(clock.sleeps(), sleeps, "{wake:?}: it watches for the data");
        assert_eq!(source.wake_ups, u64::from(matches!(wake, Wake::Hybrid(_))), "{wake:?}");
    }
}

#[test]
fn a_late_cycle_looks_once_and_begins_at_once() {
    let clock = SimulatedClock::at(EPOCH_NS + WITHIN_NS + 5_000);
    let mut cyclic = following(&clock, schedule());
    let mut source = Source::sending([EPOCH_NS + WITHIN_NS]);
    let late = cyclic.wait_for_data(WakeUps::One, &mut source).unwrap();
    assert_eq!(late.start_ns, EPOCH_NS + WITHIN_NS + 5_000);
    assert_eq!(late.follow.unwrap().begun, CycleStart::FoundReady);
}

#[test]
fn releases_that_pass_are_missed_as_without_data() {
    let clock = clock();
    let mut cyclic = following(&clock, schedule());
    let mut source = Source::sending(on_the_grid(50_000, 0..9));
    cyclic.wait_for_data(WakeUps::One, &mut source).unwrap();
    source.read(clock.now_ns());
    clock.advance_to(EPOCH_NS + 5 * PERIOD_NS + 10);
    let release = cyclic.wait_for_data(WakeUps::One, &mut source).unwrap();
    assert_eq!((release.cycle, release.newly_missed), (5, 4));
    let waited_ns = release.start_ns - release.release_ns;
    assert!(
        (50_000..50_000 + 4 * LOOK_NS).contains(&waited_ns),
        "it waits for its own: {waited_ns}"
    );
    assert_eq!(source.read(release.start_ns), 5, "those in between are passed over");
}

#[test]
fn a_stop_request_ends_the_wait_for_data() {
    const HOUR_NS: u64 = 3_600_000_000_000;
    let stop = Arc::new(AtomicBool::new(false));
    let requested_ns = EPOCH_NS + 1_234_567;
    let clock =
        SimulatedClock::at(EPOCH_NS).read_cost_ns(1_000).raises_at(requested_ns, Arc::clone(&stop));
    let follow_within_ns = Some(HOUR_NS / 2);
    let schedule = Schedule { follow_within_ns, ..Schedule::every(HOUR_NS, Wake::Sleep) };
    let mut cyclic = Cyclic::new(&clock, schedule, EPOCH_NS, stop);
    assert_eq!(cyclic.wait_for_data(WakeUps::One, &mut Source::sending([])), None);
    assert_eq!(cyclic.stop_reason(), Some(StopReason::Requested));
    assert!(clock.now_ns() - requested_ns <= 10_000);
}

proptest! {
    /// Whatever comes, the grid and its misses are those of a task that follows nothing, and a cycle
    /// begins with its data, or when its time is up.
    #[test]
    fn the_grid_does_not_depend_on_the_data(
        sends_ns in prop::collection::vec(0u64..40 * PERIOD_NS, 0..60),
        work_ns in prop::collection::vec(0u64..3 * PERIOD_NS / 2, 1..30),
        wake_latency_ns in 0u64..400_000,
    ) {
        let mut sends_ns: Vec<u64> = sends_ns.into_iter().map(|ns| EPOCH_NS + ns).collect();
        sends_ns.sort_unstable();
        let mut source = Source::sending(sends_ns);
        let clock = clock().wake_latency_ns(wake_latency_ns);
        let mut cyclic = following(&clock, schedule());
        for (ran, work_ns) in (0u64..).zip(work_ns) {
            let release = cyclic.wait_for_data(WakeUps::One, &mut source).unwrap();
            let follow = release.follow.unwrap();
            prop_assert_eq!(release.cycle, ran + release.missed);
            prop_assert_eq!(release.release_ns, EPOCH_NS + release.cycle * PERIOD_NS);
            prop_assert!(follow.ready_ns >= release.release_ns && release.start_ns >= follow.ready_ns);
            let latest_ns = follow.ready_ns.max(release.release_ns + WITHIN_NS);
            prop_assert!(release.start_ns <= latest_ns + 2 * LOOK_NS);
            let frames = source.read(release.start_ns);
            prop_assert!(frames > 0 || follow.begun == CycleStart::TimedOut);
            let CycleStartCounts { followed, found_ready, timed_out } = follow.counts;
            prop_assert_eq!(followed + found_ready + timed_out, ran + 1);
            clock.advance_to(release.start_ns + work_ns);
        }
    }

    /// Until the release, a task that follows waits exactly as one that does not.
    #[test]
    fn a_cycle_stands_ready_when_a_plain_one_would_begin(
        wake_latency_ns in 0u64..400_000,
        margin_ns in prop::option::of(1u64..500_000),
    ) {
        let wake = Wake::Hybrid(margin_ns.map_or(Margin::default(), Margin::Fixed));
        let (plain_clock, clock) = (clock().wake_latency_ns(wake_latency_ns), clock().wake_latency_ns(wake_latency_ns));
        let mut plain = following(&plain_clock, Schedule { wake, follow_within_ns: None, ..schedule() });
        let mut cyclic = following(&clock, Schedule { wake, ..schedule() });
        for _ in 0..10 {
            let expected = plain.wait().unwrap();
            let release = cyclic.wait_for_data(WakeUps::One, &mut Source::sending([])).unwrap();
            prop_assert_eq!(release.follow.unwrap().ready_ns, expected.start_ns);
            prop_assert_eq!(cyclic.margin_ns(), plain.margin_ns());
            // Both have the same slack.
            plain_clock.advance_to(clock.now_ns());
            clock.advance_to(plain_clock.now_ns());
            plain_clock.advance_to(clock.now_ns());
        }
    }
}
