use std::sync::atomic::Ordering;

use isochrone_model::{Margin, Wake};
use proptest::prelude::*;

use super::*;
use crate::clock::Monotonic;
use crate::simulated::SimulatedClock;

const EPOCH_NS: u64 = 1_000_000_000;
const PERIOD_NS: u64 = 1_000_000;

fn schedule(overrun: Overrun) -> Schedule {
    Schedule { overrun, ..Schedule::every(PERIOD_NS, Wake::Sleep) }
}

fn cyclic(clock: &SimulatedClock, schedule: Schedule) -> Cyclic<&SimulatedClock> {
    Cyclic::new(clock, schedule, EPOCH_NS, Arc::new(AtomicBool::new(false)))
}

/// Runs cycle 0, stalls until `late_ns` after cycle 1 was due, and returns what runs next.
fn after_stall(overrun: Overrun, late_ns: u64) -> Option<Release> {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(overrun));
    cyclic.wait();
    clock.advance_to(EPOCH_NS + PERIOD_NS + late_ns);
    cyclic.wait()
}

#[test]
fn a_million_late_wake_ups_do_not_move_the_grid() {
    let clock = SimulatedClock::at(0).wake_latency_ns(70_001);
    let mut cyclic = cyclic(&clock, schedule(Overrun::Skip));
    for cycle in 0..1_000_000 {
        let release = cyclic.wait().unwrap();
        assert_eq!(release.cycle, cycle);
        assert_eq!(release.release_ns, EPOCH_NS + cycle * PERIOD_NS);
        assert_eq!(release.start_ns, release.release_ns + 70_001);
        assert_eq!(release.missed, 0);
    }
}

#[test]
fn a_cycle_late_by_less_than_a_period_misses_nothing() {
    for late_ns in [0, 1, PERIOD_NS - 1] {
        let release = after_stall(Overrun::Skip, late_ns).unwrap();
        assert_eq!((release.cycle, release.newly_missed), (1, 0), "late by {late_ns} ns");
        assert_eq!(release.start_ns - release.release_ns, late_ns);
    }
}

#[test]
fn whole_periods_late_are_skipped_and_counted() {
    for (late_ns, missed) in [
        (PERIOD_NS, 1),
        (PERIOD_NS + 1, 1),
        (2 * PERIOD_NS - 1, 1),
        (2 * PERIOD_NS, 2),
        (50 * PERIOD_NS, 50),
    ] {
        let release = after_stall(Overrun::Skip, late_ns).unwrap();
        assert_eq!(release.newly_missed, missed, "late by {late_ns} ns");
        assert_eq!(release.missed, missed);
        assert_eq!(release.cycle, 1 + missed);
        assert_eq!(release.release_ns, EPOCH_NS + (1 + missed) * PERIOD_NS);
        assert_eq!(release.start_ns - release.release_ns, late_ns % PERIOD_NS);
    }
}

#[test]
fn catching_up_runs_a_short_backlog_without_missing_any() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(Overrun::CatchUp));
    clock.advance_to(EPOCH_NS + 3 * PERIOD_NS + 10);
    let starts: Vec<_> = (0..5).map(|_| cyclic.wait().unwrap()).collect();
    let cycles: Vec<_> = starts.iter().map(|r| r.cycle).collect();
    assert_eq!(cycles, [0, 1, 2, 3, 4]);
    assert!(starts[..4].iter().all(|r| r.start_ns == EPOCH_NS + 3 * PERIOD_NS + 10));
    assert_eq!(starts[4].start_ns, EPOCH_NS + 4 * PERIOD_NS);
    assert_eq!(cyclic.missed(), 0);
}

#[test]
fn catching_up_runs_at_most_eight_late_cycles_in_a_row_and_then_skips() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(Overrun::CatchUp));
    clock.advance_to(EPOCH_NS + 50 * PERIOD_NS);
    let releases: Vec<_> = (0..10).map(|_| cyclic.wait().unwrap()).collect();
    let cycles: Vec<_> = releases.iter().map(|r| r.cycle).collect();
    assert_eq!(cycles, [0, 1, 2, 3, 4, 5, 6, 7, 50, 51]);
    assert_eq!(releases[8].newly_missed, 42);
    assert_eq!(cyclic.missed(), 42);
}

#[test]
fn a_punctual_cycle_allows_another_eight_late_ones() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(Overrun::CatchUp));
    for punctual in [8, 17, 26] {
        clock.advance_to(EPOCH_NS + punctual * PERIOD_NS);
        while cyclic.wait().unwrap().cycle < punctual {}
    }
    assert_eq!(cyclic.missed(), 0);
}

#[test]
fn the_stop_policy_ends_the_loop_after_the_cycle_that_missed_a_release() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(Overrun::Stop));
    assert!(cyclic.wait().is_some());
    clock.advance_to(EPOCH_NS + 2 * PERIOD_NS);
    let last = cyclic.wait().unwrap();
    assert_eq!((last.cycle, last.newly_missed), (2, 1), "the last frame tells of the miss");
    assert_eq!(cyclic.wait(), None);
    assert_eq!(cyclic.stop_reason(), Some(StopReason::Overrun));
    assert_eq!(cyclic.missed(), 1);
    assert_eq!(cyclic.wait(), None, "an ended loop stays ended");
}

