//! Every way of waiting for a deadline.

use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_model::{Margin, Wake};

use crate::clock::Clock;
use crate::margin::AdaptiveMargin;

/// Longest single sleep, so that a task with a period of an hour still notices a stop request.
const SLICE_NS: u64 = 200_000_000;

/// How long before its margin a hybrid wait of two wake-ups is awake for the first time: longer than a
/// port needs to connect.
const EARLY_NS: u64 = 400_000;

/// Where a wait has less than this left, it tells nobody that it is midway: what is done then takes far
/// less.
const MIDWAY_LEFT_NS: u64 = 10_000_000;

/// At which of its wake-ups before the release a wait is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Awake {
    /// In a wait of more than 200 ms, which looks every 200 ms whether it shall stop: at least 10 ms are left.
    Midway,
    /// In a hybrid wait, its margin before the release, or 400 us before that.
    Ahead,
}

/// How often a hybrid wait is awake before the release.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WakeUps {
    /// A margin before the release.
    One,
    /// Also 400 us before that, if there is time; it then sleeps on.
    Two,
}

/// Waits for deadlines in one of the ways of [`Wake`].
#[derive(Debug)]
pub(crate) enum Waiter {
    Sleep,
    HybridFixed { margin_ns: u64 },
    HybridAdaptive { margin: AdaptiveMargin },
    Spin,
}

impl Waiter {
    pub(crate) fn new(wake: Wake, period_ns: u64) -> Self {
        match wake {
            Wake::Sleep => Self::Sleep,
            Wake::Hybrid(Margin::Fixed(margin_ns)) => Self::HybridFixed { margin_ns },
            Wake::Hybrid(Margin::Adaptive { cpu_budget }) => {
                Self::HybridAdaptive { margin: AdaptiveMargin::new(period_ns, cpu_budget) }
            }
            Wake::Spin => Self::Spin,
        }
    }

    /// Returns the first clock reading at or after `deadline_ns`, or `None` once `stop` is set.
    ///
    /// Calls `awake` at its wake-ups, the last of which is, in a hybrid wait, just before it spins.
    pub(crate) fn wait_until<C: Clock>(
        &mut self,
        clock: &C,
        deadline_ns: u64,
        stop: &AtomicBool,
        wake_ups: WakeUps,
        mut awake: impl FnMut(Awake),
    ) -> Option<u64> {
        let sleep = |until_ns, awake: &mut _| sleep(clock, until_ns, stop, awake);
        let Some(margin_ns) = self.margin_ns() else {
            return match self {
                Self::Spin => spin(clock, deadline_ns, stop),
                _ => sleep(deadline_ns, &mut awake),
            };
        };
        let wake_ns = deadline_ns.saturating_sub(margin_ns);
        let early_ns = wake_ns.saturating_sub(EARLY_NS);
        if wake_ups == WakeUps::Two && clock.now_ns() < early_ns {
            sleep(early_ns, &mut awake)?;
            awake(Awake::Ahead);
        }
        // Without a sleep there is no wake-up latency to learn from.
        if clock.now_ns() < wake_ns {
            let woken_ns = sleep(wake_ns, &mut awake)?;
            if let Self::HybridAdaptive { margin } = self {
                margin.observe(woken_ns.saturating_sub(wake_ns));
            }
            awake(Awake::Ahead);
        }
        spin(clock, deadline_ns, stop)
    }

    /// The margin of a hybrid wait, in ns.
    pub(crate) fn margin_ns(&self) -> Option<u64> {
        match self {
            Self::Sleep | Self::Spin => None,
            Self::HybridFixed { margin_ns } => Some(*margin_ns),
            Self::HybridAdaptive { margin } => Some(margin.ns()),
        }
    }
}

fn sleep<C: Clock>(
    clock: &C,
    deadline_ns: u64,
    stop: &AtomicBool,
    awake: &mut impl FnMut(Awake),
) -> Option<u64> {
    loop {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let now_ns = clock.now_ns();
        if now_ns >= deadline_ns {
            return Some(now_ns);
        }
        let woken_ns = deadline_ns.min(now_ns.saturating_add(SLICE_NS));
        clock.sleep_until_ns(woken_ns);
        if woken_ns < deadline_ns && clock.now_ns().saturating_add(MIDWAY_LEFT_NS) <= deadline_ns {
            awake(Awake::Midway);
        }
    }
}

