//! When a standby takes over. No clock, no ports.

use std::cmp::Ordering;

/// How a task that follows finds things at one of its looks, a little after the holder should have sent.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Look {
    /// A state has come since the last look.
    pub(crate) has_come: bool,
    /// The cycle of the newest state against the one that was due: an earlier one, or none, is `Less`. A later one has come
    /// where this process is behind.
    pub(crate) newest: Ordering,
    /// It was awake in time; if not, nothing can be said of the holder.
    pub(crate) was_met: bool,
    /// This process holds the node: another of its tasks took over.
    pub(crate) holds: bool,
    /// Every task of this process has a state of the holder.
    pub(crate) is_complete: bool,
    /// The holder has asked for being taken over.
    pub(crate) is_asked: bool,
}

/// What the task does then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// It goes on following.
    Follow,
    /// It takes the node over, in the middle of a silence.
    TakeOver,
    /// It takes the node over from a holder that has just finished this cycle.
    TakeOverAsAsked,
    /// It runs the cycle that was due, as nobody else has.
    RunThis,
    /// It runs the next cycle at its release.
    RunNext,
}

/// The rules for one task.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules {
    after: u32,
    /// Releases that it met and for which nothing came, one after the other.
    silent: u32,
}

impl Rules {
    /// Takes over after so many releases, at least one.
    pub(crate) fn new(after: u32) -> Self {
        Self { after: after.max(1), silent: 0 }
    }

    /// In how many releases that it met nothing has come since the last state.
    pub(crate) fn silent(&self) -> u32 {
        self.silent
    }

