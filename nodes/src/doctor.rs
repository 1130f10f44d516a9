//! `doctor`: how this machine affects jitter, and how to fix it.

use isochrone_machine::{CheckResult, Examination, Machine, Severity, examine};
use isochrone_timing::units::counted;
use textwrap::fill;

use crate::base::failure::Failure;
use crate::base::terminal;
use crate::base::wrapping::at_spaces;

/// Examine this machine: what makes cycles late and how to change it
///
/// Inspects the kernel, the rights of this user and one CPU. For each finding it shows what it is,
/// how it affects jitter, how to fix it, and whether a setting has no effect here. Changes nothing,
/// needs no privileges, and reports "unknown" for what it cannot read: run it as the user that will
/// run the node, and again as root to see more.
///
/// A problem prevents real-time scheduling of a task; a warning makes cycles late and can be fixed;
/// a note is for information. Exit status: 0 nothing worse than a note, 1 a warning or a problem, 2
/// no such CPU.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone doctor\n  isochrone doctor --cpu 3\n  isochrone doctor --json > machine.json"
)]
pub(crate) struct Args {
    /// CPU that a task would be pinned to; default: the one that cpu = "auto" would choose now
    #[arg(long, value_name = "N", value_parser = parse_cpu, allow_negative_numbers = true)]
    cpu: Option<usize>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// The groups, worst first.
const GROUPS: [(Severity, &str); 4] = [
    (Severity::Problem, "problem"),
    (Severity::Warning, "warning"),
    (Severity::Note, "note"),
    (Severity::Ok, "ok"),
];

/// Parts shown of one finding; JSON has them all.
const DETAILS: usize = 8;

/// Width of the text; commands are not broken, so that they can be copied.
const COLUMNS: usize = 100;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let examination = examine(&Machine::here(), args.cpu).map_err(Failure::usage)?;
    if args.json {
        terminal::print_json(&examination)?
    } else {
        terminal::print(&text(&examination))?
    }
    let bad: Vec<String> = GROUPS
        .iter()
        .filter(|(severity, _)| *severity >= Severity::Warning)
        .map(|(severity, name)| (examination.of(*severity).count(), name))
        .filter(|(count, _)| *count > 0)
        .map(|(count, name)| counted(count, name))
        .collect();
    if bad.is_empty() {
        Ok(())
    } else {
        Err(Failure::found(format!(
            "CPU {}: {}, each listed above with its fix",
            examination.cpu,
            bad.join(" and ")
        )))
    }
}

fn parse_cpu(text: &str) -> Result<usize, String> {
    text.parse().map_err(|_| "give the number of a CPU, such as 0".into())
}

fn text(examination: &Examination) -> String {
    let environment = &examination.environment;
    let mut text = format!(
        "isochrone {} doctor: CPU {} of {}, Linux {}\n",
        examination.isochrone,
        examination.cpu,
        examination.online_cpus,
        environment.kernel.as_deref().unwrap_or("of unknown release"),
    );
    let margin =
        examination.findings.iter().map(|finding| finding.code.len()).max().unwrap_or(0) + 4;
    for (severity, name) in GROUPS {
        let count = examination.of(severity).count();
        if count == 0 {
            continue;
        }
        text += &match severity {
            Severity::Ok => format!("\n{count} ok\n"),
            _ => format!("\n{}\n", counted(count, name)),
        };
        for finding in examination.of(severity) {
            text += &lines(finding, margin);
        }
    }
    text + "\nNothing was changed. Fixes need root; the kernel command line needs a restart.\n"
}

/// A finding: one line if it is fine, otherwise with its parts, its effect and the fix.
fn lines(finding: &CheckResult, margin: usize) -> String {
    let matters = finding.severity > Severity::Ok;
    let mut paragraphs = Vec::new();
    if matters {
        paragraphs.extend(finding.details.iter().take(DETAILS).map(|detail| format!("- {detail}")));
        if let Some(more) = finding.details.len().checked_sub(DETAILS + 1) {
            paragraphs.push(format!("- and {} more (--json lists all)", more + 1));
        }
        paragraphs.push(finding.effect.clone());
    }
    paragraphs.extend(finding.inert_why.iter().map(|why| format!("No effect here: {why}.")));

    let head = format!("  {:<width$}", finding.code, width = margin - 2);
    let mut text = wrapped(&head, &finding.value, margin);
    for paragraph in paragraphs {
        text += &wrapped(&" ".repeat(margin), &paragraph, margin);
    }
    if let Some(fix) = finding.fix.as_ref().filter(|_| matters) {
        text += &format!("{:margin$}fix: {fix}\n", "");
    }
    if matters {
        text += &wrapped(&" ".repeat(margin), &format!("read from {}", finding.source), margin);
    }
    text
}

/// A paragraph behind `head`, each further line indented by `margin` spaces.
fn wrapped(head: &str, paragraph: &str, margin: usize) -> String {
    let margin = " ".repeat(margin);
    let lines = at_spaces(COLUMNS).break_words(false);
    let text = fill(paragraph, lines.initial_indent(head).subsequent_indent(&margin));
    text.trim_end().to_owned() + "\n"
}
