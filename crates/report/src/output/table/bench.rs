//! The tables of a bench: the arms under the same circumstances side by side, and how they compare.

use std::fmt::{Display, Formatter, Result};

use isochrone_timing::Summary;
use isochrone_timing::units::duration;

use super::columns::{Alignment, Table, UNKNOWN, time};
use crate::bench::{Comparison, LeftOut, Reported, interval_in_words, ratio_in_words};
use crate::output::groups::{
    COLUMNS, Group, Releases, arm_of, columns, groups, invalid_turns, latency_columns, percent,
    percentile_name, release_jitter, sentence, stages,
};
use crate::report::{CostReport, LinkArm, Report, TaskArm};

/// Of every table.
const INDENT: usize = 2;

/// Comparisons between two reports; `Display` prints a table.
#[derive(Debug, Clone, Copy)]
pub struct ComparisonTable<'a>(pub &'a [Comparison]);

impl Display for ComparisonTable<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        comparisons(f, "", &self.0.iter().collect::<Vec<_>>())
    }
}

/// Prints what has turns, and the costs.
pub(super) fn tables(f: &mut Formatter<'_>, report: &Report) -> Result {
    let tasks = report.tasks.iter().filter(|task| !task.turns.is_empty());
    let mut chosen: Vec<_> = tasks.clone().filter_map(chosen_cpu).collect();
    chosen.dedup();
    for cpu in chosen {
        writeln!(f, "\n{cpu}")?;
    }
    for group in groups(tasks, &report.comparisons) {
        table(f, &group, &loops(&group))?;
    }
    let links = report.links.iter().filter(|link| !link.turns.is_empty());
    for group in groups(links, &report.comparisons) {
        table(f, &group, &latencies(&group))?;
    }
    costs(f, report)?;
    left_out(f, &report.left_out)
}

fn chosen_cpu(task: &TaskArm) -> Option<String> {
    let reason = task.task.cpu_reason.as_ref()?;
    Some(format!("CPU {} chosen: {reason}", task.task.cpu?))
}

fn table<R: Reported>(f: &mut Formatter<'_>, group: &Group<'_, R>, arms: &Table) -> Result {
    writeln!(f, "\n{}", group.heading(R::METRIC.name))?;
    write!(f, "{}", arms.draw(INDENT))?;
    comparisons(f, &group.circumstances, &group.comparisons)
}

/// A table of numbers with this heading.
fn headed<'a>(heading: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new(Alignment::Right);
    table.row(heading);
    table
}

fn loops(group: &Group<'_, TaskArm>) -> Table {
    let mut table = headed(["arm", "samples"].into_iter().chain(COLUMNS).chain([
        "CPU %",
        "missed",
        "invalid turns",
    ]));
    for task in &group.arms {
        for (releases, summary) in release_jitter(task) {
            match releases {
                Releases::Raw => table.row(cells(&task.task.name, summary.count, summary).chain([
                    percent(task.task.cpu_fraction).unwrap_or_else(|| UNKNOWN.to_owned()),
                    task.task.missed.to_string(),
                    invalid(*task),
                ])),
                Releases::Corrected | Releases::Valid => {
                    let label = format!("  {}", releases.as_str());
                    table.row(cells(&label, summary.count, summary));
                }
            }
        }
    }
    table
}

/// Through nodes that follow, the time is that of the way to the nodes and of the way back.
const THERE_AND_BACK: &str = " (there and back)";

fn latencies(group: &Group<'_, LinkArm>) -> Table {
    let has_followed = group.arms.iter().any(|link| link.timed_out.is_some());
    let timed_out = has_followed.then_some("timed out");
    let rest = ["lost"].into_iter().chain(timed_out).chain(["invalid turns"]);
    let mut table = headed(["arm", "frames"].into_iter().chain(latency_columns()).chain(rest));
    for link in &group.arms {
        let timed_out =
            link.timed_out.map_or_else(|| UNKNOWN.to_owned(), |count| count.to_string());
        let timed_out = has_followed.then_some(timed_out);
        let rest =
            [link.link.lost.to_string()].into_iter().chain(timed_out).chain([invalid(*link)]);
        let back = if link.timed_out.is_some() { THERE_AND_BACK } else { "" };
        let label = format!("{}{back}", link.link.service);
        table.row(latency_cells(&label, link.link.frames, &link.link.one_way_ns).chain(rest));
        for (stage, summary) in stages(link) {
            table.row(latency_cells(&format!("  {stage}"), summary.count, summary));
        }
    }
    table
}