/// Bare clock reads: a PAUSE would be longer than the reading and only coarsen the result.
fn spin<C: Clock>(clock: &C, deadline_ns: u64, stop: &AtomicBool) -> Option<u64> {
    loop {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let now_ns = clock.now_ns();
        if now_ns >= deadline_ns {
            return Some(now_ns);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::simulated::SimulatedClock;

    const PERIOD_NS: u64 = 1_000_000;

    /// Waits, awake once before the deadline, with nobody to stop it.
    fn wait(waiter: &mut Waiter, clock: &SimulatedClock, deadline_ns: u64) -> Option<u64> {
        waiter.wait_until(clock, deadline_ns, &AtomicBool::new(false), WakeUps::One, |_| ())
    }

    fn wait_once(wake: Wake, clock: &SimulatedClock, deadline_ns: u64) -> Option<u64> {
        wait(&mut Waiter::new(wake, PERIOD_NS), clock, deadline_ns)
    }

    #[test]
    fn a_sleeping_wait_is_late_by_the_wake_up_latency() {
        let clock = SimulatedClock::at(0).wake_latency_ns(60_000);
        assert_eq!(wait_once(Wake::Sleep, &clock, 500_000), Some(560_000));
    }

    #[test]
    fn a_hybrid_wait_hides_a_wake_up_latency_shorter_than_its_margin() {
        let clock = SimulatedClock::at(0).wake_latency_ns(60_000).read_cost_ns(40);
        let start_ns = wait_once(Wake::Hybrid(Margin::Fixed(100_000)), &clock, 500_000);
        assert!(start_ns.is_some_and(|t| (500_000..500_040).contains(&t)), "{start_ns:?}");
    }

    #[test]
    fn an_adaptive_hybrid_wait_learns_to_hide_the_latency_it_saw() {
        let clock = SimulatedClock::at(0).wake_latency_ns(120_000).read_cost_ns(40);
        let mut waiter = Waiter::new(Wake::Hybrid(Margin::default()), PERIOD_NS);
        let first = wait(&mut waiter, &clock, PERIOD_NS).unwrap();
        let second = wait(&mut waiter, &clock, 2 * PERIOD_NS).unwrap();
        assert!(first - PERIOD_NS > 50_000, "the first margin is too short: {first}");
        assert!(second - 2 * PERIOD_NS <= 40, "the second is not: {second}");
    }

    #[test]
    fn an_adaptive_margin_learns_nothing_from_a_wait_that_did_not_sleep() {
        let clock = SimulatedClock::at(10_000_000);
        let mut waiter = Waiter::new(Wake::Hybrid(Margin::default()), PERIOD_NS);
        let before = waiter.margin_ns();
        wait(&mut waiter, &clock, 9_900_000);
        assert_eq!(waiter.margin_ns(), before);
    }

    #[test]
    fn a_hybrid_wait_tells_that_it_is_awake_before_the_deadline_and_only_after_a_sleep() {
        for wake in [Wake::Hybrid(Margin::default()), Wake::Hybrid(Margin::Fixed(100_000))] {
            let clock = SimulatedClock::at(0).wake_latency_ns(7_000).read_cost_ns(40);
            let mut woken_ns = Vec::new();
            let (mut waiter, stop) = (Waiter::new(wake, PERIOD_NS), AtomicBool::new(false));
            for deadline_ns in [PERIOD_NS, PERIOD_NS + 1_000] {
                let awake = |_| woken_ns.push(clock.now_ns());
                waiter.wait_until(&clock, deadline_ns, &stop, WakeUps::One, awake);
            }
            assert!(matches!(woken_ns[..], [ns] if ns < PERIOD_NS), "{wake:?}: {woken_ns:?}");
        }
    }

    #[test]
    fn a_hybrid_wait_that_shall_be_early_is_awake_twice_if_there_is_time() {
        for (wait_ns, times) in [(PERIOD_NS, 2), (300_000, 1), (50_000, 0)] {
            let clock = SimulatedClock::at(7_000_000).read_cost_ns(40);
            let mut woken_ns = Vec::new();
            let deadline_ns = 7_000_000 + wait_ns;
            let awake = |_| woken_ns.push(clock.now_ns());
            let mut waiter = Waiter::new(Wake::Hybrid(Margin::Fixed(100_000)), PERIOD_NS);
            waiter.wait_until(&clock, deadline_ns, &AtomicBool::new(false), WakeUps::Two, awake);
            assert_eq!(woken_ns.len(), times, "{woken_ns:?}");
            assert!(woken_ns.iter().all(|ns| *ns < deadline_ns));
        }
    }

    #[test]
    fn a_spinning_wait_never_sleeps() {
        let clock = SimulatedClock::at(0).read_cost_ns(40);
        assert_eq!(wait_once(Wake::Spin, &clock, 4_000), Some(4_000));
        assert_eq!(clock.sleeps(), 0);
    }

    #[test]
    fn a_deadline_in_the_past_returns_without_sleeping() {
        for wake in [Wake::Sleep, Wake::Hybrid(Margin::default()), Wake::Spin] {
            let clock = SimulatedClock::at(7_000);
            assert_eq!(wait_once(wake, &clock, 6_000), Some(7_000), "{}", wake.as_str());
            assert_eq!(clock.sleeps(), 0);
        }
    }

    #[test]
    fn a_stop_request_ends_a_wait_of_an_hour_within_200_ms() {
        const HOUR_NS: u64 = 3_600_000_000_000;
        for wake in [Wake::Sleep, Wake::Hybrid(Margin::default()), Wake::Spin] {
            let stop = Arc::new(AtomicBool::new(false));
            let requested_ns = 1_234_567_890;
            let clock = SimulatedClock::at(0)
                .read_cost_ns(1_000)
                .raises_at(requested_ns, Arc::clone(&stop));
            assert_eq!(
                Waiter::new(wake, HOUR_NS).wait_until(&clock, HOUR_NS, &stop, WakeUps::One, |_| ()),
                None
            );
            assert!(clock.now_ns() - requested_ns <= 200_000_000 + 10_000, "{}", wake.as_str());
        }
    }

    #[test]
    fn a_wait_of_up_to_200_ms_is_one_sleep() {
        let clock = SimulatedClock::at(0);
        wait_once(Wake::Sleep, &clock, 200_000_000);
        assert_eq!(clock.sleeps(), 1);
    }

    #[test]
    fn a_wait_of_seconds_tells_every_200_ms_that_it_is_midway_but_not_just_before_its_end() {
        for wake in [Wake::Sleep, Wake::Hybrid(Margin::Fixed(100_000))] {
            let clock = SimulatedClock::at(0).wake_latency_ns(7_000).read_cost_ns(40);
            let mut midway_ns = Vec::new();
            let awake = |at| {
                if at == Awake::Midway {
                    midway_ns.push(clock.now_ns());
                }
            };
            let (deadline_ns, stop) = (1_005_000_000, AtomicBool::new(false));
            let mut waiter = Waiter::new(wake, PERIOD_NS);
            waiter.wait_until(&clock, deadline_ns, &stop, WakeUps::One, awake);
            let times: Vec<u64> = midway_ns.iter().map(|ns| ns / 1_000_000).collect();
            assert_eq!(times, [200, 400, 600, 800], "{}", wake.as_str());
        }
    }

    proptest! {
        #[test]
        fn no_wait_returns_before_its_deadline(
            wait_ns in 0u64..2_000_000,
            margin_ns in prop::option::of(0u64..3_000_000),
            latency_ns in 0u64..400_000,
        ) {
            for wake in [Wake::Sleep, Wake::Hybrid(margin_ns.map_or(Margin::default(), Margin::Fixed)), Wake::Spin] {
                let clock = SimulatedClock::at(5_000_000).wake_latency_ns(latency_ns).read_cost_ns(37);
                let deadline_ns = 5_000_000 + wait_ns;
                prop_assert!(wait_once(wake, &clock, deadline_ns).is_some_and(|t| t >= deadline_ns));
            }
        }
    }
}
