//! Chooses a phase that keeps clear of the kernel's ticks and of other tasks.

use std::cmp::Reverse;
use std::iter;

use isochrone_model::{KERNEL_TICK_NS, greatest_common_divisor, phase_between_ticks_ns};

use super::need::{Encounter, Need};

/// The most needs of other tasks that are considered, to bound the time that a choice takes.
const MOST_NEEDS: u64 = 65_536;
/// A gap shorter than this is of no use, in ns.
const TOO_SHORT_NS: u64 = 2_000;
/// Phases are multiples of this where there is room, so that they are easy to read; in ns.
const ROUND_NS: u64 = 1_000;

/// A phase that was chosen for a task. Times in ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ClearPhase {
    /// The phase, less than the period.
    pub(super) phase_ns: u64,
    /// Free time before and after the task's own need, until others need the CPU; `None`: there are no others, or
    /// they leave no gap, and the phase keeps clear of the ticks alone.
    pub(super) clear_ns: Option<u64>,
}

/// The phase that keeps as clear as possible of the other tasks on the task's CPU and of the kernel's ticks; the
/// first of several that are equally good. Without other tasks it is [`phase_between_ticks_ns`].
///
/// `task.release_ns` is the release with phase 0, at which the common grid of its node begins.
pub(super) fn clear_phase_ns(task: &Need, others: &[Need]) -> ClearPhase {
    // A task that is in the way at every phase does not affect which phase is best.
    let mut taken: Vec<OccupiedPhases> =
        others.iter().filter_map(|other| OccupiedPhases::of(task, other)).collect();
    let of_others = taken.len();
    // A tick during the task's wait is over by the release.
    let cycle = Need { before_ns: 0, ..*task };
    let tick = Need { period_ns: KERNEL_TICK_NS, release_ns: 0, before_ns: 0, after_ns: 0 };
    taken.extend(OccupiedPhases::of(&cycle, &tick));
    // If the other tasks leave no gap except at a tick, the tick does less harm than they would.
    let choices = [taken.as_slice(), taken.get(..of_others).unwrap_or_default()];
    let gap = choices.into_iter().filter(|_| of_others > 0).find_map(widest_gap);
    match gap {
        Some((phase_ns, clear_ns)) => ClearPhase { phase_ns, clear_ns: Some(clear_ns) },
        None => {
            let phase_ns = phase_between_ticks_ns(task.period_ns.max(1));
            ClearPhase { phase_ns, clear_ns: None }
        }
    }
}

/// Phases at which a task would meet another one: an interval that repeats at every step.
#[derive(Debug, Clone, Copy)]
struct OccupiedPhases {
    step_ns: u64,
    /// Start of the interval; less than a step.
    first_ns: u64,
    length_ns: u64,
}

impl OccupiedPhases {
    /// `None`: the tasks meet at every phase.
    fn of(task: &Need, other: &Need) -> Option<Self> {
        let Encounter { step_ns, length_ns, into_ns, .. } = task.encounter(other);
        let has_gap = length_ns.saturating_add(TOO_SHORT_NS) <= step_ns;
        has_gap.then_some(Self { step_ns, first_ns: step_ns - into_ns, length_ns })
    }

    /// From when to when, in order: the end of the one before 0, and all that begin before an end.
    fn until(self, end_ns: u64) -> impl Iterator<Item = (u64, u64)> {
        let Self { step_ns, first_ns, length_ns } = self;
        let before = (0, (first_ns + length_ns).saturating_sub(step_ns));
        let starts =
            iter::successors(Some(first_ns), move |start_ns| start_ns.checked_add(step_ns));
        let spans = starts.map(move |start_ns| (start_ns, start_ns.saturating_add(length_ns)));
        iter::once(before).chain(spans.take_while(move |(start_ns, _)| *start_ns < end_ns))
    }
}

