//! Axes: what they span, where their labels stand, and what these say.

use std::ops::Range;

use isochrone_timing::units::period;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

/// Times below this are drawn as this: a logarithmic axis has no zero.
pub(super) const LOWEST_NS: f64 = 10.0;
/// Decades up to which an axis has labels between the powers of ten.
const FEW_DECADES: f64 = 2.5;

/// An axis of a picture.
pub(super) struct Axis<'a, R> {
    pub(super) range: R,
    pub(super) says: &'a str,
    pub(super) label: &'a dyn Fn(&f64) -> String,
}

/// A logarithmic axis from a positive number to a higher one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Logarithmic {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Logarithmic {
    /// An axis with room for these positive numbers, and for no less than a decade.
    pub(super) fn around(numbers: impl IntoIterator<Item = f64>) -> Option<Self> {
        let extend = |(low, high): (f64, f64), number: f64| (low.min(number), high.max(number));
        let (low, high) = numbers.into_iter().fold((f64::INFINITY, 0.0), extend);
        (low <= high).then(|| Self { low: low / 1.5, high: (high * 1.5).max(low * 10.0 / 1.5) })
    }

    /// An axis with room for these times in ns.
    pub(super) fn of_times(times_ns: impl IntoIterator<Item = f64>) -> Self {
        let around = Self::around(times_ns.into_iter().map(|ns| ns.max(LOWEST_NS)));
        let Self { low, high } = around.unwrap_or(Self { low: LOWEST_NS, high: 1_000.0 });
        Self { low: low.max(LOWEST_NS), high }
    }
}

impl Logarithmic {
    /// These steps of each decade, as far as the axis has them.
    fn points(self, steps: &[f64]) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let points = decades.flat_map(|decade| steps.iter().map(move |s| s * 10f64.powi(decade)));
        // A power of ten may miss an end by the last bit.
        let inside =
            |point: &f64| (self.low * (1.0 - 1e-9)..=self.high * (1.0 + 1e-9)).contains(point);
        points.filter(inside).collect()
    }
}

impl Ranged for Logarithmic {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (low, high): (i32, i32)) -> i32 {
        let part = (value / self.low).ln() / (self.high / self.low).ln();
        low + (part * f64::from(high - low)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let most = hint.max_num_points();
        if (self.high / self.low).log10() <= FEW_DECADES {
            let points = self.points(&[1.0, 2.0, 5.0]);
            if points.len() <= most {
                return points;
            }
        }
        let decades = self.points(&[1.0]);
        let every = decades.len().div_ceil(most.max(1)).max(1);
        decades.into_iter().step_by(every).collect()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Logarithmic {}

/// An axis from 0 to this many nines, labelled `50 %`, `90 %`, `99 %`, `99.9 %` …
pub(super) struct Nines(pub(super) f64);

impl Ranged for Nines {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, nines: &f64, (low, high): (i32, i32)) -> i32 {
        low + ((nines / self.0) * f64::from(high - low)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let most = hint.max_num_points().max(1);
        let whole = (1u32..).map(f64::from).take_while(|nines| *nines <= self.0);
        let whole: Vec<f64> = whole.collect();
        let every = whole.len().div_ceil(most).max(1);
        let whole: Vec<f64> = whole.into_iter().step_by(every).collect();
        // The lowest labels stand closest to each other, and say the least.
        let room = most.saturating_sub(whole.len()).min(2);
        [0.0, 2f64.log10()].into_iter().skip(2 - room).chain(whole).collect()
    }

    fn range(&self) -> Range<f64> {
        0.0..self.0
    }
}

impl ValueFormatter<f64> for Nines {}

pub(super) fn as_percentile(nines: &f64) -> String {
    let decimals = (*nines as usize).saturating_sub(2);
    format!("{:.decimals$} %", 100.0 * (1.0 - 10f64.powf(-nines)))
}

/// A percentile without the unit, where that stands beside the axis.
pub(super) fn as_bare_percentile(nines: &f64) -> String {
    as_percentile(nines).replace(" %", "")
}

pub(super) fn as_time(ns: &f64) -> String {
    period(ns.round() as u64)
}

/// A part of a whole as `100 %`, `0.01 %`.
pub(super) fn as_part(part: &f64) -> String {
    let percent = 100.0 * part;
    let decimals = (-percent.log10()).ceil().clamp(0.0, 12.0) as usize;
    format!("{percent:.decimals$} %")
}

#[cfg(test)]
mod tests {
    use plotters::coord::ranged1d::LightPoints;

    use super::*;

    fn points(axis: &impl Ranged<ValueType = f64>) -> Vec<f64> {
        axis.key_points(LightPoints::new(10, 10))
    }

    #[test]
    fn percentiles_are_labelled_as_people_write_them() {
        let labels = points(&Nines(5.0));
        let labels: Vec<String> = labels.iter().map(as_percentile).collect();
        assert_eq!(labels, ["0 %", "50 %", "90 %", "99 %", "99.9 %", "99.99 %", "99.999 %"]);
    }

    #[test]
    fn a_wide_axis_has_the_powers_of_ten_and_a_narrow_one_also_2_and_5() {
        let labels = |low, high| -> Vec<String> {
            points(&Logarithmic { low, high }).iter().map(as_time).collect()
        };
        assert_eq!(labels(10.0, 20_000.0), ["10 ns", "100 ns", "1 us", "10 us"]);
        assert_eq!(labels(700.0, 6_000.0), ["1 us", "2 us", "5 us"]);
    }

    #[test]
    fn an_axis_with_room_for_few_labels_leaves_some_out() {
        let few = || LightPoints::new(4, 4);
        let labels = |axis: Logarithmic| -> Vec<String> {
            axis.key_points(few()).iter().map(as_time).collect()
        };
        assert_eq!(
            labels(Logarithmic { low: 10.0, high: 2e7 }),
            ["10 ns", "1 us", "100 us", "10 ms"]
        );
        assert_eq!(labels(Logarithmic { low: 700.0, high: 60_000.0 }), ["1 us", "10 us"]);
        let labels: Vec<String> =
            Nines(4.0).key_points(few()).iter().map(as_bare_percentile).collect();
        assert_eq!(labels, ["90", "99", "99.9", "99.99"]);
        assert_eq!(Nines(6.0).key_points(few()), [2f64.log10(), 1.0, 3.0, 5.0]);
    }

    #[test]
    fn an_axis_has_room_around_its_numbers_and_spans_a_decade() {
        let axis = Logarithmic::around([300.0, 300.0]).unwrap();
        assert!((axis.high / axis.low - 10.0).abs() < 1e-9, "{axis:?}");
        assert!(axis.low < 300.0 && axis.high > 300.0, "{axis:?}");
        assert_eq!(Logarithmic::around([]), None);
        assert_eq!(Logarithmic::of_times([0.0]).low, LOWEST_NS);
    }

    #[test]
    fn a_decade_of_an_axis_is_as_long_as_any_other() {
        let axis = Logarithmic { low: 10.0, high: 10_000.0 };
        assert_eq!(
            [10.0, 100.0, 1_000.0, 10_000.0].map(|ns| axis.map(&ns, (0, 300))),
            [0, 100, 200, 300]
        );
    }

    #[test]
    fn a_part_is_a_percentage_with_the_decimals_that_it_needs() {
        let labels = [1.0, 0.1, 0.01, 1e-3, 1e-6].map(|part| as_part(&part));
        assert_eq!(labels, ["100 %", "10 %", "1 %", "0.1 %", "0.0001 %"]);
    }
}
