//! `compare`: two reports of a bench, arm by arm.

use std::path::{Path, PathBuf};

use isochrone_timing::{ComparisonTable, Report, Verdict, compare_reports, overall};

use crate::failure::Failure;
use crate::terminal;

/// Compare two reports of `bench`: how many times lower is each arm of the second, and how sure is that
///
/// Arms are matched by their name and circumstances. An interval holds 99 % of the ratios that other
/// draws of the same blocks would have given; better and worse are said only where the whole interval
/// says so and the difference is more than a tenth. Exit status: 0 nothing is worse, 1 something is,
/// 2 the reports cannot be compared.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The reference
    first: PathBuf,
    /// What is held against it
    second: PathBuf,
    /// Print JSON instead of the table
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let (first, second) = (read(&args.first)?, read(&args.second)?);
    let comparisons = compare_reports(&first, &second);
    if comparisons.is_empty() {
        return Err(Failure::usage(nothing_to_compare(args, &first, &second)));
    }
    match args.json {
        true => terminal::print_json(&comparisons)?,
        false => terminal::print(&ComparisonTable(&comparisons).to_string())?,
    }
    match overall(&comparisons) {
        Verdict::Worse => Err(Failure::found(format!(
            "{} is worse than {}",
            args.second.display(),
            args.first.display()
        ))),
        Verdict::Better | Verdict::Same => Ok(()),
    }
}

fn read(path: &Path) -> Result<Report, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::usage(format!("cannot read {name}: {error}")))?;
    serde_json::from_str(&text)
        .map_err(|error| Failure::usage(format!("{name} is no report of isochrone: {error}")))
}

fn nothing_to_compare(args: &Args, first: &Report, second: &Report) -> String {
    let labels = |report: &Report| match report.measured() {
        measured if measured.is_empty() => "nothing".to_owned(),
        measured => measured.iter().map(|m| m.label()).collect::<Vec<_>>().join(", "),
    };
    format!(
        "nothing to compare: an arm must be in both reports, with at least five valid blocks in each\n\
         {} measured {}\n{} measured {}",
        args.first.display(),
        labels(first),
        args.second.display(),
        labels(second)
    )
}