#[test]
fn the_stop_policy_ends_the_loop_after_a_cycle_that_overran() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(Overrun::Stop));
    let release = cyclic.wait().unwrap();
    cyclic.finished(release.release_ns + PERIOD_NS + 1);
    assert_eq!(cyclic.wait(), None);
    assert_eq!(clock.now_ns(), release.start_ns, "it did not wait first");
    assert_eq!(cyclic.stop_reason(), Some(StopReason::Overrun));
}

/// A loop that stalls by `stalls[k]` periods before its cycle k; how many cycles ran.
fn cycles_until_limit(misses: u32, cycles: u64, stalls: &[u64]) -> Option<usize> {
    let clock = SimulatedClock::at(0);
    let limit = Some(MissLimit { misses, cycles });
    let mut cyclic = cyclic(&clock, Schedule { limit, ..schedule(Overrun::Skip) });
    for (ran, stall) in stalls.iter().enumerate() {
        let due_ns = EPOCH_NS + (ran as u64 + cyclic.missed()) * PERIOD_NS;
        clock.advance_to(due_ns + stall * PERIOD_NS);
        if cyclic.wait().is_none() {
            assert_eq!(cyclic.stop_reason(), Some(StopReason::Overrun));
            return Some(ran);
        }
    }
    None
}

#[test]
fn a_limit_ends_the_loop_after_the_cycle_that_reaches_it() {
    assert_eq!(cycles_until_limit(3, 10, &[0, 1, 0, 1, 1, 0]), Some(5));
    assert_eq!(cycles_until_limit(3, 10, &[0, 3, 0]), Some(2), "three at once");
    assert_eq!(cycles_until_limit(3, 10, &[0, 500, 0]), Some(2), "more than it counts");
    assert_eq!(cycles_until_limit(1, 1, &[0, 0, 1, 0]), Some(3));
}

#[test]
fn misses_that_lie_further_apart_than_the_limit_says_pass() {
    let rare = [0, 1, 0, 0, 0, 0].repeat(5);
    assert_eq!(cycles_until_limit(2, 5, &rare), None);
    assert_eq!(cycles_until_limit(2, 8, &rare), Some(8), "the second miss is the seventh later");
}

#[test]
fn the_stop_policy_lets_a_late_wake_up_pass_that_missed_nothing() {
    assert!(after_stall(Overrun::Stop, PERIOD_NS - 1).is_some());
}

#[test]
fn a_cycle_overruns_when_it_ends_after_the_next_release() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, schedule(Overrun::Skip));
    let release = cyclic.wait().unwrap();
    cyclic.finished(release.release_ns + PERIOD_NS);
    assert_eq!(cyclic.overruns(), 0);
    cyclic.finished(release.release_ns + PERIOD_NS + 1);
    assert_eq!(cyclic.overruns(), 1);
    assert!(cyclic.wait().is_some());
}

#[test]
fn a_stop_request_ends_the_loop() {
    let clock = SimulatedClock::at(0);
    let stop = Arc::new(AtomicBool::new(false));
    let mut cyclic = Cyclic::new(&clock, schedule(Overrun::Skip), EPOCH_NS, Arc::clone(&stop));
    assert!(cyclic.wait().is_some());
    assert_eq!(cyclic.stop_reason(), None);
    stop.store(true, Ordering::Relaxed);
    assert_eq!(cyclic.wait(), None);
    assert_eq!(cyclic.stop_reason(), Some(StopReason::Requested));
}

#[test]
fn the_phase_shifts_every_release() {
    let clock = SimulatedClock::at(0);
    let mut cyclic = cyclic(&clock, Schedule { phase_ns: 250_000, ..schedule(Overrun::Skip) });
    for cycle in 0..3 {
        assert_eq!(cyclic.wait().unwrap().release_ns, EPOCH_NS + 250_000 + cycle * PERIOD_NS);
    }
}

#[test]
fn two_tasks_with_one_epoch_share_the_grid() {
    let fast_clock = SimulatedClock::at(0).wake_latency_ns(11_000);
    let slow_clock = SimulatedClock::at(0).wake_latency_ns(97_000);
    let mut fast = cyclic(&fast_clock, schedule(Overrun::Skip));
    let slow_schedule = Schedule { period_ns: 10 * PERIOD_NS, ..schedule(Overrun::Skip) };
    let mut slow = cyclic(&slow_clock, slow_schedule);
    for cycle in 0..1000 {
        let fast = fast.wait().unwrap();
        if cycle % 10 == 0 {
            assert_eq!(slow.wait().unwrap().release_ns, fast.release_ns);
        }
    }
}

