//! The section of what block instances cost.

use super::page::{Page, Row, TableColumn};
use super::section::{cell, comparisons};
use crate::bench::{Comparison, Reported};
use crate::output::groups::invalid_turns;
use crate::output::picture::scaling_of;
use crate::report::{CostReport, Report};

pub(super) fn section(page: &mut Page, report: &Report) {
    if report.costs.is_empty() {
        return;
    }
    page.markup("<section>\n");
    page.heading("Time of one instance");
    page.markup(
        "<p>A sample is the time of a batch of cycles, divided by the number of cycles and of \
         instances.</p>\n",
    );
    let columns = [
        TableColumn::Words("block"),
        TableColumn::Number("instances"),
        TableColumn::Number("samples"),
        TableColumn::Number("p50"),
        TableColumn::Number("p99"),
        TableColumn::Number("max"),
        TableColumn::Number("invalid turns"),
    ];
    let rows = report.costs.iter().map(|cost| {
        let CostReport { name, instances, step_ps, turns, .. } = cost;
        let numbers = [name.clone(), instances.to_string(), step_ps.count.to_string()];
        let times = [step_ps.p50, step_ps.p99, step_ps.max]
            .map(|ps| cell(ps.map(|ps| CostReport::METRIC.shown(ps))));
        let invalid = format!("{} of {}", invalid_turns(cost), turns.len());
        Row::of(numbers.into_iter().chain(times).chain([invalid]))
    });
    page.table("Time of one instance in one cycle", &columns, rows);
    let of_costs = |comparison: &&Comparison| comparison.metric == CostReport::METRIC.key;
    comparisons(page, "", &report.comparisons.iter().filter(of_costs).collect::<Vec<_>>());
    let title = "Time of one instance over the number of instances";
    page.picture(title, |screen| scaling_of(title, &report.costs, screen));
    page.markup("</section>\n");
}
