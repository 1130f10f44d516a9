//! The labels of an axis.

use crate::Extremes;

/// The labels of an axis, at round numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ticks {
    /// The position and the text of each.
    pub labels: Vec<(f64, String)>,
    /// The unit of what they say, if they have one.
    pub unit: &'static str,
}

/// Units of times, and what a number of them is in ns. A step below the next unit is given in this one.
const UNITS: [(&str, f64); 4] = [("ns", 1.0), ("us", 1e3), ("ms", 1e6), ("s", 1e9)];

impl Ticks {
    /// Labels for times in ns relative to an instant, at most this many.
    pub fn of_times(begin_ns: f64, end_ns: f64, most: usize) -> Self {
        let step_ns = step(end_ns - begin_ns, most).max(1.0);
        let largest = begin_ns.abs().max(end_ns.abs());
        // Four digits are read at a glance; more are those of the next unit.
        let fits =
            |(_, unit_ns): &&(&str, f64)| step_ns < unit_ns * 1e3 && largest / unit_ns < 10_000.0;
        let (unit, unit_ns) = UNITS.iter().find(fits).copied().unwrap_or(("s", 1e9));
        Self { labels: labels(begin_ns, end_ns, step_ns, unit_ns), unit }
    }

    /// Labels for values, at most this many.
    pub fn of_values(extremes: Extremes, most: usize) -> Self {
        Self::of_steps(extremes, most, 0.0)
    }

    /// Labels for values that are whole numbers, at most this many.
    pub fn of_whole_values(extremes: Extremes, most: usize) -> Self {
        Self::of_steps(extremes, most, 1.0)
    }

    fn of_steps(Extremes { low, high }: Extremes, most: usize, least: f64) -> Self {
        let span = high - low;
        if span == f64::INFINITY {
            // The span between two numbers can be more than a number; that between their halves is one.
            let halves = labels(low / 2.0, high / 2.0, step(high / 2.0 - low / 2.0, most), 1.0);
            let whole = halves.into_iter().map(|(at, _)| (at * 2.0, number(at * 2.0, None)));
            return Self { labels: whole.filter(|it| it.0.is_finite()).collect(), unit: "" };
        }
        if span.is_nan() || span <= 0.0 {
            return Self { labels: vec![(low, number(low, None))], unit: "" };
        }
        Self { labels: labels(low, high, step(span, most).max(least), 1.0), unit: "" }
    }
}

/// The smallest step of 1, 2 or 5 times a power of ten that divides a span into no more than this many parts.
fn step(span: f64, most: usize) -> f64 {
    let least = span / most.max(1) as f64;
    let power = 10f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
    steps.into_iter().find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(least)
}

fn labels(low: f64, high: f64, step: f64, unit: f64) -> Vec<(f64, String)> {
    /// More than any axis has room for: what is out of proportion has no labels.
    const MOST: f64 = 1_000.0;
    let slack = 1e-6;
    let (first, last) = ((low / step - slack).ceil(), (high / step + slack).floor());
    if !(last - first <= MOST && step > 0.0) {
        return Vec::new();
    }
    let count = (last - first).max(-1.0) as i64 + 1;
    let label = |index: i64| {
        let at = (first + index as f64) * step;
        // Zero has no sign.
        (at + 0.0, number(at / unit + 0.0, Some(step / unit)))
    };
    (0..count).map(label).collect()
}

/// A number with as many decimals as a step needs.
fn number(value: f64, step: Option<f64>) -> String {
    let size = value.abs().max(step.unwrap_or_default());
    if value == 0.0 && !(1e-4..1e7).contains(&size) {
        return "0".into();
    }
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.2e}").replace(".00e", "e");
    }
    match step {
        Some(step) => {
            let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 9.0) as usize;
            format!("{value:.decimals$}")
        }
        None => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn says(ticks: &Ticks) -> Vec<&str> {
        ticks.labels.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn times_are_labelled_at_round_numbers_in_a_unit_that_fits() {
        let ticks = Ticks::of_times(-200e6, 1e9, 8);
        assert_eq!(says(&ticks), ["-200", "0", "200", "400", "600", "800", "1000"]);
        assert_eq!(ticks.unit, "ms");
        let ticks = Ticks::of_times(-1e6, 4e6, 5);
        assert_eq!((says(&ticks), ticks.unit), (vec!["-1", "0", "1", "2", "3", "4"], "ms"));
        let ticks = Ticks::of_times(-100e3, 400e3, 6);
        assert_eq!(says(&ticks), ["-100", "0", "100", "200", "300", "400"]);
        assert_eq!(ticks.unit, "us");
        let ticks = Ticks::of_times(0.0, 60e9, 6);
        assert_eq!((says(&ticks)[1], ticks.unit), ("10", "s"));
    }

    #[test]
    fn values_are_labelled_with_the_decimals_that_their_step_needs() {
        let of = |low, high, most| Ticks::of_values(Extremes { low, high }, most);
        assert_eq!(says(&of(0.0, 1.0, 4)), ["0.0", "0.5", "1.0"]);
        assert_eq!(says(&of(-0.02, 0.021, 4)), ["-0.02", "0.00", "0.02"]);
        assert_eq!(says(&of(0.0, 27648.0, 3)), ["0", "10000", "20000"]);
        assert_eq!(says(&of(0.0, 3e12, 3)), ["0", "1e12", "2e12", "3e12"]);
        assert_eq!(says(&of(3.5, 3.5, 3)), ["3.5"]);
        assert_eq!(says(&of(-1e308, 1e308, 4)), ["-1e308", "0", "1e308"]);
        assert_eq!(says(&of(f64::MIN, f64::MAX, 4)), ["-1e308", "0", "1e308"]);
        let of = |low, high, most| Ticks::of_whole_values(Extremes { low, high }, most);
        assert_eq!(says(&of(0.0, 1.0, 4)), ["0", "1"]);
        assert_eq!(says(&of(-3.0, 4.0, 4)), ["-2", "0", "2", "4"]);
        assert_eq!(says(&of(7.0, 7.0, 4)), ["7"]);
    }

    proptest! {
        #[test]
        fn an_axis_has_few_labels_and_all_lie_on_it(
            low in -1e9f64..1e9, span in 1e-6f64..1e9, most in 1usize..12,
        ) {
            let ticks = Ticks::of_values(Extremes { low, high: low + span }, most);
            prop_assert!(ticks.labels.len() <= most + 1, "{ticks:?}");
            let slack = span * 1e-5;
            for (at, _) in &ticks.labels {
                prop_assert!((low - slack..=low + span + slack).contains(at), "{at} {ticks:?}");
            }
        }
    }
}
