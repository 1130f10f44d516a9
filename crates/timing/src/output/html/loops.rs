//! The sections of the loops: release jitter, group by group.

use super::page::{Column, Page, Row};
use super::section::{self, Shown, comparisons, percentile_columns, percentiles};
use crate::bench::Reported;
use crate::output::groups::{Group, groups, metric_name, release_jitter};
use crate::output::picture::Timeline;
use crate::report::{Report, TaskReport};
use crate::units::duration;

pub(super) fn sections(page: &mut Page, report: &Report) {
    for group in groups(&report.tasks, &report.comparisons) {
        let heading = group.heading(metric_name(TaskReport::METRIC));
        section::begin(page, &heading);
        summary(page, &group);
        comparisons(page, &group.circumstances, &group.comparisons);
        pictures(page, &heading, &group);
        how_they_ran(page, &group);
        page.markup("</section>\n");
    }
}

fn summary(page: &mut Page, group: &Group<'_, TaskReport>) {
    let mut columns = vec![Column::Words("arm"), Column::Words("of"), Column::Number("samples")];
    columns.extend(percentile_columns());
    columns.extend(["missed", "CPU"].map(Column::Number));
    let rows = group.arms.iter().flat_map(|task| {
        release_jitter(task).into_iter().enumerate().map(|(index, (kind, summary))| {
            let cells = [task.name.clone(), kind.to_owned(), summary.count.to_string()];
            let cells = cells.into_iter().chain(percentiles(summary));
            match index {
                0 => Row::of(cells.chain([
                    task.missed.to_string(),
                    format!("{:.1} %", 100.0 * task.cpu_fraction),
                ])),
                _ => Row { class: "sub", ..Row::of(cells.chain([String::new(), String::new()])) },
            }
        })
    });
    page.table("Release jitter", &columns, rows);
    // The loops of a bench do next to nothing; in a run these say whether the work fits.
    let runs = group.arms.iter().filter(|task| task.blocks.is_empty());
    let mut columns = vec![Column::Words("task"), Column::Words("time"), Column::Number("samples")];
    columns.extend(percentile_columns());
    let rows = runs.flat_map(|task| {
        let times = [
            ("execution", &task.execution_ns),
            ("response", &task.response_ns),
            ("period error", &task.period_error_ns),
        ];
        times.map(|(time, summary)| {
            let cells = [task.name.clone(), time.to_owned(), summary.count.to_string()];
            Row::of(cells.into_iter().chain(percentiles(summary)))
        })
    });
    page.table("Execution, response and period error", &columns, rows);
}

fn pictures(page: &mut Page, heading: &str, group: &Group<'_, TaskReport>) {
    let mut distributions: Vec<Shown> = Vec::new();
    for (arm, task) in group.arms.iter().enumerate() {
        let name = task.name.clone();
        let raw = task.distribution(TaskReport::METRIC);
        let raw = raw.map(|distribution| Shown { arm, corrected: false, name, distribution });
        let name = format!("{}, corrected", task.name);
        let corrected = task.distribution("release_jitter_corrected_ns");
        let corrected = corrected.filter(|_| task.missed > 0).map(|distribution| Shown {
            arm,
            corrected: true,
            name,
            distribution,
        });
        distributions.extend(raw.into_iter().chain(corrected));
    }
    let turns = group.arms.iter().map(|task| Timeline {
        name: &task.name,
        blocks: &task.blocks,
        outliers: &task.outliers,
    });
    section::pictures(page, heading, &distributions, &turns.collect::<Vec<_>>());
}

fn how_they_ran(page: &mut Page, group: &Group<'_, TaskReport>) {
    let columns = [
        Column::Words("arm"),
        Column::Words("wait"),
        Column::Number("margin"),
        Column::Words("scheduler"),
        Column::Words("CPU"),
        Column::Number("cycles"),
        Column::Number("warm-up"),
        Column::Number("overruns"),
        Column::Number("lost records"),
        Column::Number("allocations"),
        Column::Number("faults"),
        Column::Number("preemptions"),
        Column::Number("block errors"),
    ];
    let rows = group.arms.iter().map(|task| {
        Row::of([
            task.name.clone(),
            task.wake.clone(),
            task.margin_ns.map_or_else(String::new, |ns| duration(ns as f64)),
            task.scheduler.clone(),
            task.cpu.map_or_else(|| "any".to_owned(), |cpu| cpu.to_string()),
            task.cycles.to_string(),
            task.warm_up_cycles.to_string(),
            task.overruns.to_string(),
            task.lost_records.to_string(),
            task.allocations.to_string(),
            (task.minor_faults + task.major_faults).to_string(),
            task.involuntary_switches.to_string(),
            task.block_errors.to_string(),
        ])
    });
    page.table("How they ran", &columns, rows);
}
