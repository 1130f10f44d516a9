//! The sections of the links: latency, group by group.

use super::page::{Column, Page, Row};
use super::section::{self, comparisons, percentile_columns, percentiles};
use crate::bench::Reported;
use crate::distribution::Distribution;
use crate::output::groups::{Group, groups, metric_name};
use crate::output::picture::Timeline;
use crate::report::{LinkReport, Report};
use crate::summary::Summary;
use crate::units::three_digits;

pub(super) fn sections(page: &mut Page, report: &Report) {
    for group in groups(&report.links, &report.comparisons) {
        let heading = group.heading(metric_name(LinkReport::METRIC));
        section::begin(page, &heading);
        summary(page, &group);
        comparisons(page, &group.circumstances, &group.comparisons);
        pictures(page, &heading, &group);
        page.markup("</section>\n");
    }
}

fn summary(page: &mut Page, group: &Group<'_, LinkReport>) {
    let mut columns = vec![Column::Words("arm"), Column::Words("of"), Column::Number("samples")];
    columns.extend(percentile_columns());
    columns.extend(["frames", "lost", "restarts", "rate"].map(Column::Number));
    let rows = group.arms.iter().flat_map(|link| {
        let row = |kind: &str, summary: &Summary| {
            let cells = [link.service.clone(), kind.to_owned()].into_iter();
            cells.chain([summary.count.to_string()]).chain(percentiles(summary))
        };
        let first = Row::of(row("one-way", &link.one_way_ns).chain([
            link.frames.to_string(),
            link.lost.to_string(),
            link.restarts.to_string(),
            link.rate_hz.map_or_else(String::new, |hz| format!("{} Hz", three_digits(hz))),
        ]));
        let through =
            [("age at publish", &link.age_at_publish_ns), ("end to end", &link.end_to_end_ns)];
        let through = through.into_iter().filter(|(_, summary)| summary.count > 0);
        let nothing = || std::iter::repeat_n(String::new(), 4);
        let through = through.map(|(kind, summary)| Row {
            class: "sub",
            ..Row::of(row(kind, summary).chain(nothing()))
        });
        std::iter::once(first).chain(through).collect::<Vec<_>>()
    });
    page.table("Latency", &columns, rows);
}

fn pictures(page: &mut Page, heading: &str, group: &Group<'_, LinkReport>) {
    let named =
        |link: &&LinkReport| Some((link.service.clone(), link.distribution(LinkReport::METRIC)?));
    let distributions: Vec<(String, Distribution)> = group.arms.iter().filter_map(named).collect();
    let turns: Vec<Timeline<'_>> = group
        .arms
        .iter()
        .map(|link| Timeline { name: &link.service, blocks: &link.blocks, outliers: &[] })
        .collect();
    section::pictures(page, heading, &distributions, &turns);
}
