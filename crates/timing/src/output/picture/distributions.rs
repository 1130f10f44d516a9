//! Pictures of distributions: percentiles and histograms.

use super::axis::{Axis, LOWEST_NS, Logarithmic, Nines, as_part, as_percentile, as_time};
use super::chart::{Chart, Form, Layer};
use super::ink::Ink;
use super::legend::Entry;
use crate::distribution::Distribution;

/// A distribution and what a picture calls it.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its samples.
    pub distribution: &'a Distribution,
}

/// Steps in which a curve of percentiles is drawn.
const STEPS_PER_NINE: u32 = 50;
/// Columns of a histogram for each factor of ten.
const BINS_PER_DECADE: f64 = 20.0;
/// How wide a curve is, in pixels.
const CURVE: Form = Form::Line(2);

/// Draws the percentiles of several distributions, both axes logarithmic: the tail is where they
/// differ. A curve ends where ten samples are left beyond it.
pub fn percentiles_svg(title: &str, series: &[Series<'_>]) -> String {
    let curves: Vec<Vec<(f64, f64)>> =
        series.iter().map(|series| percentiles(series.distribution)).collect();
    let nines = curves.iter().flatten().map(|(nines, _)| *nines).fold(1.0, f64::max);
    let times = Logarithmic::of_times(curves.iter().flatten().map(|(_, ns)| *ns));
    let chart = Chart {
        title,
        x: Axis { range: Nines(nines), says: "percentile", label: &as_percentile },
        y: Axis { range: times, says: "at most", label: &as_time },
        layers: layers(curves),
        legend: legend(series),
    };
    chart.svg()
}

/// Draws how often each time occurs, both axes logarithmic, in parts of all samples.
pub fn histogram_svg(title: &str, series: &[Series<'_>]) -> String {
    let mut outlines: Vec<Vec<(f64, f64)>> =
        series.iter().map(|series| outline(series.distribution)).collect();
    let times = Logarithmic::of_times(outlines.iter().flatten().map(|(ns, _)| *ns));
    let parts = outlines.iter().flatten().map(|(_, part)| *part).filter(|part| *part > 0.0);
    let lowest = parts.fold(1e-2, f64::min) / 2.0;
    // A logarithmic axis has no zero.
    outlines.iter_mut().flatten().for_each(|(_, part)| *part = part.max(lowest));
    let parts = Logarithmic { low: lowest, high: 1.0 };
    let chart = Chart {
        title,
        x: Axis { range: times, says: "time", label: &as_time },
        y: Axis { range: parts, says: "part of the samples", label: &as_part },
        layers: layers(outlines),
        legend: legend(series),
    };
    chart.svg()
}

fn layers(lines: Vec<Vec<(f64, f64)>>) -> Vec<Layer> {
    let layer = |(arm, points)| Layer { points, form: CURVE, ink: Ink::of(arm) };
    // Where lines coincide the first is seen.
    lines.into_iter().enumerate().map(layer).rev().collect()
}

fn legend(series: &[Series<'_>]) -> Vec<Entry> {
    let entry = |(arm, series): (usize, &Series<'_>)| Entry::new(CURVE, Ink::of(arm), series.name);
    series.iter().enumerate().map(entry).collect()
}

/// Points (nines, ns): one nine is the 90th percentile, two are the 99th.
fn percentiles(distribution: &Distribution) -> Vec<(f64, f64)> {
    let supported = (distribution.count() as f64 / 10.0).log10();
    let steps = (0u32..).map(|step| f64::from(step) / f64::from(STEPS_PER_NINE));
    let points = steps.take_while(|nines| *nines <= supported).map(|nines| {
        let ns = distribution.quantile(1.0 - 10f64.powf(-nines));
        (nines, (ns as f64).max(LOWEST_NS))
    });
    points.collect()
}

/// The steps (ns, part of the samples) around the columns of a histogram.
fn outline(distribution: &Distribution) -> Vec<(f64, f64)> {
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
