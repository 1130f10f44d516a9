//! The sections of the links: latency, group by group.

use isochrone_timing::units::{duration, three_digits};

use super::page::{Page, Row, TableColumn};
use super::section::{self, ShownDistribution, comparisons, percentiles};
use crate::bench::Reported;
use crate::output::groups::{Group, groups, latency_columns, stages};
use crate::output::picture::Timeline;
use crate::report::{LinkArm, Report};

pub(super) fn sections(page: &mut Page, report: &Report) {
    for group in groups(&report.links, &report.comparisons) {
        let heading = group.heading(LinkArm::METRIC.name);
        section::begin(page, &heading);
        summary(page, &group);
        comparisons(page, &group.circumstances, &group.comparisons);
        pictures(page, &heading, &group);
        page.markup("</section>\n");
    }
}

fn summary(page: &mut Page, group: &Group<'_, LinkArm>) {
    let mut columns =
        vec![TableColumn::Words("arm"), TableColumn::Words("of"), TableColumn::Number("samples")];
    columns.extend(latency_columns().map(TableColumn::Number));
    let rows = group.arms.iter().flat_map(|link| {
        // Who only counts frames, as their sender does, has no latencies.
        let one_way = Some(&link.link.one_way_ns).filter(|summary| summary.count > 0);
        let one_way = one_way.map(|summary| ("", "one-way", summary));
        let stages = stages(link).map(|(stage, summary)| ("sub", stage, summary));
        one_way.into_iter().chain(stages).map(|(class, kind, summary)| {
            let count = summary.count.to_string();
            let mean = section::cell(summary.mean.map(duration));
            let cells = [link.link.service.clone(), kind.to_owned(), count, mean];
            Row { class, ..Row::of(cells.into_iter().chain(percentiles(summary))) }
        })
    });
    page.table("Latency", &columns, rows);
    let columns = [
        TableColumn::Words("arm"),
        TableColumn::Number("frames"),
        TableColumn::Number("lost"),
        TableColumn::Number("timed out"),
        TableColumn::Number("restarts"),
        TableColumn::Number("rate"),
    ];
    let rows = group.arms.iter().map(|link| {
        let timed_out = section::cell(link.timed_out.map(|count| count.to_string()));
        let rate = link.link.rate_hz.map(|hz| format!("{} Hz", three_digits(hz)));
        let link = &link.link;
        let counts = [link.frames, link.lost].map(|count| count.to_string());
        let restarts = section::cell(link.restarts.map(|count| count.to_string()));
        Row::of([link.service.clone()].into_iter().chain(counts).chain([
            timed_out,
            restarts,
            section::cell(rate),
        ]))
    });
    page.table("Frames", &columns, rows);
}

/// The percentiles of the first group, for the first screen.
pub(super) fn lead(page: &mut Page, report: &Report) {
    let groups = groups(&report.links, &report.comparisons);
    if let Some(group) = groups.first() {
        let heading = group.heading(LinkArm::METRIC.name);
        section::percentiles_picture(page, &heading, &distributions(group));
    }
}

fn distributions(group: &Group<'_, LinkArm>) -> Vec<ShownDistribution> {
    let shown = |(arm, link): (usize, &&LinkArm)| {
        let (name, distribution) = (link.link.service.clone(), link.distribution(LinkArm::METRIC)?);
        Some(ShownDistribution { arm, corrected: false, name, distribution })
    };
    group.arms.iter().enumerate().filter_map(shown).collect()
}

fn pictures(page: &mut Page, heading: &str, group: &Group<'_, LinkArm>) {
    let turns: Vec<Timeline<'_>> = group
        .arms
        .iter()
        .map(|link| Timeline { name: &link.link.service, turns: &link.turns, outliers: &[] })
        .collect();
    section::pictures(page, heading, &distributions(group), &turns);
}
