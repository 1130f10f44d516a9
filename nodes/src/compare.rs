//! `compare`: two reports of a bench, arm by arm.

use std::path::{Path, PathBuf};

use isochrone_engine::{FileKind, read_text};
use isochrone_report::{ComparisonTable, NotCompared, Report, Verdict, compare_reports, overall};
use isochrone_timing::units::counted;

use crate::base::failure::Failure;
use crate::base::terminal;

static REPORT: FileKind = FileKind {
    name: "report",
    format: "JSON",
    max_bytes: 256 << 20,
    shorten: "",
    needs: "is what `isochrone bench` writes with --report",
};

/// Compare two reports of `bench`: how many times lower or higher each arm of the second is,
/// with confidence intervals
///
/// Arms are matched by name and conditions. An interval holds 99 % of the ratios obtained by
/// resampling the turns; the verdict is better or worse only if the whole interval agrees and the
/// difference is more than a tenth. Changes in the machine between the runs are not part of the
/// interval: in a virtual machine, compare arms of one run instead. Exit status: 0 nothing is
/// worse, 1 something is worse, 2 nothing to compare, 4 too little data on an arm of the first
/// report.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone compare before.json after.json")]
pub(crate) struct Args {
    /// Baseline report
    first: PathBuf,
    /// Report to compare with the baseline
    second: PathBuf,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (first, second) = (read(&args.first)?, read(&args.second)?);
    let compared = compare_reports(&first, &second);
    for difference in &compared.differences {
        terminal::note(&format!("note: the runs differ in {difference}"));
    }
    if args.json {
        terminal::print_json(&compared.comparisons)?
    } else {
        terminal::print(&ComparisonTable(&compared.comparisons).to_string())?
    }
    let verdict = overall(&compared.comparisons);
    if verdict == Verdict::Worse {
        let worse = compared.comparisons.iter().filter(|one| one.verdict == Verdict::Worse).count();
        return Err(Failure::found(format!(
            "{} is worse than {} in {worse} of {}, listed above",
            args.second.display(),
            args.first.display(),
            counted(compared.comparisons.len(), "comparison")
        )));
    }
    let left_out: Vec<String> =
        compared.left_out.iter().map(|NotCompared { arm, why }| format!("{arm}: {why}")).collect();
    if !left_out.is_empty() {
        return Err(Failure::inconclusive(format!(
            "{}: some arms could not be compared with {}\n{}",
            args.first.display(),
            args.second.display(),
            left_out.join("\n")
        )));
    }
    if compared.comparisons.is_empty() {
        Err(Failure::usage(format!(
            "{} contains nothing to compare; name a file that `isochrone bench --report` wrote",
            args.first.display()
        )))
    } else {
        Ok(())
    }
}

fn read(path: &Path) -> Result<Report, Failure> {
    let name = path.display();
    let text = read_text(path, &REPORT).map_err(Failure::usage)?;
    serde_json::from_str(&text).map_err(|error| {
        let what = if error.is_data() { "not a report of isochrone" } else { "not JSON" };
        Failure::usage(format!(
            "{name} is {what}: {error}; name a file that `isochrone bench --report` wrote"
        ))
    })
}
