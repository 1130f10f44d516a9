//! Pictures of distributions: percentiles and histograms.

use isochrone_timing::Distribution;

use super::axis::{
    Axis, LOWEST_NS, Logarithmic, Nines, as_bare_percentile, as_part, as_percentile, as_time,
};
use super::chart::{Chart, Layer};
use super::form::Form;
use super::ink::Ink;
use super::legend::Entry;
use super::mark::Mark;
use super::screen::Screen;

/// A distribution with its name in a picture.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its samples.
    pub distribution: &'a Distribution,
}

/// A distribution of an arm.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve<'a> {
    /// The place of the arm among those of its group: all pictures of the group draw it alike.
    pub(crate) arm: usize,
    /// Whether it is of the arm's corrected times.
    pub(crate) corrected: bool,
    pub(crate) series: Series<'a>,
}

impl Curve<'_> {
    fn ink(&self) -> Ink {
        let ink = Ink::of(self.arm);
        if self.corrected { ink.corrected() } else { ink }
    }
}

type Points = Vec<(f64, f64)>;

/// Samples that a point of a curve needs beyond it.
const FEWEST_BEYOND: u64 = 10;
/// Steps in which a curve of percentiles is drawn.
const STEPS_PER_NINE: u32 = 50;
/// Columns of a histogram for each factor of ten.
const BINS_PER_DECADE: f64 = 20.0;
/// How wide a curve is, in pixels.
const CURVE: Form = Form::Line(2);
const LONGEST: Form = Form::Marks(Mark::Wedge);

/// Draws the percentiles of several distributions on two logarithmic axes, because they differ in
/// the tail. A curve ends where ten samples remain beyond it; a separate mark shows the longest
/// sample, at the percentile that only it exceeds.
pub fn percentiles_svg(title: &str, series: &[Series<'_>]) -> String {
    percentiles_of(title, &each_an_arm(series), Screen::Wide)
}

/// Draws how often each time occurs, as a fraction of all samples, on two logarithmic axes.
pub fn histogram_svg(title: &str, series: &[Series<'_>]) -> String {
    histogram_of(title, &each_an_arm(series), Screen::Wide)
}

fn each_an_arm<'a>(series: &[Series<'a>]) -> Vec<Curve<'a>> {
    let curve =
        |(arm, series): (usize, &Series<'a>)| Curve { arm, corrected: false, series: *series };
    series.iter().enumerate().map(curve).collect()
}