/// The middle of the widest gap between occupied phases, and the free time on both sides of it; the first, if several
/// are equally wide.
fn widest_gap(taken: &[OccupiedPhases]) -> Option<(u64, u64)> {
    let steps = || taken.iter().map(|taken| taken.step_ns);
    // All steps divide the task's period, so this does, too.
    let repeat_ns = steps().fold(1, |all, step| all / greatest_common_divisor(all, step) * step);
    let most_ns = steps().min()?.saturating_mul((MOST_NEEDS / taken.len() as u64).max(1));
    // Two repetitions contain every gap as a whole. If that is too much to search, a part of it has to do; the gaps
    // in it are real, too.
    let end_ns = repeat_ns.saturating_mul(2).min(most_ns);
    let mut spans: Vec<(u64, u64)> = taken.iter().flat_map(|taken| taken.until(end_ns)).collect();
    spans.push((end_ns, end_ns));
    spans.sort_unstable();
    let mut free_from_ns = 0;
    let gaps = spans.into_iter().filter_map(|(start_ns, stop_ns)| {
        let width_ns = start_ns.saturating_sub(free_from_ns);
        let gap = (width_ns / 2, Reverse((free_from_ns + width_ns / 2) % repeat_ns));
        free_from_ns = free_from_ns.max(stop_ns);
        (width_ns >= TOO_SHORT_NS).then_some(gap)
    });
    let (clear_ns, Reverse(phase_ns)) = gaps.max()?;
    if clear_ns < 10 * ROUND_NS {
        return Some((phase_ns, clear_ns));
    }
    let round_ns = (phase_ns + ROUND_NS / 2) / ROUND_NS * ROUND_NS;
    Some((round_ns % repeat_ns, clear_ns - phase_ns.abs_diff(round_ns)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use isochrone_model::EPOCH_OFFSET_NS;

    const US: u64 = 1_000;
    const MS: u64 = 1_000 * US;

    fn need(period_ns: u64, release_ns: u64, before_ns: u64, after_ns: u64) -> Need {
        Need { period_ns, release_ns, before_ns, after_ns }
    }

    #[test]
    fn without_others_the_phase_is_the_one_between_the_ticks() {
        for period_ns in [100 * US, MS, 5 * MS / 2, 1_001 * US] {
            let task = need(period_ns, EPOCH_OFFSET_NS, 200 * US, 0);
            let phase_ns = phase_between_ticks_ns(period_ns);
            assert_eq!(clear_phase_ns(&task, &[]), ClearPhase { phase_ns, clear_ns: None });
        }
    }

    #[test]
    fn a_third_task_finds_its_place_between_two() {
        let first = need(MS, EPOCH_OFFSET_NS, 100 * US, 10 * US);
        let task = Need { after_ns: 0, ..first };
        let second_ns = clear_phase_ns(&task, &[first]).phase_ns;
        let second = Need { release_ns: EPOCH_OFFSET_NS + second_ns, ..first };
        let third_ns = clear_phase_ns(&task, &[first, second]).phase_ns;
        let third = Need { release_ns: EPOCH_OFFSET_NS + third_ns, ..first };
        assert!(second.meeting(&first).is_none() && third.meeting(&first).is_none());
        assert!(third.meeting(&second).is_none());
    }

    #[test]
    fn a_task_that_is_always_in_the_way_does_not_count() {
        let task = need(MS, EPOCH_OFFSET_NS, 200 * US, 0);
        let spins = need(MS, 0, MS, 10 * US);
        let drifts = need(MS + 1, 0, 200 * US, 10 * US);
        assert_eq!(clear_phase_ns(&task, &[spins, drifts]), clear_phase_ns(&task, &[]));
    }

    #[test]
    fn where_only_a_tick_is_free_the_task_stands_on_it() {
        let task = need(MS, EPOCH_OFFSET_NS, 0, 20 * US);
        let busy = need(MS, 15 * US, 0, 970 * US);
        let chosen = clear_phase_ns(&task, &[busy]);
        assert_eq!((EPOCH_OFFSET_NS + chosen.phase_ns) % MS, 990 * US);
        assert_eq!(chosen.clear_ns, Some(5 * US));
    }

    #[test]
    fn tasks_of_an_hour_are_placed_as_fast_as_others() {
        const HOUR: u64 = 3_600_000 * MS;
        let task = need(HOUR, EPOCH_OFFSET_NS, 0, 50 * MS);
        let others = [need(HOUR, EPOCH_OFFSET_NS, 0, 20 * MS), need(100 * MS, 0, 200 * US, MS)];
        let chosen = clear_phase_ns(&task, &others);
        let placed = Need { release_ns: EPOCH_OFFSET_NS + chosen.phase_ns, ..task };
        assert!(others.iter().all(|other| placed.meeting(other).is_none()), "{chosen:?}");
    }

    /// Free time around a release at a phase, in us, by looking at every release of the others.
    fn clear_us(task: &Need, others: &[Need], phase_us: i64) -> i64 {
        let us = |ns: u64| i64::try_from(ns / US).unwrap();
        let (before, after) = (us(task.before_ns), us(task.after_ns));
        let mut clear = i64::MAX;
        for cycle in -1..=us(40 * MS) / us(task.period_ns) {
            let release = us(task.release_ns) + phase_us + cycle * us(task.period_ns);
            for other in others {
                for n in -24..us(44 * MS) / us(other.period_ns) {
                    let theirs = us(other.release_ns) + n * us(other.period_ns);
                    let ahead = (theirs - us(other.before_ns)) - (release + after);
                    let behind = (release - before) - (theirs + us(other.after_ns));
                    clear = clear.min(ahead.max(behind));
                }
            }
            let to_tick = -(release + after).rem_euclid(-us(MS));
            let from_tick = release.rem_euclid(us(MS));
            let in_cycle = from_tick + to_tick + after > us(MS);
            clear = clear.min(if in_cycle { 0 } else { to_tick.min(from_tick) });
        }
        clear
    }

    fn others() -> impl Strategy<Value = Need> {
        let period = prop::sample::select(&[1_u64, 2, 4, 5, 10][..]);
        (period, 0..10_000_u64, 0..200_u64, 1..100_u64).prop_map(
            |(period_ms, release_us, before_us, after_us)| {
                need(period_ms * MS, release_us * US, before_us * US, after_us * US)
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn no_phase_is_clearer_than_the_one_that_is_chosen(
            task in others(),
            others in prop::collection::vec(others(), 1..4),
        ) {
            let task = need(task.period_ns, EPOCH_OFFSET_NS, task.before_ns, task.after_ns);
            let chosen = clear_phase_ns(&task, &others);
            prop_assert!(chosen.phase_ns < task.period_ns);
            let placed = Need { release_ns: task.release_ns + chosen.phase_ns, ..task };
            if chosen.clear_ns.is_some() {
                prop_assert!(others.iter().all(|other| placed.meeting(other).is_none()));
            }
            let phases = 0..i64::try_from(task.period_ns / US).unwrap();
            let best_us = phases.step_by(7).map(|us| clear_us(&task, &others, us)).max().unwrap();
            let clear_us = chosen.clear_ns.map_or(0, |ns| i64::try_from(ns / US).unwrap());
            prop_assert!(clear_us + 2 >= best_us, "{clear_us} us, and {best_us} us were possible");
        }
    }
}
