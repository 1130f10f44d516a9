//! `compare`: two reports of a bench, arm by arm.

use std::path::{Path, PathBuf};

use isochrone_report::{ComparisonTable, Report, Verdict, compare_reports, overall};

use crate::failure::Failure;
use crate::terminal;

/// Compare two reports of `bench`: how many times lower is each arm of the second, and how sure is that
///
/// Arms are matched by their name and circumstances. An interval holds 99 % of the ratios that other
/// draws of the same turns would have given; better and worse are said only where the whole interval
/// says so and the difference is more than a tenth. What changed in the machine between the runs is
/// in no interval: in a virtual machine rather compare arms of one run. Exit status: 0 nothing is
/// worse, 1 something is, 2 there is nothing to compare, 4 the reports say too little about an arm of the
/// first.
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
    let compared = compare_reports(&first, &second);
    for difference in &compared.differences {
        terminal::note(&format!("note: the reports differ in {difference}"));
    }
    match args.json {
        true => terminal::print_json(&compared.comparisons)?,
        false => terminal::print(&ComparisonTable(&compared.comparisons).to_string())?,
    }
    let verdict = overall(&compared.comparisons);
    if verdict == Verdict::Worse {
        return Err(Failure::found(format!(
            "{} is worse than {}",
            args.second.display(),
            args.first.display()
        )));
    }
    let left_out: Vec<String> =
        compared.left_out.iter().map(|(arm, why)| format!("{arm}: {why}")).collect();
    if !left_out.is_empty() {
        return Err(Failure::inconclusive(format!(
            "some arms of {} could not be compared\n{}",
            args.first.display(),
            left_out.join("\n")
        )));
    }
    match compared.comparisons.is_empty() {
        true => Err(Failure::usage(format!(
            "{} holds nothing to compare; a report of `isochrone bench` does",
            args.first.display()
        ))),
        false => Ok(()),
    }
}

fn read(path: &Path) -> Result<Report, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::usage(format!("cannot read {name}: {error}")))?;
    serde_json::from_str(&text)
        .map_err(|error| Failure::usage(format!("{name} is no report of isochrone: {error}")))
}
