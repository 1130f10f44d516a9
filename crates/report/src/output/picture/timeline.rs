//! A picture of what happened when.

use isochrone_machine::Cause;
use isochrone_timing::Distribution;
use plotters::prelude::{BLACK, Color};

use super::axis::{Axis, LOWEST_NS, Logarithmic, as_time};
use super::chart::{Chart, Layer};
use super::form::Form;
use super::ink::Ink;
use super::legend::Entry;
use super::mark::Mark;
use super::screen::Screen;
use crate::report::{Outlier, TurnReport};

/// An arm of a bench, as shown on a timeline.
#[derive(Debug, Clone, Copy)]
pub struct Timeline<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its turns.
    pub turns: &'a [TurnReport],
    /// Its latest releases; without them the longest time of each turn is shown instead.
    pub outliers: &'a [Outlier],
}

/// The mark of a cause of an outlier.
const fn mark(cause: Cause) -> Mark {
    match cause {
        Cause::Steal => Mark::Triangle,
        Cause::Throttled => Mark::Square,
        Cause::Fault => Mark::Diamond,
        Cause::Preempted => Mark::Cross,
        Cause::Interrupt => Mark::Ring,
        Cause::Unknown => Mark::Dot,
    }
}

/// No bench takes longer: 30 years.
const LONGEST_S: f64 = 1e9;
const MEDIAN: Form = Form::Bars(4);
const TAIL: Form = Form::Bars(2);
const LONGEST: Form = Form::Marks(Mark::Wedge);

