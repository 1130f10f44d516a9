//! What surrounds the numbers: cautions, how to read them, and the machine they come from.

use isochrone_machine::{Finding, Severity};
use isochrone_timing::Metric;

use super::page::{Column, Page, Row};
use crate::bench::TOLERANCE;
use crate::report::Report;

const UNKNOWN: &str = "unknown";

/// The one line that the first screen has of what makes numbers doubtful.
pub(super) fn banner(page: &mut Page, report: &Report) {
    if report.ended_early {
        page.markup(
            "<p class=\"banner\">Ended early: somebody stopped it before its time, so there are \
             fewer samples than were asked for.</p>\n",
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
            "<p><b>Release jitter</b> is how late the first instruction of a cycle ran after its \
             due time. <b>Raw</b> is of the cycles that ran. <b>Corrected</b> adds the releases that \
             were missed meanwhile, each as late as it would have been: a loop that stands still \
             must not look better for having run less often. <b>Valid</b> leaves out the turns in \
             which the host took CPU time, a limit throttled the loop, or a page was missing; that \
             rule was fixed beforehand and never looks at the times. A row is left out where it \
             would repeat the raw one.</p>\n",
        );
    }
    if !report.links.is_empty() {
        page.markup(
            "<p><b>One-way latency</b> is from just before a frame was sent until its receiver had \
             it. <b>Age at release</b> is how old the oldest input behind a frame was when the cycle \
             was due that read it, <b>age at publish</b> when the node sent it on, and <b>end to \
             end</b> when the receiver had it. The <b>mean</b> is there to be compared with \
             benchmarks that state nothing else; it tells nothing about the tail.</p>\n",
        );
    }
    page.markup(
        "<p>A percentile such as <b>p99</b> is what 99 % of the samples do not exceed; it is shown \
         only where at least one sample is expected beyond it, and a dash stands where there are \
         too few. The largest sample is the largest <em>of this time</em>, and no bound.</p>\n",
    );
    if !report.comparisons.is_empty() {
        page.markup(
            "<p>A <b>ratio</b> says how many times lower or higher an arm is than the one it is \
             compared with. Its interval contains 99 % of the ratios that resampling the turns \
             gave. <b>Better</b> and <b>worse</b> need the whole interval to lie more than ",
        );
        page.text(format!(
            "{:.0} % from 1, and the times more than {} apart",
            100.0 * TOLERANCE,
            Metric::ONE_WAY.shown(Metric::ONE_WAY.resolution)
        ));
        page.markup("; everything else is the <b>same</b>.</p>\n");
    }
    if report.environment.hypervisor.is_some() {
        page.markup(
            "<p>This ran in a <b>virtual machine</b>. The host can stop it at any time and need not \
             say so, so its tail tells about the host at least as much as about the program. It \
             cannot say what the program would reach on a machine of its own; arms that took turns \
             on the same machine can still be compared.</p>\n",
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
    page.heading("The machine");
    let facts = [
        ("Kernel", known(&here.kernel)),
        ("Preemption", known(&here.preempt)),
        ("CPUs online", here.cpus.to_string()),
        ("Hypervisor", or_none(&here.hypervisor)),
        ("Clock source", known(&here.clocksource)),
        ("One reading of the clock", format!("{} ns, contained in every time", here.clock_read_ns)),
        ("Frequency governor", or_none(&here.governor)),
        ("Isolated CPUs", isolated),
        ("Real-time throttling", throttling),
    ];
    let rows = facts.map(|(fact, value)| Row::of([fact.to_owned(), value]));
    page.table("Environment", &[Column::Words("fact"), Column::Words("value")], rows);
    findings(page, &report.findings);
}

/// The findings, the worst first; what is as it should be is only counted.
fn findings(page: &mut Page, findings: &[Finding]) {
    let mut worth: Vec<&Finding> =
        findings.iter().filter(|finding| finding.severity > Severity::Ok).collect();
    worth.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    let columns = ["check", "severity", "found", "effect", "way out"].map(Column::Words);
    let fine = findings.len() - worth.len();
    let caption = format!("What the doctor found ({fine} more are as they should be)");
    page.table(caption, &columns, worth.into_iter().map(finding));
}

fn finding(finding: &Finding) -> Row {
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
        way_out = format!("{way_out} Without effect here: {why}").trim_start().to_owned();
    }
    let cells = [finding.code.clone(), class.to_owned(), found, finding.effect.clone(), way_out];
    Row { class, ..Row::of(cells) }
}
