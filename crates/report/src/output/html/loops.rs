//! The sections of the loops: release jitter, group by group.

use isochrone_timing::units::duration;

use super::page::{Page, Row, TableColumn};
use super::section::{self, ShownDistribution, cell, comparisons, percentile_columns, percentiles};
use crate::bench::Reported;
use crate::output::groups::{Group, groups, percent, release_jitter};
use crate::output::picture::Timeline;
use crate::report::{Report, TaskArm};

pub(super) fn sections(page: &mut Page, report: &Report) {
    for group in groups(&report.tasks, &report.comparisons) {
        let heading = group.heading(TaskArm::METRIC.name);
        section::begin(page, &heading);
        summary(page, &group);
        comparisons(page, &group.circumstances, &group.comparisons);
        pictures(page, &heading, &group);
        how_they_ran(page, &group);
        page.markup("</section>\n");
    }
}

/// The percentiles of the first group, for the first screen; whether there are any.
pub(super) fn lead(page: &mut Page, report: &Report) -> bool {
    let groups = groups(&report.tasks, &report.comparisons);
    let Some(group) = groups.first() else { return false };
    let heading = group.heading(TaskArm::METRIC.name);
    section::percentiles_picture(page, &heading, &distributions(group));
    true
}

fn summary(page: &mut Page, group: &Group<'_, TaskArm>) {
    let mut columns =
        vec![TableColumn::Words("arm"), TableColumn::Words("of"), TableColumn::Number("samples")];
    columns.extend(percentile_columns());
    columns.extend(["missed", "CPU"].map(TableColumn::Number));
    let rows = group.arms.iter().flat_map(|task| {
        release_jitter(task).into_iter().enumerate().map(|(index, (releases, summary))| {
            let releases = releases.as_str().to_owned();
            let cells = [task.task.name.clone(), releases, summary.count.to_string()];
            let cells = cells.into_iter().chain(percentiles(summary));
            match index {
                0 => Row::of(cells.chain([
                    task.task.missed.to_string(),
                    cell(percent(task.task.cpu_fraction).map(|cpu| cpu + " %")),
                ])),
                _ => Row { class: "sub", ..Row::of(cells.chain([String::new(), String::new()])) },
            }
        })
    });
    page.table("Release jitter", &columns, rows);
    // The loops of a bench do next to nothing; in a run these say whether the work fits.
    let runs = group.arms.iter().filter(|task| task.turns.is_empty());
    let mut columns = vec![
        TableColumn::Words("task"),
        TableColumn::Words("time"),
        TableColumn::Number("samples"),
    ];
    columns.extend(percentile_columns());
    let rows = runs.flat_map(|task| {
        let times = [
            ("execution", &task.task.execution_ns),
            ("response", &task.task.response_ns),
            ("period error", &task.task.period_error_ns),
        ];
        times.map(|(time, summary)| {
            let cells = [task.task.name.clone(), time.to_owned(), summary.count.to_string()];
            Row::of(cells.into_iter().chain(percentiles(summary)))
        })
    });
    page.table("Execution, response and period error", &columns, rows);
}

fn distributions(group: &Group<'_, TaskArm>) -> Vec<ShownDistribution> {
    let mut distributions: Vec<ShownDistribution> = Vec::new();
    for (arm, task) in group.arms.iter().enumerate() {
        let name = task.task.name.clone();
        let raw = task.distribution(TaskArm::METRIC);
        let raw =
            raw.map(|distribution| ShownDistribution { arm, corrected: false, name, distribution });
        let name = format!("{}, corrected", task.task.name);
        let corrected = task.distribution(TaskArm::COMPARED);
        let corrected = corrected
            .filter(|_| task.task.missed > 0)
            .map(|distribution| ShownDistribution { arm, corrected: true, name, distribution });
        distributions.extend(raw.into_iter().chain(corrected));
    }
    distributions
}

fn pictures(page: &mut Page, heading: &str, group: &Group<'_, TaskArm>) {
    let turns = group.arms.iter().map(|task| Timeline {
        name: &task.task.name,
        turns: &task.turns,
        outliers: &task.outliers,
    });
    section::pictures(page, heading, &distributions(group), &turns.collect::<Vec<_>>());
}

fn how_they_ran(page: &mut Page, group: &Group<'_, TaskArm>) {
    let columns = [
        TableColumn::Words("arm"),
        TableColumn::Words("wait"),
        TableColumn::Number("margin"),
        TableColumn::Words("scheduler"),
        TableColumn::Words("CPU"),
        TableColumn::Number("cycles"),
        TableColumn::Number("warm-up"),
        TableColumn::Number("overruns"),
        TableColumn::Number("lost records"),
        TableColumn::Number("allocations"),
        TableColumn::Number("faults"),
        TableColumn::Number("preemptions"),
        TableColumn::Number("block errors"),
    ];
    let rows = group.arms.iter().map(|task| {
        Row::of([
            task.task.name.clone(),
            task.task.wake.clone(),
            task.task.margin_ns.map_or_else(String::new, |ns| duration(ns as f64)),
            task.task.scheduler.clone(),
            task.task.cpu.map_or_else(|| "any".to_owned(), |cpu| cpu.to_string()),
            task.task.cycles.to_string(),
            task.task.warm_up_cycles.to_string(),
            count(task.task.overruns),
            count(task.task.lost_records),
            count(task.task.allocations),
            count(task.task.faults()),
            count(task.task.involuntary_switches),
            count(task.task.block_errors),
        ])
    });
    page.table("How they ran", &columns, rows);
}

fn count(count: Option<u64>) -> String {
    cell(count.map(|count| count.to_string()))
}
