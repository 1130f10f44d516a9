//! The cyclic executor: which cycle runs, when it was due, what was missed.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isochrone_model::{CycleStartCounts, MissLimit, Overrun, Schedule};

use crate::clock::Clock;
use crate::follow::{FollowStart, FollowedData, Look, watch};
use crate::wait::{Awake, Waiter, WakeUps};

/// Most late cycles that [`Overrun::CatchUp`] runs back to back before it skips the rest.
pub const MAX_BURST: u32 = 8;

/// One cycle that is to run now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Release {
    /// Index on the grid from 0, missed releases included.
    pub cycle: u64,
    /// When the cycle was due, in ns: `epoch + phase + cycle * period`.
    pub release_ns: u64,
    /// The first clock reading after the wait, in ns; never before `release_ns`.
    pub start_ns: u64,
    /// Releases lost since the loop began, those just lost included.
    pub missed: u64,
    /// Releases lost between the cycle before and this one.
    pub newly_missed: u64,
    /// How a cycle that follows its data came to begin; `None` for one that began at its release.
    pub follow: Option<FollowStart>,
}

/// Why a loop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The stop flag was set.
    Requested,
    /// A cycle overran or a release was missed, and the policy is [`Overrun::Stop`].
    Overrun,
}

/// Releases cycles on an absolute grid.
///
/// Cycle `k` is due at `epoch + phase + k * period`. When the wait for cycle `n` ends `L` after its
/// due time, `k = floor(L / period)` whole periods have passed; what becomes of those releases is
/// the schedule's [`Overrun`] policy. A late release is never moved, so the grid does not drift.
///
/// All times are u64 nanoseconds, 584 years since the clock's origin. A due time beyond that
/// saturates, and the wait for it then ends only by a stop request: nothing wraps or panics.
#[derive(Debug)]
pub struct Cyclic<C: Clock> {
    clock: C,
    waiter: Waiter,
    period_ns: u64,
    overrun: Overrun,
    stop: Arc<AtomicBool>,
    next_cycle: u64,
    next_release_ns: u64,
    missed: u64,
    overruns: u64,
    burst: u32,
    /// Cycles at which the last misses happened, as many as the limit counts.
    limit: Option<MissWindow>,
    stop_reason: Option<StopReason>,
    follow_within_ns: u64,
    begun: CycleStartCounts,
}

impl<C: Clock> Cyclic<C> {
    /// A loop whose cycle 0 is due at `epoch_ns + schedule.phase_ns`.
    ///
    /// Give all tasks of a node the same `epoch_ns`, a little in the future: releases that have
    /// passed before the first wait count as missed. Setting `stop` ends the loop within 200 ms.
    pub fn new(clock: C, schedule: Schedule, epoch_ns: u64, stop: Arc<AtomicBool>) -> Self {
        let period_ns = schedule.period_ns.max(1);
        Self {
            clock,
            waiter: Waiter::new(schedule.wake, period_ns),
            period_ns,
            overrun: schedule.overrun,
            stop,
            next_cycle: 0,
            next_release_ns: epoch_ns.saturating_add(schedule.phase_ns),
            missed: 0,
            overruns: 0,
            burst: 0,
            limit: schedule.limit.map(MissWindow::new),
            stop_reason: None,
            follow_within_ns: schedule.follow_within_ns.unwrap_or(0),
            begun: CycleStartCounts::default(),
        }
    }

    /// Numbers the cycles from this one on, as if as many had run before; when they are due stays the same.
    #[must_use]
    pub fn counting_from(self, first_cycle: u64) -> Self {
        Self { next_cycle: first_cycle, ..self }
    }

    /// Waits for the next release. `None` ends the loop for good; [`stop_reason`](Self::stop_reason)
    /// tells why. A loop that ends because it missed releases runs the late cycle first, so that
    /// whoever reads its results learns of it.
    pub fn wait(&mut self) -> Option<Release> {
        self.wait_with(WakeUps::One, |_| ())
    }

    /// As [`wait`](Self::wait); calls `awake` at its wake-ups before the release. What would otherwise
    /// disturb the cycle, and is short, has its place there.
    pub fn wait_with(&mut self, wake_ups: WakeUps, awake: impl FnMut(Awake)) -> Option<Release> {
        if self.stop_reason.is_some() {
            return None;
        }
        let waited =
            self.waiter.wait_until(&self.clock, self.next_release_ns, &self.stop, wake_ups, awake);
        let Some(start_ns) = waited else {
            self.stop_reason = Some(StopReason::Requested);
            return None;
        };
        let periods_late = start_ns.saturating_sub(self.next_release_ns) / self.period_ns;
        let newly_missed = self.skipped(periods_late);
        self.skip(newly_missed);
        let too_many = |window: &mut MissWindow| window.count(newly_missed, self.next_cycle);
        if self.limit.as_mut().is_some_and(too_many) {
            self.stop_reason = Some(StopReason::Overrun);
        }
        let release = Release {
            cycle: self.next_cycle,
            release_ns: self.next_release_ns,
            start_ns,
            missed: self.missed,
            newly_missed,
            follow: None,
        };
        self.advance(1);
        Some(release)
    }

