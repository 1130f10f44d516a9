//! Curves of signals: the least and the greatest value of each interval, so that no spike of one cycle is
//! lost between two points.

use std::collections::{BTreeMap, VecDeque};

use serde::Serialize;
use serde::ser::{SerializeTuple, Serializer};

/// Thirty intervals a second.
pub(super) const INTERVAL_NS: u64 = 33_333_333;
/// Intervals of a curve that are kept: somewhat more than a minute.
const KEPT: usize = 1_900;
/// Curves of a task that no page shows any more and that are kept as long: as many as one is traced for.
const MAX_RESTING: usize = 64;

/// What a signal did in an interval. In JSON `[index, least, greatest, last, flags]`, with `null` where no
/// value was a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    /// Counts intervals of `CLOCK_MONOTONIC`.
    pub(super) index: u64,
    least: f64,
    greatest: f64,
    last: f64,
    /// Cycles that ran were not received before its last value.
    is_broken: bool,
    /// There was a NaN or an infinity.
    is_unbounded: bool,
    /// The task missed cycles before its last value.
    is_missed: bool,
}

impl Interval {
    fn new(index: u64) -> Self {
        let (least, greatest, last) = (f64::INFINITY, f64::NEG_INFINITY, f64::NAN);
        let (is_broken, is_unbounded, is_missed) = (false, false, false);
        Self { index, least, greatest, last, is_broken, is_unbounded, is_missed }
    }

    fn add(&mut self, value: f64) {
        self.last = value;
        if value.is_finite() {
            self.least = self.least.min(value);
            self.greatest = self.greatest.max(value);
        } else {
            self.is_unbounded = true;
        }
    }
}

impl Serialize for Interval {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let finite = |value: f64| value.is_finite().then_some(value);
        let flags = [self.is_broken, self.is_unbounded, self.is_missed].into_iter().enumerate();
        let flags = flags.fold(0_u8, |flags, (bit, is_set)| flags | u8::from(is_set) << bit);
        let mut tuple = serializer.serialize_tuple(5)?;
        tuple.serialize_element(&self.index)?;
        for value in [self.least, self.greatest, self.last] {
            tuple.serialize_element(&finite(value))?;
        }
        tuple.serialize_element(&flags)?;
        tuple.end()
    }
}

/// The curve of a signal.
#[derive(Debug, Default)]
struct Curve {
    /// Each with its number among all that were closed.
    closed: VecDeque<(u64, Interval)>,
    open: Option<Interval>,
    /// Cycles that ran were not received before the next value.
    is_broken: bool,
    /// The task missed cycles before it.
    is_missed: bool,
}

/// The curves of a task's signals, in the order of a row's values.
#[derive(Debug, Default)]
struct TaskCurves {
    names: Vec<String>,
    curves: Vec<Curve>,
    /// Those whose signals are not traced at the moment. A page that is opened again finds them.
    resting: BTreeMap<String, Curve>,
}

/// All curves.
#[derive(Debug, Default)]
pub(super) struct Curves {
    tasks: BTreeMap<String, TaskCurves>,
    /// Number of the interval that was closed last.
    newest: u64,
}

impl Curves {
    /// From now on the rows of a task have the values of these signals. Curves of other signals rest.
    pub(super) fn set_signals(&mut self, task: &str, names: Vec<String>) {
        let Self { tasks, newest } = self;
        let known = tasks.entry(task.to_owned()).or_default();
        let before = std::mem::take(&mut known.names).into_iter();
        let mut before: BTreeMap<_, _> = before.zip(std::mem::take(&mut known.curves)).collect();
        let curve = |name: &String| {
            before.remove(name).or_else(|| known.resting.remove(name)).unwrap_or_default()
        };
        known.curves = names.iter().map(curve).collect();
        known.names = names;
        for (name, mut curve) in before {
            curve.close(newest);
            curve.is_broken = true;
            known.resting.insert(name, curve);
        }
        known.forget_oldest();
    }

    /// Cycles that ran were not received before the next row of a task.
    pub(super) fn interrupt(&mut self, task: &str) {
        if let Some(task) = self.tasks.get_mut(task) {
            task.curves.iter_mut().for_each(|curve| curve.is_broken = true);
        }
    }

