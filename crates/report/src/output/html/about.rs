//! The context of the numbers: warnings, how to read them, and the machine.

use isochrone_machine::{CheckResult, Severity};
use isochrone_timing::Metric;
use isochrone_timing::units::counted;

use super::page::{Page, Row, TableColumn};
use crate::bench::TOLERANCE;
use crate::report::Report;

const UNKNOWN: &str = "unknown";

/// The one line that the first screen has of what makes numbers doubtful.
pub(super) fn banner(page: &mut Page, report: &Report) {
    if report.ended_early {
        page.markup(
            "<p class=\"banner\">Ended early: the run was stopped before its time and has fewer \
             samples than requested.</p>\n",
        );
    }
    if !report.warnings.is_empty() {
        let codes: Vec<&str> =
            report.warnings.iter().map(|warning| warning.code.as_str()).collect();
        page.element("<p class=\"banner\">Warnings: ", codes.join(", "), "</p>\n");
    }
}

/// Why to read the numbers with care.
pub(super) fn warnings(page: &mut Page, report: &Report) {
    if report.warnings.is_empty() {
        return;
    }
    page.heading("Warnings");
    page.markup("<ul class=\"warnings\">\n");
    for warning in &report.warnings {
        page.element("<li><code>", &warning.code, "</code>: ");
        page.text(&warning.message);
        if !warning.remedy.is_empty() {
            page.element("<br>Remedy: <code>", &warning.remedy, "</code>");
        }
        page.markup("</li>\n");
    }
    page.markup("</ul>\n");
}

/// What the words on the page mean, as far as they occur.
pub(super) fn how_to_read(page: &mut Page, report: &Report) {
    page.markup("<details class=\"method\"><summary>How to read this page</summary>\n");
    if !report.tasks.is_empty() {
        page.markup(
            "<p><b>Release jitter</b> is the time from the due time of a cycle to its first \
             instruction. <b>Raw</b> covers the cycles that ran. <b>Corrected</b> adds one sample \
             for each missed release, as late as it would have been, so that a loop that stalls \
             does not look better for running less often. <b>Valid</b> excludes the turns in which \
             the host took CPU time, a limit throttled the loop, or a page fault occurred; this \
             rule is fixed in advance and never looks at the times. A row is omitted if it would \
             repeat the raw one.</p>\n",
        );
    }
    if !report.links.is_empty() {
        page.markup(
            "<p><b>One-way latency</b> is the time from just before a frame was sent until the \
             receiver had it. <b>Age at release</b> is the age of the oldest input behind a frame \
             when the cycle that read it was due, <b>age at publish</b> when the node sent the \
             frame, and <b>end to end</b> when the receiver had it. The <b>mean</b> allows \
             comparison with benchmarks that report nothing else; it says nothing about the \
             tail.</p>\n",
        );
    }
    page.markup(
        "<p>99 % of the samples do not exceed the percentile <b>p99</b>. A percentile is shown \
         only if at least one sample is expected beyond it; otherwise there is a dash. The maximum \
         is that <em>of this run</em>, not a bound.</p>\n",
    );
    if !report.comparisons.is_empty() {
        page.markup(
            "<p>A <b>ratio</b> says how many times lower or higher an arm is than the one it is \
             compared with. Its interval contains 99 % of the ratios that resampling the turns \
             gave. The verdict is <b>better</b> or <b>worse</b> only if the whole interval is more than ",
        );
        page.text(format!(
            "{:.0} % away from 1 and the times differ by more than {}",
            100.0 * TOLERANCE,
            Metric::ONE_WAY.shown(Metric::ONE_WAY.resolution)
        ));
        page.markup("; otherwise it is <b>same</b>.</p>\n");
    }
    if report.environment.hypervisor.is_some() {
        page.markup(
            "<p>This run was in a <b>virtual machine</b>. The host can stop it at any time, and need \
             not report it, so the tail shows the host at least as much as the program, and the \
             times do not transfer to a physical machine. Arms that took turns on the same machine \
             can still be compared.</p>\n",
        );
    }
    page.markup("</details>\n");
}

/// Where it ran, and what the doctor found there.
pub(super) fn machine(page: &mut Page, report: &Report) {
    let here = &report.environment;
    let known = |fact: &Option<String>| fact.clone().unwrap_or_else(|| UNKNOWN.to_owned());
    let or_none = |fact: &Option<String>| fact.clone().unwrap_or_else(|| "none".to_owned());
    let isolated = match here.isolated_cpus.as_str() {
        "" => "none".to_owned(),
        cpus => cpus.to_owned(),
    };
    let throttling = here.rt_throttling.as_ref().map_or_else(
        || UNKNOWN.to_owned(),
        |both| {
            let applies = match here.rt_throttling_applies {
                Some(false) => ", not of SCHED_FIFO",
                _ => "",
            };
            format!("{both} us (runtime/period; -1 is off){applies}")
        },
    );
    let clock_reading = here
        .clock_read_ns
        .map_or_else(|| UNKNOWN.to_owned(), |ns| format!("{ns} ns, included in every time"));
    page.heading("The machine");
    let facts = [
        ("Kernel", known(&here.kernel)),
        ("Preemption", known(&here.preempt)),
        ("CPUs online", here.cpus.to_string()),
        ("Hypervisor", or_none(&here.hypervisor)),
        ("Clock source", known(&here.clocksource)),
        ("One clock reading", clock_reading),
        ("Frequency governor", or_none(&here.governor)),
        ("Isolated CPUs", isolated),
        ("Real-time throttling", throttling),
    ];
    let rows = facts.map(|(fact, value)| Row::of([fact.to_owned(), value]));
    page.table("Environment", &[TableColumn::Words("fact"), TableColumn::Words("value")], rows);
    findings(page, &report.findings);
}

/// The findings, the worst first; checks that passed are only counted.
fn findings(page: &mut Page, findings: &[CheckResult]) {
    let mut worth: Vec<&CheckResult> =
        findings.iter().filter(|finding| finding.severity > Severity::Ok).collect();
    worth.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    let columns = ["check", "severity", "found", "effect", "fix"].map(TableColumn::Words);
    let fine = findings.len() - worth.len();
    let caption = format!("What the doctor found ({} passed)", counted(fine, "other check"));
    page.table(caption, &columns, worth.into_iter().map(finding));
}

fn finding(finding: &CheckResult) -> Row {
    let class = match finding.severity {
        Severity::Ok => "ok",
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Problem => "problem",
    };
    let mut found = finding.value.clone();
    if !finding.details.is_empty() {
        found += &format!(" ({})", finding.details.join("; "));
    }
    let mut way_out = finding.fix.clone().unwrap_or_default();
    if finding.inert {
        let why = finding.inert_why.as_deref().unwrap_or("this machine ignores it");
        way_out = format!("{way_out} No effect here: {why}").trim_start().to_owned();
    }
    let cells = [finding.code.clone(), class.to_owned(), found, finding.effect.clone(), way_out];
    Row { class, ..Row::of(cells) }
}
