//! `replay`: a node's recording through the engine again, and what is not as it was.

mod comparison;
mod document;
mod missing;
mod operations;
mod output;
mod recorded;
mod rerun;
mod task;

use std::path::PathBuf;

use isochrone_blocks::BlockType;
use isochrone_engine::{MAX_BYTES, Plan, Source};
use isochrone_runtime::hold_panic_messages;
use isochrone_timing::units::counted;

use self::comparison::{Comparison, Tolerance};
use self::recorded::Recorded;
use self::rerun::Rerun;
use crate::failure::Failure;
use crate::files::{ResultFile, keep_apart};
use crate::mcap_file::warn_of_damage;
use crate::rows::Rows;
use crate::{configuration, numbers, stop, terminal};

/// Repeat the run of a node from its recording, and compare every value
///
/// Reads what `run --record` wrote: the configuration, the inputs of every cycle, which cycle of other
/// tasks each cycle read, and everything that was done to the node go through the engine again, as fast as
/// it goes. Every signal of every output is compared bit for bit. Cycles that were missed are missed again.
/// The exit status is 0 if all values are the same, 1 if one is not, and 4 if none differs but not everything
/// was compared, because rows were lost, the file was not closed or is damaged, or the configuration lacks what was
/// recorded.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone replay level.mcap\n  \
    isochrone replay level.mcap --config new.toml --tolerance 0.001 --report differences.json\n  \
    isochrone replay level.mcap --config new.toml --output new.csv\n  \
    isochrone replay level.mcap --config renamed.toml --allow-missing")]
pub(crate) struct Args {
    /// Recording of a node, from `run --record`
    #[arg(value_name = "FILE.mcap")]
    file: PathBuf,
    /// Repeat the run with this configuration in place of the recorded one. Inputs, tasks and outputs are
    /// found by their names; online changes of the run are left out
    #[arg(long, value_name = "NEW.toml")]
    config: Option<PathBuf>,
    /// Accept that the configuration does not have some tasks, inputs and signals of the recording. Without this,
    /// the exit status is then 4, even if all else is the same
    #[arg(long, requires = "config")]
    allow_missing: bool,
    /// Accept that the recording has only a part of the run: it was not closed, parts of it are damaged, or rows were
    /// lost. What can be compared must still be the same. Without this, the exit status is then 4
    #[arg(long)]
    incomplete: bool,
    /// Take values for the same that differ by at most this much. Without it, all bits must be the same
    #[arg(long, value_name = "X", value_parser = parse_tolerance, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Write what differs as JSON
    #[arg(long, value_name = "OUT.json")]
    report: Option<PathBuf>,
    /// Write every signal of every repeated cycle as CSV, "-" for stdout: `time_s`, `cycle`, `task`, and a
    /// column SERVICE.SIGNAL for each signal, which is empty in the rows of other tasks
    #[arg(long, value_name = "ALL.csv")]
    output: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    for written in [&args.report, &args.output].into_iter().flatten() {
        configuration::keep(&args.file, written)?;
        args.config.iter().try_for_each(|config| configuration::keep(config, written))?;
    }
    keep_apart([&args.report, &args.output].into_iter().flatten())?;
    let stop = stop::on_signal(None)?;
    let recorded = Recorded::read(&args.file, &stop)?;
    let plan = plan(args, &recorded, catalogue)
        .inspect_err(|_| warn_of_damage(&args.file, &recorded.condition))?;
    let report = args.report.as_deref().map(ResultFile::open).transpose()?;
    let rows = args.output.as_deref().map(Rows::create).transpose()?;
    recorded.note(&args.file);
    let tolerance = args.tolerance.map_or(Tolerance::Bits, Tolerance::Absolute);
    hold_panic_messages();
    let is_other = args.config.is_some();
    let mut rerun = Rerun::new(plan, &recorded, is_other, args.allow_missing, tolerance)?;
    rerun.run(&args.file, rows, &stop)?;
    let mut outcome = rerun.finish();
    // Parts of the recording that were not compared are not its fault.
    outcome.may_be_incomplete = args.incomplete && !stop.is_due();
    if let Some(report) = report {
        report.write_report(&outcome.document(args, &recorded))?;
    }
    outcome.note();
    let Comparison { compared, different, .. } = &outcome.comparison;
    let values = counted(*compared, "value");
    let cycles = counted(outcome.cycles(), "cycle");
    let tasks = counted(outcome.tasks.len() as u64, "task");
    let ran = format!("{cycles} of {tasks} of \"{}\"", recorded.node.name);
    if let Some(first) = outcome.comparison.first() {
        if outcome.comparison.differing().count() > 1 {
            terminal::print(&outcome.comparison.table())?;
        }
        return Err(Failure::found(format!(
            "{first}; of {values} in {ran}, {different} {differ}",
            differ = if *different == 1 { "differs" } else { "differ" },
        )));
    }
    if let Some(mut why) = outcome.uncompared() {
        if is_other && !outcome.missing.is_empty() && !args.allow_missing {
            why += " (if they are meant to be missing, give --allow-missing)";
        }
        if !args.incomplete && outcome.is_part() {
            why += " (--incomplete accepts a part of a run)";
        }
        return Err(Failure::inconclusive(format!("{why}; {values} in {ran} are the same")));
    }
    let how = match tolerance {
        Tolerance::Bits => "bit for bit".to_owned(),
        Tolerance::Absolute(most) => format!("within {}", numbers::format(most)),
    };
    terminal::print(&format!("the same, {how}: {values} in {ran}\n"))
}

/// The configuration that is to run.
fn plan(args: &Args, recorded: &Recorded, catalogue: &[BlockType]) -> Result<Plan, Failure> {
    if let Some(path) = &args.config {
        let plan = configuration::plan(path, catalogue)?;
        configuration::note_warnings(&plan);
        return Ok(plan);
    }
    let file = args.file.display();
    let text = recorded.configuration.as_deref().ok_or_else(|| {
        Failure::usage(format!(
            "{file} has no configuration that can be read; give the one of the run by --config"
        ))
    })?;
    if text.len() as u64 > MAX_BYTES {
        let most = MAX_BYTES >> 20;
        return Err(Failure::usage(format!("the configuration in {file} has over {most} MiB")));
    }
    let name = format!("{file} ({})", recorded.node.file);
    configuration::plan_of(Source::new(name, text), catalogue)
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    match numbers::parse_number(text) {
        // The sign goes from -0.
        Ok(most) if most.is_finite() && most >= 0.0 => Ok(most.abs()),
        _ => Err("give the largest difference of two values, from 0, such as 0.001".into()),
    }
}
