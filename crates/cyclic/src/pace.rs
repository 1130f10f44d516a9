//! The grid of all nodes, for programs that are none.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use isochrone_model::{Schedule, Wake, epoch_after_ns};

use crate::clock::{Clock, Monotonic};
use crate::cyclic::{Cyclic, Release};
use crate::prompt::PromptWakeUps;

/// Waits on the grid on which the nodes of this machine release their tasks.
///
/// Release `n` is due at `k * 20 ms + 0.5 ms + phase + n * period` on `CLOCK_MONOTONIC`; *k* is such that the grid begins
/// after the first wait. If the period divides 20 ms, a frame that is sent after each wait has the same distance from the
/// releases of its readers at every start of either program. Releases that are over are left out and counted.
///
/// It sleeps, as its thread's scheduler lets it, and stays in its thread.
///
/// ```
/// use std::time::Duration;
/// use isochrone_cyclic::Pace;
///
/// let mut pace = Pace::new(Duration::from_millis(5), Duration::from_micros(150));
/// let first = pace.wait().unwrap();
/// let second = pace.wait().unwrap();
/// assert_eq!(first.release_ns % 5_000_000, 650_000);
/// assert_eq!(second.release_ns - first.release_ns, (second.cycle - first.cycle) * 5_000_000);
/// ```
#[derive(Debug)]
pub struct Pace<C: Clock = Monotonic> {
    clock: C,
    schedule: Schedule,
    stop: Arc<AtomicBool>,
    /// Since the first wait.
    running: Option<(Cyclic<C>, PromptWakeUps)>,
}

impl Pace {
    /// Releases every `period`, so long after those of tasks without a phase.
    pub fn new(period: Duration, phase: Duration) -> Self {
        Self::by_clock(Monotonic, period, phase)
    }
}

impl<C: Clock + Clone> Pace<C> {
    /// As [`new`](Pace::new), by another clock.
    pub fn by_clock(clock: C, period: Duration, phase: Duration) -> Self {
        let schedule = Schedule { phase_ns: ns(phase), ..Schedule::every(ns(period), Wake::Sleep) };
        Self { clock, schedule, stop: Arc::default(), running: None }
    }

    /// Ends the waits once the flag is set, for example by a signal handler.
    #[must_use]
    pub fn stopped_by(self, stop: Arc<AtomicBool>) -> Self {
        Self { stop, ..self }
    }

    /// Waits for the next release; `None` at most 200 ms after the flag was [set](Self::stopped_by).
    pub fn wait(&mut self) -> Option<Release> {
        let Self { clock, schedule, stop, running } = self;
        let (cyclic, _) = running.get_or_insert_with(|| {
            let epoch_ns = epoch_after_ns(clock.now_ns());
            let cyclic = Cyclic::new(clock.clone(), *schedule, epoch_ns, Arc::clone(stop));
            (cyclic, PromptWakeUps::in_this_thread())
        });
        cyclic.wait()
    }
}

/// Longer ones have no place on the clock.
fn ns(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;
    use crate::simulated::SimulatedClock;

    const US: u64 = 1_000;
    const MS: u64 = 1_000_000;

    fn pace(clock: &SimulatedClock) -> Pace<&SimulatedClock> {
        Pace::by_clock(clock, Duration::from_millis(5), Duration::from_micros(150))
    }

    #[test]
    fn the_releases_are_on_the_grid_of_all_nodes_whenever_the_program_starts() {
        for start_ns in [0, 1, 123_456_789, 40 * MS, 40 * MS + 500 * US] {
            let clock = SimulatedClock::at(start_ns).wake_latency_ns(60 * US);
            let mut pace = pace(&clock);
            for n in 0..10 {
                let Release { cycle, release_ns, start_ns, missed, .. } = pace.wait().unwrap();
                assert_eq!((cycle, missed), (n, 0));
                assert_eq!(release_ns % (5 * MS), 650 * US);
                assert_eq!(start_ns, release_ns + 60 * US);
            }
        }
    }

    #[test]
    fn what_passes_before_the_first_wait_is_not_missed_and_what_passes_later_is_left_out() {
        let clock = SimulatedClock::at(7 * MS);
        let mut pace = pace(&clock);
        clock.advance_to(1_000 * MS);
        let first = pace.wait().unwrap();
        assert_eq!((first.cycle, first.missed), (0, 0));
        clock.advance_to(first.release_ns + 12 * MS);
        let next = pace.wait().unwrap();
        assert_eq!((next.cycle, next.missed), (2, 1));
        assert_eq!(next.release_ns, first.release_ns + 10 * MS);
    }

    #[test]
    fn a_flag_ends_the_waits() {
        let clock = SimulatedClock::at(0);
        let stop = Arc::new(AtomicBool::new(false));
        let mut pace = pace(&clock).stopped_by(Arc::clone(&stop));
        assert!(pace.wait().is_some());
        stop.store(true, Ordering::Relaxed);
        assert!(pace.wait().is_none());
    }
}
