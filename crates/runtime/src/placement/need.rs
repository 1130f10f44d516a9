//! When tasks that share a CPU need it at the same time.

use isochrone_model::greatest_common_divisor;

/// When a task needs its CPU, relative to each of its releases. All times are in ns of one clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Need {
    /// From release to release. Zero counts as 1.
    pub(super) period_ns: u64,
    /// One of its releases.
    pub(super) release_ns: u64,
    /// How long before each release it needs the CPU, to watch the clock.
    pub(super) before_ns: u64,
    /// How long after each release it needs the CPU, to run its cycle. Zero counts as 1.
    pub(super) after_ns: u64,
}

/// Two tasks that need their CPU at the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Meeting {
    /// How many releases of the first task meet the second ...
    pub met: u64,
    /// ... of this many, after which everything repeats.
    pub of: u64,
    /// The shortest time between a release of one and a release of the other, in ns.
    pub apart_ns: u64,
    /// The longest time for which both need the CPU, in ns.
    pub overlap_ns: u64,
}

impl Need {
    /// How two tasks on one CPU meet; `None`: they never do.
    pub(super) fn meeting(&self, other: &Self) -> Option<Meeting> {
        let Encounter { step_ns, later_ns, length_ns, into_ns } = self.encounter(other);
        if into_ns >= length_ns {
            return None;
        }
        // Relative to this task, releases of the other are at all multiples of a step, equally often at each within
        // one period of it.
        let of = other.period_ns() / step_ns;
        let met = of.min((length_ns - into_ns).div_ceil(step_ns));
        // Both need the CPU for longest where they meet in the middle, or next to it.
        let before_middle_ns =
            into_ns + (length_ns / 2).saturating_sub(into_ns) / step_ns * step_ns;
        let overlap_ns = [before_middle_ns, before_middle_ns.saturating_add(step_ns)]
            .map(|at_ns| at_ns.min(length_ns.saturating_sub(at_ns)))
            .into_iter()
            .fold(0, u64::max)
            .min(self.length_ns())
            .min(other.length_ns());
        Some(Meeting { met, of, apart_ns: later_ns.min(step_ns - later_ns), overlap_ns })
    }

    /// How often relative positions repeat: the greatest common divisor of the periods, in ns.
    pub(super) fn step_ns(&self, other: &Self) -> u64 {
        greatest_common_divisor(self.period_ns(), other.period_ns())
    }

    /// Where a release of this task lies within the interval in which it meets a release of the other one.
    pub(super) fn encounter(&self, other: &Self) -> Encounter {
        let step_ns = self.step_ns(other);
        let later_ns = (other.release_ns % step_ns + step_ns - self.release_ns % step_ns) % step_ns;
        let clear_before_ns = self.after_ns().saturating_add(other.before_ns);
        Encounter {
            step_ns,
            later_ns,
            length_ns: self.length_ns().saturating_add(other.length_ns()),
            into_ns: (clear_before_ns % step_ns + (step_ns - 1 - later_ns)) % step_ns + 1,
        }
    }

    /// Longer periods make no difference; the bound keeps the sums small.
    fn period_ns(&self) -> u64 {
        self.period_ns.clamp(1, u64::MAX / 8)
    }

    fn after_ns(&self) -> u64 {
        self.after_ns.max(1)
    }

    /// How long it needs the CPU for each release.
    fn length_ns(&self) -> u64 {
        self.before_ns.saturating_add(self.after_ns())
    }
}

