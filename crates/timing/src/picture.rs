//! Pictures of distributions, as SVG.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{
    AsRangedCoord, KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter,
};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::distribution::Distribution;
use crate::units::period;

/// A distribution and what a picture calls it.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its samples.
    pub distribution: &'a Distribution,
}

const SIZE: (u32, u32) = (880, 460);
/// Wong's palette: told apart by people who see colours differently.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
/// Steps in which a curve of percentiles is drawn.
const STEPS_PER_NINE: u32 = 50;
/// Columns of a histogram for each factor of ten.
const BINS_PER_DECADE: f64 = 20.0;
/// Times below this are drawn as this: a logarithmic axis has no zero.
const LOWEST_NS: f64 = 10.0;

type Failure = DrawingAreaErrorKind<std::io::Error>;

/// Draws the percentiles of several distributions, both axes logarithmic: the tail is where they
/// differ. A curve ends where ten samples are left beyond it.
pub fn percentiles_svg(title: &str, series: &[Series<'_>]) -> String {
    let curves: Vec<Vec<(f64, f64)>> =
        series.iter().map(|series| percentiles(series.distribution)).collect();
    let nines = curves.iter().flatten().map(|(nines, _)| *nines).fold(1.0, f64::max);
    let highest = curves.iter().flatten().map(|(_, ns)| *ns).fold(1_000.0, f64::max);
    let picture = Lines {
        title,
        series,
        x: Axis { range: Nines(nines), says: "percentile", label: &as_percentile },
        y: Axis { range: times(highest), says: "at most", label: &as_time },
        legend: SeriesLabelPosition::UpperLeft,
    };
    picture.draw(curves)
}

/// Draws how often each time occurs, both axes logarithmic, in parts of all samples.
pub fn histogram_svg(title: &str, series: &[Series<'_>]) -> String {
    let outlines: Vec<Vec<(f64, f64)>> =
        series.iter().map(|series| outline(series.distribution)).collect();
    let highest = outlines.iter().flatten().map(|(ns, _)| *ns).fold(1_000.0, f64::max);
    let parts = outlines.iter().flatten().map(|(_, part)| *part).filter(|part| *part > 0.0);
    let lowest = parts.fold(1e-2, f64::min) / 2.0;
    let parts = (lowest..1.0).log_scale();
    let picture = Lines {
        title,
        series,
        x: Axis { range: times(highest), says: "time", label: &as_time },
        y: Axis { range: parts, says: "part of the samples", label: &|part| format!("{part:.0e}") },
        legend: SeriesLabelPosition::UpperRight,
    };
    let visible = |outline: Vec<(f64, f64)>| {
        outline.into_iter().map(|(ns, part)| (ns, part.max(lowest))).collect()
    };
    picture.draw(outlines.into_iter().map(visible).collect())
}

/// A logarithmic axis of times, up to a little more than the longest.
fn times(highest_ns: f64) -> impl AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>> {
    (LOWEST_NS..highest_ns * 1.5).log_scale()
}

fn as_time(ns: &f64) -> String {
    period(*ns as u64)
}

/// An axis of a picture.
struct Axis<'a, R> {
    range: R,
    says: &'a str,
    label: &'a dyn Fn(&f64) -> String,
}

/// A picture with a line for each of several series.
struct Lines<'a, X, Y> {
    title: &'a str,
    series: &'a [Series<'a>],
    x: Axis<'a, X>,
    y: Axis<'a, Y>,
    legend: SeriesLabelPosition,
}

impl<X, Y> Lines<'_, X, Y>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    /// Draws the picture with these lines, one for each series.
    fn draw(self, lines: Vec<Vec<(f64, f64)>>) -> String {
        let mut text = String::new();
        let is_empty = self.series.is_empty();
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        let drawn = self.draw_on(&area, lines);
        drop(area);
        // A string takes everything; a picture without a single sample has only its frame.
        debug_assert!(drawn.is_ok() || is_empty);
        text
    }

    fn draw_on(
        self,
        area: &DrawingArea<SVGBackend<'_>, Shift>,
        lines: Vec<Vec<(f64, f64)>>,
    ) -> Result<(), Failure> {
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(area)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(76)
            .build_cartesian_2d(self.x.range, self.y.range)?;
        chart
            .configure_mesh()
            .x_desc(self.x.says)
            .y_desc(self.y.says)
            .x_label_formatter(self.x.label)
            .y_label_formatter(self.y.label)
            .light_line_style(WHITE)
            .label_style(("sans-serif", 13))
            .draw()?;
        for (index, (series, line)) in self.series.iter().zip(lines).enumerate() {
            let style = ShapeStyle { stroke_width: 2, ..colour(index).into() };
            chart
                .draw_series(LineSeries::new(line, style))?
                .label(series.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
        }
        chart
            .configure_series_labels()
            .position(self.legend)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(
                ("sans-serif", 14)
                    .into_font()
                    .with_anchor::<RGBColor>(Pos::new(HPos::Left, VPos::Top)),
            )
            .draw()?;
        area.present()
    }
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

fn colour(index: usize) -> RGBColor {
    COLOURS.get(index % COLOURS.len()).copied().unwrap_or(BLACK)
}

/// An axis from 0 to this many nines, labelled `50 %`, `90 %`, `99 %`, `99.9 %` …
struct Nines(f64);

impl Ranged for Nines {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, nines: &f64, (low, high): (i32, i32)) -> i32 {
        low + ((nines / self.0) * f64::from(high - low)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        let whole = (1u32..).map(f64::from).take_while(|nines| *nines <= self.0);
        [0.0, 2f64.log10()].into_iter().chain(whole).collect()
    }

    fn range(&self) -> std::ops::Range<f64> {
        0.0..self.0
    }
}

impl ValueFormatter<f64> for Nines {}

fn as_percentile(nines: &f64) -> String {
    let decimals = (*nines as usize).saturating_sub(2);
    format!("{:.decimals$} %", 100.0 * (1.0 - 10f64.powf(-nines)))
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
    fn percentiles_are_labelled_as_people_write_them() {
        let labels = Nines(5.0).key_points(plotters::coord::ranged1d::LightPoints::new(10, 10));
        let labels: Vec<String> = labels.iter().map(as_percentile).collect();
        assert_eq!(labels, ["0 %", "50 %", "90 %", "99 %", "99.9 %", "99.99 %", "99.999 %"]);
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