    /// A task missed cycles before its next row.
    pub(super) fn miss(&mut self, task: &str) {
        if let Some(task) = self.tasks.get_mut(task) {
            task.curves.iter_mut().for_each(|curve| curve.is_missed = true);
        }
    }

    /// Takes in the values of one cycle of a task.
    pub(super) fn add(&mut self, task: &str, release_ns: u64, values: &[f64]) {
        let Some(task) = self.tasks.get_mut(task) else { return };
        let index = release_ns / INTERVAL_NS;
        for (curve, value) in task.curves.iter_mut().zip(values) {
            if curve.open.is_some_and(|open| open.index != index) {
                curve.close(&mut self.newest);
            }
            let open = curve.open.get_or_insert(Interval::new(index));
            open.is_broken |= std::mem::take(&mut curve.is_broken);
            open.is_missed |= std::mem::take(&mut curve.is_missed);
            open.add(*value);
        }
    }

    /// Closes the intervals that are over at that time, whether a later row has come or not.
    pub(super) fn close(&mut self, now_ns: u64) {
        let last_kept = (now_ns / INTERVAL_NS).saturating_sub(KEPT as u64);
        for task in self.tasks.values_mut() {
            task.resting.retain(|_, curve| curve.last_index() >= Some(last_kept));
        }
        let curves = self.tasks.values_mut().flat_map(|task| &mut task.curves);
        for curve in curves {
            if curve.open.is_some_and(|open| (open.index + 1) * INTERVAL_NS <= now_ns) {
                curve.close(&mut self.newest);
            }
        }
    }

    /// Number of the interval that was closed last.
    pub(super) fn newest(&self) -> u64 {
        self.newest
    }

    /// The intervals of a signal that were closed after that number.
    pub(super) fn since(&self, name: &str, number: u64) -> Vec<Interval> {
        let found = self.tasks.values().find_map(|task| {
            let place = task.names.iter().position(|known| known == name);
            place.and_then(|place| task.curves.get(place)).or_else(|| task.resting.get(name))
        });
        let Some(curve) = found else { return Vec::new() };
        let first = curve.closed.partition_point(|(of, _)| *of <= number);
        curve.closed.range(first..).map(|(_, interval)| *interval).collect()
    }
}

impl TaskCurves {
    /// Those that have rested longest make room.
    fn forget_oldest(&mut self) {
        while self.resting.len() > MAX_RESTING {
            let oldest = self.resting.iter().min_by_key(|(_, curve)| curve.last_index());
            let Some(name) = oldest.map(|(name, _)| name.clone()) else { return };
            self.resting.remove(&name);
        }
    }
}

impl Curve {
    /// The last interval that was closed.
    fn last_index(&self) -> Option<u64> {
        self.closed.back().map(|(_, interval)| interval.index)
    }