    /// Waits for the next release and then, at most [`follow_within_ns`](Schedule::follow_within_ns)
    /// after it, for data of this cycle: what came after the cycle before gave up. Without any the cycle
    /// begins then all the same.
    ///
    /// What passes until the release is that of [`wait_with`](Self::wait_with), so the grid, its
    /// misses and its margin do not depend on the data.
    pub fn wait_for_data(
        &mut self,
        wake_ups: WakeUps,
        follow: &mut impl FollowedData,
    ) -> Option<Release> {
        let release = self.wait_with(wake_ups, |awake| follow.awake(awake))?;
        let latest_ns = release.release_ns.saturating_add(self.follow_within_ns);
        let first = Look {
            cycle: release.cycle,
            since_ns: latest_ns.saturating_sub(self.period_ns),
            now_ns: release.start_ns,
        };
        let watched = watch(&self.clock, first, latest_ns, &self.stop, follow);
        let Some((start_ns, begun)) = watched else {
            self.stop_reason.get_or_insert(StopReason::Requested);
            return None;
        };
        self.begun.add(begun);
        let follow = FollowStart { ready_ns: release.start_ns, begun, counts: self.begun };
        Some(Release { start_ns, follow: Some(follow), ..release })
    }

    /// Waits until this long after the next release, for a loop that stands by while another one runs the cycles: what
    /// passes meanwhile is not missed, and does not end the loop.
    pub fn wait_behind(&mut self, delay_ns: u64, awake: impl FnMut(Awake)) -> Option<Release> {
        if self.stop_reason == Some(StopReason::Requested) {
            return None;
        }
        // One that was stopped for long while it ran the cycles has not failed.
        self.stop_reason = None;
        let until_ns = self.next_release_ns.saturating_add(delay_ns);
        let waited = self.waiter.wait_until(&self.clock, until_ns, &self.stop, WakeUps::One, awake);
        let Some(start_ns) = waited else {
            self.stop_reason = Some(StopReason::Requested);
            return None;
        };
        let newly_missed = start_ns.saturating_sub(until_ns) / self.period_ns;
        self.advance(newly_missed);
        self.burst = 0;
        let (cycle, release_ns) = (self.next_cycle, self.next_release_ns);
        let (missed, follow) = (self.missed, None);
        self.advance(1);
        Some(Release { cycle, release_ns, start_ns, missed, newly_missed, follow })
    }

    /// Takes over from another loop that had missed so many releases.
    pub fn take_over(&mut self, missed: u64) {
        self.missed = missed;
    }

    /// Tells that the cycle just released ended at `end_ns`. A cycle that ends after the next
    /// release was due is an overrun; one that ends exactly then is not.
    pub fn finished(&mut self, end_ns: u64) {
        if end_ns > self.next_release_ns {
            self.overruns = self.overruns.saturating_add(1);
            if self.overrun == Overrun::Stop {
                self.stop_reason = Some(StopReason::Overrun);
            }
        }
    }

    /// Goes on after a pause: the next cycle is due at `release_ns`, and nothing was missed in between.
    /// What the wait learned is kept.
    pub fn resume(&mut self, release_ns: u64) {
        self.next_release_ns = release_ns;
        self.burst = 0;
    }

    /// Why the loop ended, or `None` while it runs.
    pub fn stop_reason(&self) -> Option<StopReason> {
        self.stop_reason
    }

    /// Releases lost so far.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Cycles so far that ended after the next release was due.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// When the next cycle is due, in ns: the end of the slack.
    pub fn next_release_ns(&self) -> u64 {
        self.next_release_ns
    }

    /// How long before the release a hybrid wait intends to be awake, in ns; `None` for other waits.
    pub fn margin_ns(&self) -> Option<u64> {
        self.waiter.margin_ns()
    }

    /// How many of the releases that have passed are given up.
    fn skipped(&mut self, periods_late: u64) -> u64 {
        match self.overrun {
            Overrun::CatchUp if periods_late > 0 && self.burst < MAX_BURST => {
                self.burst += 1;
                return 0;
            }
            Overrun::Stop if periods_late > 0 => self.stop_reason = Some(StopReason::Overrun),
            Overrun::Skip | Overrun::CatchUp | Overrun::Stop => {}
        }
        self.burst = 0;
        periods_late
    }

    fn skip(&mut self, releases: u64) {
        self.missed = self.missed.saturating_add(releases);
        self.advance(releases);
    }

    fn advance(&mut self, releases: u64) {
        self.next_cycle = self.next_cycle.saturating_add(releases);
        self.next_release_ns =
            self.next_release_ns.saturating_add(releases.saturating_mul(self.period_ns));
    }
}

/// The last misses, to be compared with a limit.
#[derive(Debug)]
struct MissWindow {
    within: u64,
    /// Cycles of the last misses; the oldest is overwritten.
    misses: Box<[Option<u64>]>,
    oldest: usize,
}

impl MissWindow {
    fn new(limit: MissLimit) -> Self {
        let misses = vec![None; limit.misses.max(1) as usize].into();
        Self { within: limit.cycles, misses, oldest: 0 }
    }

    /// Takes in `missed` releases just before cycle `next`; whether the limit is reached.
    fn count(&mut self, missed: u64, next: u64) -> bool {
        // More than the window holds need not be counted one by one.
        let counted = missed.min(self.misses.len() as u64);
        for cycle in next - counted..next {
            if let Some(slot) = self.misses.get_mut(self.oldest) {
                *slot = Some(cycle);
            }
            self.oldest = (self.oldest + 1) % self.misses.len();
        }
        let oldest = self.misses.get(self.oldest).copied().flatten();
        counted > 0 && oldest.is_some_and(|oldest| next - oldest <= self.within)
    }
}

#[cfg(test)]
#[path = "cyclic_tests.rs"]
mod tests;