#[test]
fn an_epoch_in_the_distant_past_counts_every_lost_release_exactly() {
    let lost = 1_000_000_000_000;
    let clock = SimulatedClock::at(lost * 10_000 + 3);
    let schedule = Schedule { period_ns: 10_000, ..schedule(Overrun::Skip) };
    let stop = Arc::new(AtomicBool::new(false));
    let release = Cyclic::new(&clock, schedule, 0, stop).wait().unwrap();
    assert_eq!(release.cycle, lost);
    assert_eq!(release.missed, lost);
    assert_eq!(release.start_ns - release.release_ns, 3);
}

#[test]
fn a_due_time_beyond_the_clock_is_waited_for_until_a_stop_request() {
    let stop = Arc::new(AtomicBool::new(false));
    let clock = SimulatedClock::at(u64::MAX - 2_000_000_000)
        .raises_at(u64::MAX - 1_000_000_000, Arc::clone(&stop));
    let schedule = Schedule { period_ns: u64::MAX, ..schedule(Overrun::Skip) };
    let mut cyclic = Cyclic::new(&clock, schedule, EPOCH_NS, stop);
    assert_eq!(cyclic.wait().map(|release| release.cycle), Some(0));
    assert_eq!(cyclic.wait(), None);
    assert_eq!(cyclic.stop_reason(), Some(StopReason::Requested));
}

#[test]
fn a_period_of_zero_counts_as_one_nanosecond() {
    let clock = SimulatedClock::at(EPOCH_NS + 5);
    let release = cyclic(&clock, Schedule { period_ns: 0, ..schedule(Overrun::Skip) }).wait();
    assert_eq!(release.unwrap().missed, 5);
}

#[test]
fn real_cycles_start_on_the_grid_and_never_early() {
    for wake in [Wake::Sleep, Wake::Hybrid(Margin::default()), Wake::Spin] {
        let epoch_ns = Monotonic.now_ns() + PERIOD_NS;
        let stop = Arc::new(AtomicBool::new(false));
        let schedule = Schedule { wake, ..schedule(Overrun::Skip) };
        let mut cyclic = Cyclic::new(Monotonic, schedule, epoch_ns, stop);
        for _ in 0..5 {
            let release = cyclic.wait().unwrap();
            assert_eq!(release.release_ns, epoch_ns + release.cycle * PERIOD_NS);
            assert!(release.start_ns >= release.release_ns);
            cyclic.finished(Monotonic.now_ns());
        }
    }
}

proptest! {
    /// However long cycles take: ran + missed is the whole grid up to here, and skipping leaves
    /// every cycle late by less than a period.
    #[test]
    fn every_release_either_ran_or_was_missed(
        work_ns in prop::collection::vec(0u64..10 * PERIOD_NS, 1..100),
        catch_up in any::<bool>(),
    ) {
        let clock = SimulatedClock::at(0).wake_latency_ns(20_000);
        let overrun = if catch_up { Overrun::CatchUp } else { Overrun::Skip };
        let mut cyclic = cyclic(&clock, schedule(overrun));
        for (ran, work_ns) in (0u64..).zip(work_ns) {
            let release = cyclic.wait().unwrap();
            prop_assert_eq!(release.cycle, ran + release.missed);
            prop_assert_eq!(release.release_ns, EPOCH_NS + release.cycle * PERIOD_NS);
            prop_assert!(catch_up || release.start_ns - release.release_ns < PERIOD_NS);
            clock.advance_to(release.start_ns + work_ns);
        }
    }
}

#[test]
fn a_loop_that_stands_by_keeps_the_grid_and_misses_nothing() {
    let clock = SimulatedClock::at(0).wake_latency_ns(60_000);
    let schedule = Schedule { overrun: Overrun::Stop, ..Schedule::every(1_000_000, Wake::Sleep) };
    let mut cyclic = Cyclic::new(&clock, schedule, 5_000_000, Arc::default());
    let behind = cyclic.wait_behind(200_000, |_| ()).unwrap();
    assert_eq!((behind.cycle, behind.release_ns, behind.start_ns), (0, 5_000_000, 5_260_000));
    clock.advance_to(9_500_000);
    let late = cyclic.wait_behind(200_000, |_| ()).unwrap();
    assert_eq!((late.cycle, late.release_ns), (4, 9_000_000));
    assert_eq!((late.newly_missed, late.missed), (3, 0));
    cyclic.take_over(7);
    let next = cyclic.wait().unwrap();
    assert_eq!((next.cycle, next.release_ns, next.missed), (5, 10_000_000, 7));
}

#[test]
fn a_loop_that_was_stopped_while_it_ran_the_cycles_stands_by_and_does_not_end() {
    let clock = SimulatedClock::at(0);
    let schedule = Schedule { overrun: Overrun::Stop, ..Schedule::every(1_000_000, Wake::Sleep) };
    let mut cyclic = Cyclic::new(&clock, schedule, 5_000_000, Arc::default());
    assert!(cyclic.wait().is_some());
    clock.advance_to(60_000_000);
    assert!(cyclic.wait().is_some());
    assert_eq!(cyclic.stop_reason(), Some(StopReason::Overrun));
    assert!(cyclic.wait_behind(0, |_| ()).is_some());
    assert_eq!(cyclic.stop_reason(), None);
}
