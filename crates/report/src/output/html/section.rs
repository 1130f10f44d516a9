//! The common parts of all sections of measured arms: percentiles, comparisons and pictures.

use isochrone_timing::units::duration;
use isochrone_timing::{Distribution, Summary};

use super::page::{Page, Row, TableColumn};
use crate::bench::{Comparison, LeftOut, Verdict, interval_in_words, ratio_in_words};
use crate::output::groups::{
    COLUMNS, arm_of, columns, metric_name, percentile_name, sentence, value,
};
use crate::output::picture::{Curve, Series, Timeline, histogram_of, percentiles_of, timeline_of};

/// Stands where the samples are too few.
const TOO_FEW: &str = "\u{2013}";

/// Begins a section under a heading.
pub(super) fn begin(page: &mut Page, heading: &str) {
    let mut letters = heading.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    page.markup("<section>\n");
    page.heading(first.chain(letters).collect::<String>());
}

pub(super) fn percentile_columns() -> impl Iterator<Item = TableColumn> {
    COLUMNS.into_iter().map(TableColumn::Number)
}

/// The cells under [`percentile_columns`].
pub(super) fn percentiles(summary: &Summary) -> impl Iterator<Item = String> + use<> {
    columns(summary).into_iter().map(|ns| cell(ns.map(|ns| duration(ns as f64))))
}

/// A cell whose value may be unknown.
pub(super) fn cell(value: Option<String>) -> String {
    value.unwrap_or_else(|| TOO_FEW.to_owned())
}

/// How arms compare, percentile by percentile.
pub(super) fn comparisons(page: &mut Page, circumstances: &str, comparisons: &[&Comparison]) {
    let columns = [
        TableColumn::Words("arm"),
        TableColumn::Words("percentile"),
        TableColumn::Number("time"),
        TableColumn::Words("compared with"),
        TableColumn::Number("its time"),
        TableColumn::Number("ratio"),
        TableColumn::Number("99 % interval"),
        TableColumn::Words("verdict"),
    ];
    let rows = comparisons.iter().map(|comparison| {
        let Comparison { metric, verdict, ratio, low, high, .. } = comparison;
        let class = match verdict {
            Verdict::Better => "better",
            Verdict::Same => "same",
            Verdict::Worse => "worse",
        };
        let cells = [
            arm_of(&comparison.candidate, circumstances).to_owned(),
            percentile_name(&comparison.percentile).to_owned(),
            value(metric, comparison.candidate_value),
            arm_of(&comparison.reference, circumstances).to_owned(),
            value(metric, comparison.reference_value),
            ratio_in_words(*ratio),
            interval_in_words(*ratio, *low, *high),
            verdict.as_str().to_owned(),
        ];
        Row { class, ..Row::of(cells) }
    });
    let metric = comparisons.first().map_or("", |comparison| metric_name(&comparison.metric));
    page.table(format!("Comparison of the {metric}, of the valid turns"), &columns, rows);
}

/// What could not be compared, and how much longer to run.
pub(super) fn left_out(page: &mut Page, left_out: &[LeftOut]) {
    if left_out.is_empty() {
        return;
    }
    page.markup("<section>\n");
    page.heading("Not compared");
    page.markup("<ul>\n");
    for missing in left_out {
        page.element("<li>", sentence(missing), "</li>\n");
    }
    page.markup("</ul>\n</section>\n");
}

/// A distribution of an arm of a group, as pictures show it.
pub(super) struct ShownDistribution {
    /// The place of the arm in the group.
    pub(super) arm: usize,
    /// Whether it is of the corrected times.
    pub(super) corrected: bool,
    pub(super) name: String,
    pub(super) distribution: Distribution,
}

impl ShownDistribution {
    fn curve(&self) -> Curve<'_> {
        let Self { arm, corrected, name, distribution } = self;
        Curve { arm: *arm, corrected: *corrected, series: Series { name, distribution } }
    }
}

/// The percentiles of a group; once on a page.
pub(super) fn percentiles_picture(
    page: &mut Page,
    heading: &str,
    distributions: &[ShownDistribution],
) {
    let curves: Vec<Curve<'_>> = distributions.iter().map(ShownDistribution::curve).collect();
    let title = format!("Percentiles: {heading}");
    if !curves.is_empty() && page.pictures.iter().all(|(shows, _)| *shows != title) {
        page.picture(&title, |screen| percentiles_of(&title, &curves, screen));
    }
}

/// The pictures of a group: its distributions, and its turns over time if it took any.
pub(super) fn pictures(
    page: &mut Page,
    heading: &str,
    distributions: &[ShownDistribution],
    turns: &[Timeline<'_>],
) {
    let curves: Vec<Curve<'_>> = distributions.iter().map(ShownDistribution::curve).collect();
    if !curves.is_empty() {
        percentiles_picture(page, heading, distributions);
        let title = format!("Histogram: {heading}");
        page.picture(&title, |screen| histogram_of(&title, &curves, screen));
    }
    if turns.iter().any(|arm| !arm.turns.is_empty()) {
        let title = format!("Over time: {heading}");
        page.picture(&title, |screen| timeline_of(&title, turns, screen));
    }
}