fn latency_cells(label: &str, count: u64, summary: &Summary) -> impl Iterator<Item = String> {
    let mean = summary.mean.map_or_else(|| UNKNOWN.to_owned(), duration);
    let times = columns(summary).map(time);
    [label.to_owned(), count.to_string(), mean].into_iter().chain(times)
}

fn cells(label: &str, count: u64, summary: &Summary) -> impl Iterator<Item = String> {
    [label.to_owned(), count.to_string()].into_iter().chain(columns(summary).map(time))
}

fn invalid<R: Reported>(arm: &R) -> String {
    format!("{} of {}", invalid_turns(arm), arm.turns().len())
}

fn costs(f: &mut Formatter<'_>, report: &Report) -> Result {
    if report.costs.is_empty() {
        return Ok(());
    }
    writeln!(f, "\n{} in a cycle", CostReport::METRIC.name)?;
    let mut table = headed(["block", "instances", "samples", "p50", "p99"]);
    for CostReport { name, instances, step_ps, .. } in &report.costs {
        let time = |ps: Option<u64>| {
            ps.map_or_else(|| UNKNOWN.to_owned(), |ps| CostReport::METRIC.shown(ps))
        };
        let numbers = [instances.to_string(), step_ps.count.to_string()];
        let times = [step_ps.p50, step_ps.p99].map(time);
        table.row([name.clone()].into_iter().chain(numbers).chain(times));
    }
    write!(f, "{}", table.draw(INDENT))?;
    let of_costs = |comparison: &&Comparison| comparison.metric == CostReport::METRIC.key;
    comparisons(f, "", &report.comparisons.iter().filter(of_costs).collect::<Vec<_>>())
}

/// What could not be compared, and how much longer to run.
fn left_out(f: &mut Formatter<'_>, left_out: &[LeftOut]) -> Result {
    if !left_out.is_empty() {
        writeln!(f, "\nnot compared")?;
    }
    left_out.iter().try_for_each(|left_out| writeln!(f, "  {}", sentence(left_out)))
}

/// How many times lower or higher each arm is than the one it is compared with, reference by reference.
fn comparisons(f: &mut Formatter<'_>, circumstances: &str, comparisons: &[&Comparison]) -> Result {
    // An arm against itself is that of two reports.
    let of_two = |comparison: &Comparison| comparison.reference == comparison.candidate;
    let together = |one: &&Comparison, other: &&Comparison| {
        one.reference == other.reference || (of_two(one) && of_two(other))
    };
    for same in comparisons.chunk_by(together) {
        let Some(first) = same.first() else { continue };
        let heading = if of_two(first) {
            "second report compared with the first, valid turns".to_owned()
        } else {
            format!("compared with {}, valid turns", arm_of(&first.reference, circumstances))
        };
        let mut table = headed([heading.as_str(), "", "ratio", "99 % interval", "verdict"]);
        let mut arm = "";
        for Comparison { candidate, percentile, ratio, low, high, verdict, .. } in same {
            // An arm is named once.
            let label = if candidate == arm { "" } else { arm_of(candidate, circumstances) };
            arm = candidate;
            table.row([
                format!("  {label}"),
                percentile_name(percentile).to_owned(),
                ratio_in_words(*ratio),
                interval_in_words(*ratio, *low, *high),
                verdict.as_str().to_owned(),
            ]);
        }
        write!(f, "{}", table.draw(INDENT))?;
    }
    Ok(())
}
