//! The main result of a report, for the first screen: how the arms compare, or how late they were.

use isochrone_timing::units::duration;

use super::page::Page;
use crate::bench::{Comparison, Reported, Verdict, verdict_in_words};
use crate::output::groups::{arm_of, groups, percentile_name};
use crate::report::{LinkArm, Report, TaskArm};

/// Lines that the first screen of a phone has room for, above a picture.
const FIRST: usize = 3;

pub(super) fn verdict(page: &mut Page, report: &Report) {
    let mut lines = of::<TaskArm>(&report.tasks, &report.comparisons, |task| {
        let missed = format!("{} missed", task.task.missed);
        let summary = &task.task.release_jitter_ns;
        times([("p50", summary.p50), ("p99", summary.p99), ("max", summary.max)]) + &missed
    });
    lines.extend(of::<LinkArm>(&report.links, &report.comparisons, |link| {
        let lost = format!("{} lost", link.link.lost);
        let summary = &link.link.one_way_ns;
        times([("p50", summary.p50), ("p99", summary.p99), ("max", summary.max)]) + &lost
    }));
    if lines.is_empty() {
        return;
    }
    page.markup("<ul id=\"verdict\" class=\"verdict\">\n");
    let rest = lines.split_off(FIRST.min(lines.len()));
    list(page, &lines);
    page.markup("</ul>\n");
    if !rest.is_empty() {
        page.element("<details><summary>", format!("{} more", rest.len()), "</summary>\n");
        page.markup("<ul class=\"verdict\">\n");
        list(page, &rest);
        page.markup("</ul>\n</details>\n");
    }
}

/// A line.
struct Line {
    /// The arm, and under which circumstances.
    about: String,
    says: String,
}

fn list(page: &mut Page, lines: &[Line]) {
    for Line { about, says } in lines {
        page.element("<li><b>", about, "</b>: ");
        page.text(says);
        page.markup("</li>\n");
    }
}

/// A line for each arm that is compared with another, and for each arm where none is.
fn of<R: Reported>(
    arms: &[R],
    comparisons: &[Comparison],
    plainly: impl Fn(&R) -> String,
) -> Vec<Line> {
    let mut lines = Vec::new();
    for group in groups(arms, comparisons) {
        let about = |arm: &str| match group.circumstances.as_str() {
            "" => format!("{arm}, {}", R::METRIC.name),
            circumstances => format!("{arm}, {circumstances}"),
        };
        for same in group.comparisons.chunk_by(|one, other| one.candidate == other.candidate) {
            let (Some(first), Some(last)) = (same.first(), same.last()) else { continue };
            let arm = arm_of(&first.candidate, &group.circumstances);
            let than = arm_of(&first.reference, &group.circumstances);
            let from = if first.verdict == Verdict::Same { "from" } else { "than" };
            let shown = verdict_in_words(first);
            let mut says =
                format!("{shown} {from} {than} at {}", percentile_name(&first.percentile));
            if last.percentile != first.percentile {
                let at = percentile_name(&last.percentile);
                says += &format!("; {} at {at}", verdict_in_words(last));
            }
            lines.push(Line { about: about(arm), says });
        }
        if group.comparisons.is_empty() {
            lines.extend(
                group.arms.iter().map(|arm| Line { about: about(arm.arm()), says: plainly(arm) }),
            );
        }
    }
    lines
}

fn times<const N: usize>(times: [(&str, Option<u64>); N]) -> String {
    let known = times.into_iter().filter_map(|(name, ns)| Some((name, ns?)));
    known.map(|(name, ns)| format!("{name} {}, ", duration(ns as f64))).collect()
}