    fn close(&mut self, newest: &mut u64) {
        let Some(interval) = self.open.take() else { return };
        *newest += 1;
        if self.closed.len() >= KEPT {
            self.closed.pop_front();
        }
        self.closed.push_back((*newest, interval));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 1_000_000;

    fn curves() -> Curves {
        let mut curves = Curves::default();
        curves.set_signals("fast", vec!["a".into(), "b".into()]);
        curves
    }

    fn json(interval: &Interval) -> String {
        serde_json::to_string(interval).unwrap()
    }

    #[test]
    fn a_spike_of_one_cycle_is_the_greatest_value_of_its_interval() {
        let mut curves = curves();
        for cycle in 0..100 {
            let spike = if cycle == 40 { 9.0 } else { 1.0 };
            curves.add("fast", cycle * PERIOD_NS, &[spike, -spike]);
        }
        curves.close(100 * PERIOD_NS);
        let shown = |name| curves.since(name, 0).iter().map(json).collect::<Vec<_>>();
        assert_eq!(shown("a"), ["[0,1.0,1.0,1.0,0]", "[1,1.0,9.0,1.0,0]", "[2,1.0,1.0,1.0,0]"]);
        assert_eq!(shown("b")[1], "[1,-9.0,-1.0,-1.0,0]");
        assert!(curves.since("c", 0).is_empty());
    }

    #[test]
    fn a_reader_gets_each_interval_once_and_one_that_was_away_what_is_kept() {
        let mut curves = curves();
        let mut seen = Vec::new();
        let mut number = 0;
        for cycle in 0..3_000 {
            curves.add("fast", cycle * PERIOD_NS, &[cycle as f64, 0.0]);
            if cycle % 17 == 0 {
                seen.extend(curves.since("a", number).iter().map(|interval| interval.index));
                number = curves.newest();
            }
        }
        assert!(seen.len() > 80 && seen.iter().copied().eq(0..seen.len() as u64), "{seen:?}");
        for index in 0..10_000 {
            curves.add("fast", index * INTERVAL_NS, &[0.0, 0.0]);
        }
        assert_eq!(curves.since("a", 0).len(), KEPT);
    }

    #[test]
    fn cycles_that_are_missing_or_were_missed_and_values_that_are_no_numbers_are_said() {
        let mut curves = curves();
        curves.add("fast", 0, &[1.0, f64::NAN]);
        curves.interrupt("fast");
        curves.add("fast", INTERVAL_NS, &[2.0, f64::INFINITY]);
        curves.add("fast", INTERVAL_NS + 1, &[3.0, -1.0]);
        curves.miss("fast");
        curves.add("fast", 2 * INTERVAL_NS, &[3.0, -1.0]);
        curves.close(3 * INTERVAL_NS);
        let shown = |name| curves.since(name, 0).iter().map(json).collect::<Vec<_>>();
        assert_eq!(shown("a"), ["[0,1.0,1.0,1.0,0]", "[1,2.0,3.0,3.0,1]", "[2,3.0,3.0,3.0,4]"]);
        assert_eq!(
            shown("b"),
            ["[0,null,null,null,2]", "[1,-1.0,-1.0,-1.0,3]", "[2,-1.0,-1.0,-1.0,4]"]
        );
    }

    #[test]
    fn curves_of_signals_that_stay_go_on_when_others_are_chosen() {
        let mut curves = curves();
        curves.add("fast", 0, &[1.0, 2.0]);
        curves.set_signals("fast", vec!["c".into(), "b".into()]);
        curves.add("fast", 1, &[7.0, 3.0]);
        curves.close(INTERVAL_NS);
        assert_eq!(json(&curves.since("b", 0)[0]), "[0,2.0,3.0,3.0,0]");
        assert_eq!(json(&curves.since("c", 0)[0]), "[0,7.0,7.0,7.0,0]");
    }

    #[test]
    fn a_curve_that_was_not_shown_for_less_than_a_minute_goes_on_behind_a_gap() {
        let mut curves = curves();
        curves.add("fast", 0, &[1.0, 2.0]);
        // As a task is traced while no page says what it shows.
        curves.set_signals("fast", vec!["b".into()]);
        curves.add("fast", 10 * INTERVAL_NS, &[3.0]);
        curves.close(11 * INTERVAL_NS);
        let shown = |curves: &Curves| curves.since("a", 0).iter().map(json).collect::<Vec<_>>();
        assert_eq!(shown(&curves), ["[0,1.0,1.0,1.0,0]"]);
        curves.set_signals("fast", vec!["a".into(), "b".into()]);
        curves.add("fast", 20 * INTERVAL_NS, &[4.0, 5.0]);
        curves.close(21 * INTERVAL_NS);
        assert_eq!(shown(&curves), ["[0,1.0,1.0,1.0,0]", "[20,4.0,4.0,4.0,1]"]);

        curves.set_signals("fast", vec!["b".into()]);
        curves.close((KEPT as u64 + 21) * INTERVAL_NS);
        assert!(curves.since("a", 0).is_empty(), "it is older than anything that is shown");
    }

    #[test]
    fn curves_that_rest_are_no_more_than_a_task_is_traced_for() {
        let mut curves = Curves::default();
        for number in 0..1000 {
            curves.set_signals("fast", vec![number.to_string()]);
            curves.add("fast", number * INTERVAL_NS, &[0.0]);
        }
        let kept = (0..1000).filter(|number| !curves.since(&number.to_string(), 0).is_empty());
        // The last one is open.
        assert_eq!(kept.collect::<Vec<_>>(), (935..999).collect::<Vec<_>>());
    }
}