/// Draws the turns of several arms over the time of the bench: bars for p50 and p99 of each turn,
/// from its start to its end; gaps are turns of other arms. Marks show outliers, in the colour of
/// their arm and with a shape for each cause. Invalid turns are shaded.
pub fn timeline_svg(title: &str, arms: &[Timeline<'_>]) -> String {
    timeline_of(title, arms, Screen::Wide)
}

/// [`timeline_svg`] for a screen of any width.
pub(crate) fn timeline_of(title: &str, arms: &[Timeline<'_>], screen: Screen) -> String {
    let mut layers: Vec<Layer> =
        arms.iter().enumerate().flat_map(|(arm, of)| bars(arm, of)).collect();
    layers.extend(arms.iter().enumerate().flat_map(|(arm, of)| marks(arm, of)));
    let points = || layers.iter().flat_map(|layer| &layer.points);
    let end_s = points().map(|(s, _)| *s).fold(0.0, f64::max);
    let begin_s = points().map(|(s, _)| *s).fold(end_s, f64::min);
    let times = Logarithmic::of_times(points().map(|(_, ns)| *ns));
    // The shades lie below everything, and are as high as the picture.
    let shades = arms.iter().flat_map(|of| shades(of, times));
    let layers = shades.chain(layers).collect();
    let chart = Chart {
        title,
        x: Axis {
            range: begin_s..end_s.max(begin_s + 1.0),
            says: "time since the bench began, in s",
            label: &|s| format!("{s:.0} s"),
        },
        y: Axis { range: times, says: "time of a sample", label: &as_time },
        legend: legend(arms),
        layers,
    };
    chart.svg(screen)
}

fn begin_and_end(turn: &TurnReport) -> [f64; 2] {
    [turn.at_s, turn.at_s + turn.elapsed_ns as f64 / 1e9].map(seconds)
}

/// A time of a bench: a report may say anything, and the labels of an axis without end have none.
fn seconds(at_s: f64) -> f64 {
    if at_s.is_nan() { 0.0 } else { at_s.clamp(0.0, LONGEST_S) }
}

/// Both percentiles of each turn, from its begin to its end.
fn bars(arm: usize, of: &Timeline<'_>) -> Vec<Layer> {
    let (mut medians, mut tails, mut longest) = (Vec::new(), Vec::new(), Vec::new());
    for turn in of.turns {
        let Ok(samples) = Distribution::decode(&turn.histogram) else { continue };
        let summary = samples.summary();
        let high = |ns: u64| (ns as f64).max(LOWEST_NS);
        let flat = |ns: u64| begin_and_end(turn).map(|s| (s, high(ns)));
        medians.extend(summary.p50.into_iter().flat_map(flat));
        tails.extend(summary.p99.into_iter().flat_map(flat));
        let [begin, end] = begin_and_end(turn);
        longest.extend(summary.max.map(|ns| (f64::midpoint(begin, end), high(ns))));
    }
    let ink = Ink::of(arm);
    let mut layers = vec![
        Layer { points: medians, form: MEDIAN, ink },
        Layer { points: tails, form: TAIL, ink: ink.faint() },
    ];
    if of.outliers.is_empty() {
        layers.push(Layer { points: longest, form: LONGEST, ink });
    }
    layers
}

/// The outliers, cause by cause.
fn marks<'a>(arm: usize, of: &'a Timeline<'a>) -> impl Iterator<Item = Layer> + 'a {
    Cause::ALL.into_iter().map(move |cause| {
        let these = of.outliers.iter().filter(|outlier| outlier.cause == cause);
        let points =
            these.map(|outlier| (seconds(outlier.at_s), (outlier.late_ns as f64).max(LOWEST_NS)));
        Layer { points: points.collect(), form: Form::Marks(mark(cause)), ink: Ink::of(arm) }
    })
}

fn shades<'a>(of: &'a Timeline<'a>, times: Logarithmic) -> impl Iterator<Item = Layer> + 'a {
    of.turns.iter().filter(|turn| turn.invalid.is_some()).map(move |turn| {
        let [begin, end] = begin_and_end(turn);
        Layer {
            points: vec![(begin, times.low), (end, times.high)],
            form: Form::Shade,
            ink: shade(),
        }
    })
}

fn shade() -> Ink {
    Ink { colour: BLACK.mix(0.13), dash: None }
}

/// The arms, then what the bars and marks mean, as far as they occur.
fn legend(arms: &[Timeline<'_>]) -> Vec<Entry> {
    let named = |(arm, of): (usize, &Timeline<'_>)| Entry::new(MEDIAN, Ink::of(arm), of.name);
    let mut entries: Vec<Entry> = arms.iter().enumerate().map(named).collect();
    let grey = Ink::grey();
    if arms.iter().any(|of| !of.turns.is_empty()) {
        entries.push(Entry::new(MEDIAN, grey, "p50 of a turn"));
        entries.push(Entry::new(TAIL, grey.faint(), "p99 of a turn"));
    }
    if arms.iter().any(|of| of.outliers.is_empty() && !of.turns.is_empty()) {
        entries.push(Entry::new(LONGEST, grey, "longest of a turn"));
    }
    let outliers = || arms.iter().flat_map(|of| of.outliers);
    for cause in Cause::ALL {
        if outliers().any(|outlier| outlier.cause == cause) {
            entries.push(Entry::new(Form::Marks(mark(cause)), grey, cause.as_str()));
        }
    }
    if arms.iter().flat_map(|of| of.turns).any(|turn| turn.invalid.is_some()) {
        entries.push(Entry::new(Form::Shade, shade(), "invalid turn"));
    }
    entries
}

#[cfg(test)]
mod tests {
    use isochrone_machine::Disturbance;

    use super::*;
    use crate::bench::Turns;

    fn turns(disturbances: &[Disturbance]) -> Vec<TurnReport> {
        let mut samples = Distribution::new();
        samples.record_many(900, 990);
        samples.record_many(60_000, 10);
        let mut turns = Turns::default();
        for (turn, disturbance) in disturbances.iter().enumerate() {
            turns.push(turn as f64 * 2.0, 1_000_000_000, &samples, 0, *disturbance);
        }
        turns.reports().to_vec()
    }

    fn outlier(cause: Cause) -> Outlier {
        Outlier { at_s: 0.5, late_ns: 60_000, cause }
    }

    fn shown(outliers: &[Outlier], turns: &[TurnReport]) -> String {
        timeline_svg("Jitter", &[Timeline { name: "hybrid", turns, outliers }])
    }

    #[test]
    fn the_bars_of_a_turn_begin_and_end_with_it() {
        let turns = turns(&[Disturbance::default(); 2]);
        let bars = bars(0, &Timeline { name: "", turns: &turns, outliers: &[] });
        for form in [MEDIAN, TAIL] {
            let points = &bars.iter().find(|layer| layer.form == form).unwrap().points;
            assert_eq!(points.iter().map(|(s, _)| *s).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0]);
        }
    }

    #[test]
    fn every_cause_has_a_mark_of_its_own() {
        for (index, cause) in Cause::ALL.into_iter().enumerate() {
            let earlier = &Cause::ALL[..index];
            assert!(earlier.iter().all(|other| mark(*other) != mark(cause)), "{cause:?}");
            assert_ne!(
                Form::Marks(mark(cause)),
                LONGEST,
                "what is longest says nothing of a cause"
            );
        }
    }

    #[test]
    fn the_legend_names_the_causes_that_occur_and_no_others() {
        let svg =
            shown(&[Cause::Steal, Cause::Unknown].map(outlier), &turns(&[Disturbance::default()]));
        assert!(svg.contains(">\nsteal\n<") && svg.contains(">\nunknown\n<"), "{svg}");
        assert!(!svg.contains("preempted"), "{svg}");
        assert!(!svg.contains("invalid") && !svg.contains("longest"), "{svg}");
    }

    #[test]
    fn an_invalid_turn_is_shaded_and_one_without_outliers_shows_its_longest() {
        let fault = Disturbance { faults: Some(1), ..Disturbance::default() };
        let turns = turns(&[Disturbance::default(), fault]);
        let svg = shown(&[], &turns);
        assert!(svg.contains("invalid turn") && svg.contains("longest of a turn"), "{svg}");
        let longest = |layer: &&Layer| layer.form == LONGEST;
        let bars = bars(0, &Timeline { name: "", turns: &turns, outliers: &[] });
        assert_eq!(bars.iter().find(longest).unwrap().points.len(), 2);
    }

    #[test]
    fn a_percentile_that_the_samples_of_a_turn_do_not_support_is_not_drawn() {
        let mut samples = Distribution::new();
        samples.record_many(900, 99);
        let mut few = Turns::default();
        few.push(0.0, 1_000_000_000, &samples, 0, Disturbance::default());
        let bars = bars(0, &Timeline { name: "", turns: few.reports(), outliers: &[] });
        let points = |form: Form| bars.iter().find(|l| l.form == form).unwrap().points.len();
        assert_eq!((points(MEDIAN), points(TAIL)), (2, 0));
    }

    #[test]
    fn numbers_that_no_bench_writes_still_give_a_picture() {
        for at_s in [-5.0, 1e300, f64::MAX, f64::INFINITY, f64::NAN] {
            let mut turns = turns(&[Disturbance { faults: Some(1), ..Disturbance::default() }]);
            turns[0].at_s = at_s;
            turns[0].elapsed_ns = u64::MAX;
            let outliers = [Outlier { at_s, late_ns: u64::MAX, cause: Cause::Unknown }];
            assert!(shown(&outliers, &turns).contains("</svg>"), "{at_s}");
        }
    }

    #[test]
    fn a_timeline_of_nothing_is_an_empty_frame() {
        assert!(timeline_svg("Nothing", &[]).contains("</svg>"));
        assert!(shown(&[], &[]).contains("</svg>"));
    }
}