/// When releases of two tasks meet: an interval that repeats at every step. All times are in ns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Encounter {
    pub(super) step_ns: u64,
    /// The shortest time from a release of the first task to the next of the second: less than a step.
    later_ns: u64,
    pub(super) length_ns: u64,
    /// How much earlier a release of the first task would have to be to fall just before the interval: 1 to a step.
    /// If this is not less than the length, they do not meet.
    pub(super) into_ns: u64,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const MS: u64 = 1_000_000;

    fn hybrid(period_ns: u64, release_ns: u64) -> Need {
        Need { period_ns, release_ns, before_ns: 200_000, after_ns: 2_000 }
    }

    #[test]
    fn two_tasks_of_one_period_meet_at_each_release_or_never() {
        let first = hybrid(MS, 20 * MS + 500_000);
        assert_eq!(
            first.meeting(&hybrid(MS, 500_000)),
            Some(Meeting { met: 1, of: 1, apart_ns: 0, overlap_ns: 202_000 })
        );
        assert_eq!(
            first.meeting(&hybrid(MS, 600_000)),
            Some(Meeting { met: 1, of: 1, apart_ns: 100_000, overlap_ns: 102_000 })
        );
        assert_eq!(first.meeting(&hybrid(MS, 0)), None);
        assert_eq!(first.meeting(&hybrid(MS, 702_000)), None);
    }

    #[test]
    fn a_slow_task_meets_some_of_the_releases_of_a_fast_one() {
        let (fast, slow) = (hybrid(MS, 0), hybrid(10 * MS, 3 * MS));
        let meeting = Meeting { met: 1, of: 10, apart_ns: 0, overlap_ns: 202_000 };
        assert_eq!(fast.meeting(&slow), Some(meeting));
        assert_eq!(slow.meeting(&fast), Some(Meeting { of: 1, ..meeting }));
    }

    #[test]
    fn periods_that_have_little_in_common_meet_whatever_their_phases_are() {
        for release_ns in [0, 123_457, 500_000] {
            assert!(hybrid(MS, 0).meeting(&hybrid(MS + 1, release_ns)).is_some());
        }
    }

    #[test]
    fn releases_at_the_same_instant_meet_however_short_the_cycles_are() {
        let need = Need { period_ns: MS, release_ns: 7, before_ns: 0, after_ns: 0 };
        assert_eq!(
            need.meeting(&Need { release_ns: 7 + MS, ..need }),
            Some(Meeting { met: 1, of: 1, apart_ns: 0, overlap_ns: 1 })
        );
        assert_eq!(need.meeting(&Need { release_ns: 8, ..need }), None);
    }

    fn needs() -> impl Strategy<Value = Need> {
        (1..40_u64, 0..200_u64, 0..30_u64, 0..30_u64).prop_map(
            |(period_ns, release_ns, before_ns, after_ns)| Need {
                period_ns,
                release_ns,
                before_ns,
                after_ns,
            },
        )
    }

    /// From when to when the need of a release lasts.
    fn span(need: &Need, release_ns: i64) -> (i64, i64) {
        let before_ns = i64::try_from(need.before_ns).unwrap();
        (release_ns - before_ns, release_ns + i64::try_from(need.after_ns.max(1)).unwrap())
    }

    /// All releases far around those of a first task.
    fn releases(need: &Need, around_ns: i64) -> impl Iterator<Item = i64> + use<> {
        let (period_ns, release_ns) =
            (i64::try_from(need.period_ns).unwrap(), i64::try_from(need.release_ns).unwrap());
        let first_ns = (release_ns - around_ns).rem_euclid(period_ns) + around_ns - 4 * period_ns;
        (-40..60).map(move |n| first_ns + n * period_ns)
    }

    proptest! {
        #[test]
        fn meetings_are_those_that_all_releases_of_a_hyperperiod_show(a in needs(), b in needs()) {
            let of = b.period_ns / a.step_ns(&b);
            let (mut met, mut apart_ns, mut overlap_ns) = (0, u64::MAX, 0);
            for cycle in 0..of {
                let release_ns = i64::try_from(a.release_ns + cycle * a.period_ns).unwrap();
                let ours = span(&a, release_ns);
                let mut meets = false;
                for theirs_ns in releases(&b, release_ns) {
                    let theirs = span(&b, theirs_ns);
                    let shared = ours.1.min(theirs.1) - ours.0.max(theirs.0);
                    meets |= shared > 0;
                    overlap_ns = overlap_ns.max(u64::try_from(shared).unwrap_or(0));
                    apart_ns = apart_ns.min(theirs_ns.abs_diff(release_ns));
                }
                met += u64::from(meets);
            }
            let expected = (met > 0).then_some(Meeting { met, of, apart_ns, overlap_ns });
            prop_assert_eq!(a.meeting(&b), expected);
        }
    }
}
