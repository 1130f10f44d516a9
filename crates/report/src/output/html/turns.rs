//! The sections of what disturbed the arms: invalid turns and outliers.

use isochrone_timing::units::duration;

use super::page::{Column, Page, Row};
use crate::bench::{Outlier, Reported};
use crate::report::Report;

/// Outliers that the page lists.
const OUTLIERS: usize = 20;

/// The turns that are invalid, and why.
pub(super) fn invalid(page: &mut Page, report: &Report) {
    let tasks = report.tasks.iter().flat_map(invalid_of);
    let links = report.links.iter().flat_map(invalid_of);
    let costs = report.costs.iter().flat_map(invalid_of);
    let mut rows = tasks.chain(links).chain(costs).peekable();
    if rows.peek().is_none() {
        return;
    }
    page.markup("<section>\n<h2>Invalid turns</h2>\n");
    let columns = [
        Column::Words("arm"),
        Column::Number("began at"),
        Column::Number("samples"),
        Column::Number("missed or lost"),
        Column::Words("reason"),
    ];
    page.table("Shown in raw, left out of valid and of the comparisons", &columns, rows);
    page.markup("</section>\n");
}

fn invalid_of<R: Reported>(arm: &R) -> impl Iterator<Item = Row> {
    arm.turns().iter().filter_map(|turn| {
        Some(Row::of([
            arm.label(),
            format!("{:.1} s", turn.at_s),
            turn.samples.to_string(),
            turn.missed.to_string(),
            turn.invalid.clone()?,
        ]))
    })
}

/// The largest outliers of all arms.
pub(super) fn outliers(page: &mut Page, report: &Report) {
    let mut outliers: Vec<(String, &Outlier)> = Vec::new();
    for task in &report.tasks {
        outliers.extend(task.outliers.iter().map(|outlier| (task.label(), outlier)));
    }
    if outliers.is_empty() {
        return;
    }
    outliers.sort_by_key(|(_, outlier)| std::cmp::Reverse(outlier.late_ns));
    outliers.truncate(OUTLIERS);
    page.markup("<section>\n<h2>Largest outliers</h2>\n");
    page.markup(
        "<p>The cause is what the kernel counted around the release, the most telling first: the \
         host took the CPU (<b>steal</b>), a limit on CPU time (<b>throttled</b>), a page \
         <b>fault</b>, the CPU given to somebody else (<b>preempted</b>), an <b>interrupt</b>. \
         <b>Unknown</b>: it counted nothing.</p>\n",
    );
    let columns = [
        Column::Words("arm"),
        Column::Number("at"),
        Column::Number("late by"),
        Column::Words("cause"),
    ];
    let rows = outliers.into_iter().map(|(label, Outlier { at_s, late_ns, cause })| {
        Row::of([label, format!("{at_s:.3} s"), duration(*late_ns as f64), cause.clone()])
    });
    page.table("Seconds count from the beginning of the bench", &columns, rows);
    page.markup("</section>\n");
}