/// [`percentiles_svg`] of arms that may have more than one curve.
pub(crate) fn percentiles_of(title: &str, curves: &[Curve<'_>], screen: Screen) -> String {
    let drawn: Vec<(Points, Ink)> =
        curves.iter().map(|curve| (percentiles(curve.series.distribution), curve.ink())).collect();
    let longest = curves
        .iter()
        .filter_map(|curve| Some((vec![longest(curve.series.distribution)?], curve.ink())));
    let longest: Vec<(Points, Ink)> = longest.collect();
    let points = || drawn.iter().chain(&longest).flat_map(|(points, _)| points);
    // With room for the marks at the end.
    let nines = 1.03 * points().map(|(nines, _)| *nines).fold(1.0, f64::max);
    let times = Logarithmic::of_times(points().map(|(_, ns)| *ns));
    let mut legend = legend(curves);
    if !longest.is_empty() {
        legend.push(Entry::new(LONGEST, Ink::grey(), "longest"));
    }
    let x = match screen {
        Screen::Wide => Axis { range: Nines(nines), says: "percentile", label: &as_percentile },
        Screen::Narrow => {
            Axis { range: Nines(nines), says: "percentile, in %", label: &as_bare_percentile }
        }
    };
    let chart = Chart {
        title,
        x,
        y: Axis { range: times, says: "at most", label: &as_time },
        layers: layers(CURVE, drawn).chain(layers(LONGEST, longest)).collect(),
        legend,
    };
    chart.svg(screen)
}

/// [`histogram_svg`] of arms that may have more than one curve.
pub(crate) fn histogram_of(title: &str, curves: &[Curve<'_>], screen: Screen) -> String {
    let mut outlines: Vec<(Points, Ink)> =
        curves.iter().map(|curve| (outline(curve.series.distribution), curve.ink())).collect();
    let points = || outlines.iter().flat_map(|(points, _)| points);
    let times = Logarithmic::of_times(points().map(|(ns, _)| *ns));
    let parts = points().map(|(_, part)| *part).filter(|part| *part > 0.0);
    let lowest = parts.fold(1e-2, f64::min) / 2.0;
    // A logarithmic axis has no zero.
    for (_, part) in outlines.iter_mut().flat_map(|(points, _)| points) {
        *part = part.max(lowest);
    }
    // With room below the title for the label of the highest.
    let parts = Logarithmic { low: lowest, high: 1.5 };
    let chart = Chart {
        title,
        x: Axis { range: times, says: "time", label: &as_time },
        y: Axis { range: parts, says: "part of the samples", label: &as_part },
        layers: layers(CURVE, outlines).collect(),
        legend: legend(curves),
    };
    chart.svg(screen)
}

fn layers(form: Form, drawn: Vec<(Points, Ink)>) -> impl Iterator<Item = Layer> {
    // Where lines coincide the first is seen.
    drawn.into_iter().rev().map(move |(points, ink)| Layer { points, form, ink })
}

fn legend(curves: &[Curve<'_>]) -> Vec<Entry> {
    curves.iter().map(|curve| Entry::new(CURVE, curve.ink(), curve.series.name)).collect()
}

/// Where the longest sample of a distribution stands; nowhere where there is no curve either.
fn longest(distribution: &Distribution) -> Option<(f64, f64)> {
    let count = distribution.count();
    let ns = distribution.quantile(1.0) as f64;
    (count >= FEWEST_BEYOND).then(|| ((count as f64).log10(), ns.max(LOWEST_NS)))
}

/// Points (nines, ns): one nine is the 90th percentile, two are the 99th.
fn percentiles(distribution: &Distribution) -> Points {
    let supported = (distribution.count() as f64 / FEWEST_BEYOND as f64).log10();
    let steps = (0u32..).map(|step| f64::from(step) / f64::from(STEPS_PER_NINE));
    let points = steps.take_while(|nines| *nines <= supported).map(|nines| {
        let ns = distribution.quantile(1.0 - 10f64.powf(-nines));
        (nines, (ns as f64).max(LOWEST_NS))
    });
    points.collect()
}

/// The steps (ns, part of the samples) around the columns of a histogram.
fn outline(distribution: &Distribution) -> Points {
    let bin = |ns: f64| (ns.max(LOWEST_NS).log10() * BINS_PER_DECADE).floor() as i32;
    let edge = |bin: i32| 10f64.powf(f64::from(bin) / BINS_PER_DECADE);
    let mut columns = std::collections::BTreeMap::<i32, u64>::new();
    for (ns, count) in distribution.buckets() {
        *columns.entry(bin(ns as f64)).or_default() += count;
    }
    let (Some((first, _)), Some((last, _))) = (columns.first_key_value(), columns.last_key_value())
    else {
        return Vec::new();
    };
    let all = distribution.count() as f64;
    let part = |bin: i32| columns.get(&bin).copied().unwrap_or(0) as f64 / all;
    let steps =
        (*first..=*last).flat_map(|bin| [(edge(bin), part(bin)), (edge(bin + 1), part(bin))]);
    let ends = ((edge(*first), 0.0), (edge(*last + 1), 0.0));
    std::iter::once(ends.0).chain(steps).chain([ends.1]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(count: u64) -> Distribution {
        let mut distribution = Distribution::new();
        (0..count).for_each(|ns| distribution.record(ns * 100));
        distribution
    }

    #[test]
    fn a_curve_ends_where_ten_samples_are_left_beyond_it() {
        let (nines, _) = *percentiles(&ramp(10_000)).last().unwrap();
        assert_eq!(nines, 3.0);
        assert!(percentiles(&ramp(0)).is_empty());
    }

    #[test]
    fn the_longest_sample_stands_a_factor_of_ten_behind_the_end_of_its_curve() {
        let distribution = ramp(10_000);
        let (end, _) = *percentiles(&distribution).last().unwrap();
        let (nines, ns) = longest(&distribution).unwrap();
        assert_eq!((nines, end), (4.0, 3.0));
        assert_eq!(Some(ns as u64), distribution.summary().max);
        assert_eq!(longest(&ramp(9)), None, "there is no curve");
    }

    #[test]
    fn corrected_times_take_no_colour_from_the_arms_behind_them() {
        let distribution = ramp(100);
        let series = Series { name: "", distribution: &distribution };
        let ink = |arm, corrected| Curve { arm, corrected, series }.ink();
        assert_eq!(ink(0, true).colour, ink(0, false).colour);
        assert_eq!(ink(1, false), Ink::of(1));
    }

    #[test]
    fn a_curve_passes_through_the_percentiles() {
        let distribution = ramp(100_000);
        let curve = percentiles(&distribution);
        for (nines, quantile) in [(1.0, 0.9), (2.0, 0.99), (3.0, 0.999)] {
            let (_, ns) = curve.iter().find(|(x, _)| (x - nines).abs() < 1e-9).unwrap();
            assert_eq!(*ns as u64, distribution.quantile(quantile));
        }
    }

    #[test]
    fn the_columns_of_a_histogram_hold_all_samples() {
        let outline = outline(&ramp(5_000));
        // Each column has two corners, and the outline begins and ends on the ground.
        let sum: f64 = outline.iter().skip(1).step_by(2).map(|(_, part)| part).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn a_picture_names_its_series_and_stands_alone() {
        let distribution = ramp(100_000);
        let series = [Series { name: "hybrid", distribution: &distribution }];
        for svg in [percentiles_svg("Jitter", &series), histogram_svg("Jitter", &series)] {
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{svg}");
            assert!(svg.contains("hybrid") && svg.contains("Jitter"), "{svg}");
            assert!(!svg.contains("href"), "{svg}");
        }
    }

    #[test]
    fn a_picture_of_nothing_is_an_empty_frame() {
        assert!(percentiles_svg("Nothing", &[]).contains("</svg>"));
        let empty = Distribution::new();
        assert!(
            histogram_svg("", &[Series { name: "a", distribution: &empty }]).contains("</svg>")
        );
    }
}