    /// Judges a look.
    pub(crate) fn judge(&mut self, look: Look) -> Verdict {
        let Look { has_come, newest, was_met, holds, is_complete, is_asked } = look;
        if has_come || newest.is_ge() {
            self.silent = 0;
        } else if was_met {
            self.silent = self.silent.saturating_add(1);
        }
        match (holds, newest) {
            // The next cycle is in the state already, and a second step would move the outputs twice.
            (_, Ordering::Greater) => Verdict::Follow,
            (true, Ordering::Equal) => Verdict::RunNext,
            (true, Ordering::Less) => Verdict::RunThis,
            (false, Ordering::Equal) if is_asked && is_complete => Verdict::TakeOverAsAsked,
            (false, Ordering::Less) if is_complete && self.silent >= self.after => {
                Verdict::TakeOver
            }
            (false, _) => Verdict::Follow,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use isochrone_cyclic::{Clock, Cyclic, Schedule};
    use isochrone_model::Wake;

    use super::*;

    /// A clock that wakes whoever sleeps so much too late.
    struct LateClock {
        now_ns: Cell<u64>,
        late_ns: u64,
    }

    impl Clock for LateClock {
        fn now_ns(&self) -> u64 {
            self.now_ns.get()
        }

        fn sleep_until_ns(&self, deadline_ns: u64) {
            self.now_ns.set(self.now_ns.get().max(deadline_ns) + self.late_ns);
        }
    }

    const PERIOD_NS: u64 = 1_000_000;
    const DELAY_NS: u64 = 200_000;

    const LOOK: Look = Look {
        has_come: true,
        newest: Ordering::Equal,
        was_met: true,
        holds: false,
        is_complete: true,
        is_asked: false,
    };
    const SILENCE: Look = Look { has_come: false, newest: Ordering::Less, ..LOOK };

    #[test]
    fn a_standby_takes_over_after_as_many_silent_releases_as_it_is_told() {
        for after in 1..5 {
            let mut rules = Rules::new(after);
            assert_eq!(rules.judge(LOOK), Verdict::Follow);
            for _ in 1..after {
                assert_eq!(rules.judge(SILENCE), Verdict::Follow);
            }
            assert_eq!(rules.judge(SILENCE), Verdict::TakeOver);
        }
    }

    #[test]
    fn releases_that_the_standby_itself_missed_do_not_count() {
        let mut rules = Rules::new(2);
        let late = Look { was_met: false, ..SILENCE };
        assert_eq!([SILENCE, late, late].map(|look| rules.judge(look)), [Verdict::Follow; 3]);
        assert_eq!(rules.judge(SILENCE), Verdict::TakeOver);
    }

    #[test]
    fn a_state_that_comes_ends_the_silence() {
        let mut rules = Rules::new(2);
        let looks = [SILENCE, LOOK, SILENCE, LOOK];
        assert_eq!(looks.map(|look| rules.judge(look)), [Verdict::Follow; 4]);
    }

    #[test]
    fn a_holder_that_is_late_in_every_cycle_is_not_silent() {
        let mut rules = Rules::new(1);
        let late = Look { newest: Ordering::Less, ..LOOK };
        assert_eq!([late; 9].map(|look| rules.judge(look)), [Verdict::Follow; 9]);
    }

    #[test]
    fn a_standby_that_lacks_the_state_of_a_task_does_not_take_over() {
        let mut rules = Rules::new(2);
        let lacks = Look { is_complete: false, ..SILENCE };
        assert_eq!([lacks; 9].map(|look| rules.judge(look)), [Verdict::Follow; 9]);
        assert_eq!(rules.judge(SILENCE), Verdict::TakeOver);
    }

    #[test]
    fn a_holder_that_hands_over_is_followed_to_the_end_of_its_cycle() {
        let mut rules = Rules::new(2);
        let asked = Look { is_asked: true, ..LOOK };
        assert_eq!(rules.judge(Look { newest: Ordering::Less, ..asked }), Verdict::Follow);
        assert_eq!(rules.judge(Look { is_complete: false, ..asked }), Verdict::Follow);
        assert_eq!(rules.judge(asked), Verdict::TakeOverAsAsked);
    }

    #[test]
    fn the_other_tasks_run_what_the_holder_has_not_finished() {
        let mut rules = Rules::new(2);
        assert_eq!(rules.judge(Look { holds: true, ..LOOK }), Verdict::RunNext);
        assert_eq!(rules.judge(Look { holds: true, ..SILENCE }), Verdict::RunThis);
    }

    #[test]
    fn a_standby_that_is_behind_the_holder_runs_no_cycle_that_is_in_its_state() {
        let mut rules = Rules::new(2);
        let behind = Look { newest: Ordering::Greater, ..LOOK };
        for look in [behind, Look { is_asked: true, ..behind }, Look { holds: true, ..behind }] {
            assert_eq!(rules.judge(look), Verdict::Follow, "{look:?}");
        }
    }

    /// Follows a holder that dies after cycle `last`, by a clock whose wake-ups are `latency_ns` late; the release in which
    /// it is taken over.
    fn taken_over_at(last: u64, latency_ns: u64) -> u64 {
        let clock = LateClock { now_ns: Cell::new(0), late_ns: latency_ns };
        let schedule = Schedule::every(PERIOD_NS, Wake::Sleep);
        let mut cyclic = Cyclic::new(&clock, schedule, PERIOD_NS, std::sync::Arc::default());
        let mut rules = Rules::new(2);
        loop {
            let release = cyclic.wait_behind(DELAY_NS, |_| ()).unwrap();
            let has_come = release.cycle <= last;
            let newest = if has_come { Ordering::Equal } else { Ordering::Less };
            let was_met = release.newly_missed == 0;
            if rules.judge(Look { has_come, newest, was_met, ..LOOK }) == Verdict::TakeOver {
                return release.cycle;
            }
        }
    }

    #[test]
    fn a_takeover_is_in_the_second_release_after_the_last_cycle_however_late_the_standby_wakes_in_it()
     {
        for latency_ns in [0, 60_000, 900_000] {
            assert_eq!(taken_over_at(5, latency_ns), 7, "{latency_ns}");
        }
    }

    #[test]
    fn a_standby_that_cannot_keep_the_period_takes_nothing_over() {
        let clock = LateClock { now_ns: Cell::new(0), late_ns: 3 * PERIOD_NS };
        let schedule = Schedule::every(PERIOD_NS, Wake::Sleep);
        let mut cyclic = Cyclic::new(&clock, schedule, PERIOD_NS, std::sync::Arc::default());
        let mut rules = Rules::new(2);
        for _ in 0..20 {
            let release = cyclic.wait_behind(DELAY_NS, |_| ()).unwrap();
            let look = Look { was_met: release.newly_missed == 0, ..SILENCE };
            assert_eq!(rules.judge(look), Verdict::Follow);
        }
    }
}
