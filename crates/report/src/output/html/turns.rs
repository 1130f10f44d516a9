//! The sections of what disturbed the arms: invalid turns and outliers.

use isochrone_timing::units::duration;

use super::page::{Page, Row, TableColumn};
use crate::bench::Reported;
use crate::report::{Outlier, Report, TaskArm};

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
    page.markup("<section>\n");
    page.heading("Invalid turns");
    let columns = [
        TableColumn::Words("arm"),
        TableColumn::Number("began at"),
        TableColumn::Number("samples"),
        TableColumn::Number("missed or lost"),
        TableColumn::Words("reason"),
    ];
    page.table("Included in raw, excluded from valid and from comparisons", &columns, rows);
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

/// Late releases of an arm that one stall explains: those of cycles that follow each other.
struct Stall<'a> {
    label: String,
    longest: &'a Outlier,
    releases: usize,
}

/// The stalls of an arm, from its outliers.
fn stalls(task: &TaskArm) -> Vec<Stall<'_>> {
    let mut outliers: Vec<&Outlier> = task.outliers.iter().collect();
    outliers.sort_by(|one, other| one.at_s.total_cmp(&other.at_s));
    // Cycles that follow each other begin a period apart, and late ones closer.
    let apart_s = 1.5 * task.task.period_ns as f64 / 1e9;
    let follow = |one: &&Outlier, other: &&Outlier| other.at_s - one.at_s <= apart_s;
    let mut found = Vec::new();
    for same in outliers.chunk_by(follow) {
        if let Some(longest) = same.iter().copied().max_by_key(|outlier| outlier.late_ns) {
            found.push(Stall { label: task.label(), longest, releases: same.len() });
        }
    }
    found
}

/// The longest stalls of all arms.
pub(super) fn outliers(page: &mut Page, report: &Report) {
    let mut stalls: Vec<Stall<'_>> = report.tasks.iter().flat_map(stalls).collect();
    if stalls.is_empty() {
        return;
    }
    stalls.sort_by_key(|stall| std::cmp::Reverse(stall.longest.late_ns));
    stalls.truncate(OUTLIERS);
    page.markup("<section>\n");
    page.heading("Largest outliers");
    page.markup(
        "<p>The cause is the first of these that the kernel counted around the release: the host \
         took the CPU (<b>steal</b>), a limit on CPU time applied (<b>throttled</b>), a page \
         <b>fault</b>, another thread got the CPU (<b>preempted</b>), an <b>interrupt</b>. \
         <b>Unknown</b> means that it counted none of them.</p>\n",
    );
    let columns = [
        TableColumn::Words("arm"),
        TableColumn::Number("at"),
        TableColumn::Number("late by"),
        TableColumn::Number("releases"),
        TableColumn::Words("cause"),
    ];
    let rows = stalls.into_iter().map(|Stall { label, longest, releases }| {
        let Outlier { at_s, late_ns, cause } = longest;
        let (at, late) = (format!("{at_s:.3} s"), duration(*late_ns as f64));
        Row::of([label, at, late, releases.to_string(), cause.as_str().to_owned()])
    });
    page.table("Seconds count from the start of the bench", &columns, rows);
    page.markup("</section>\n");
}
