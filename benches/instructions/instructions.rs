//! Instructions per instance and cycle, counted by callgrind: the guard against a slower engine that
//! no noise can hide, held against `baseline.toml`.
//!
//! ```text
//! cargo bench --profile release -p isochrone-instructions
//! ```
//!
//! This program runs itself under `valgrind`, once for so many cycles and once for twice as many. The
//! difference is what those cycles executed; what came before them is in neither.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::thread;

use clap::Parser;
use isochrone_blocks::CATALOGUE;
use isochrone_engine::{Plan, Rules, TaskEngine, Workload};
use isochrone_instructions::{Baseline, Failure, Verdict};

#[derive(Parser)]
struct Args {
    /// Make what is counted now the baseline
    #[arg(long)]
    write: bool,
    /// Only see whether every workload runs
    #[arg(long)]
    test: bool,
    /// Step a workload this often, for callgrind to count
    #[arg(long, hide = true, requires = "workload")]
    cycles: Option<u64>,
    /// The workload to step
    #[arg(long, hide = true)]
    workload: Option<String>,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

const INSTANCES: usize = 1_000;
/// Whole periods of the saws: theirs are 110 cycles.
const CYCLES: u64 = 660;

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::FAILURE
        }
    }
}

/// Whether nothing costs more than the baseline allows.
fn run(args: &Args) -> Result<bool, Failure> {
    let mut workloads = Workload::all(CATALOGUE);
    workloads.extend([Workload::Alarms, Workload::Expressions]);
    if let (Some(cycles), Some(name)) = (args.cycles, &args.workload) {
        let named = workloads.iter().find(|workload| workload.name() == name);
        step(named.ok_or_else(|| format!("there is no workload \"{name}\""))?, cycles)?;
        return Ok(true);
    }
    if args.test {
        workloads.iter().try_for_each(|workload| step(workload, 1))?;
        return Ok(true);
    }
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("nothing is counted: there is no valgrind here; apt-get install valgrind");
        return Ok(true);
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("baseline.toml");
    let mut baseline = Baseline::read(&path)?;
    let mut counted = BTreeMap::new();
    // Other processes change nothing of what is counted, so two run at a time.
    for pair in workloads.chunks(2) {
        for (workload, instructions) in count_together(pair)? {
            eprintln!("{workload:<28}{instructions:>8.2} instructions per instance and cycle");
            counted.insert(workload, instructions);
        }
    }
    if args.write {
        baseline.replace(counted, compiler());
        baseline.write(&path)?;
        eprintln!("written to {}", path.display());
        return Ok(true);
    }
    let verdicts = baseline.judge(&counted, &compiler());
    verdicts.iter().for_each(|verdict| eprintln!("{verdict}"));
    Ok(!verdicts.iter().any(Verdict::fails))
}

/// Steps a workload; this is what is counted.
fn step(workload: &Workload, cycles: u64) -> Result<(), Failure> {
    let plan = Plan::new(workload.source(INSTANCES), &Rules::default())?;
    let mut engine = TaskEngine::build(&plan)?.pop().ok_or("the workload has no task")?;
    (0..cycles).for_each(|cycle| engine.step(std::hint::black_box(cycle)));
    match engine.block_errors() {
        0 => Ok(()),
        errors => Err(format!("{}: {errors} block errors", workload.name()).into()),
    }
}

/// Instructions per instance and cycle of each of these workloads.
fn count_together(workloads: &[Workload]) -> Result<Vec<(String, f64)>, Failure> {
    thread::scope(|scope| {
        let count = |workload| scope.spawn(move || count(workload).map_err(|it| it.to_string()));
        let counts: Vec<_> = workloads.iter().map(count).collect();
        let counts = counts.into_iter().zip(workloads).map(|(count, workload)| {
            let counted = count.join().map_err(|_| "a count panicked")??;
            Ok((workload.name().to_owned(), counted))
        });
        counts.collect()
    })
}

/// Instructions per instance and cycle.
fn count(workload: &Workload) -> Result<f64, Failure> {
    let (once, twice) = (executed(workload, CYCLES)?, executed(workload, 2 * CYCLES)?);
    let added = twice.checked_sub(once).ok_or("twice the cycles took fewer instructions")?;
    Ok(added as f64 / (CYCLES as f64 * INSTANCES as f64))
}

/// Instructions that this program executes to build a workload and step it.
fn executed(workload: &Workload, cycles: u64) -> Result<u64, Failure> {
    let mut command = Command::new("valgrind");
    command.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    command.arg(std::env::current_exe()?);
    command.args(["--workload", workload.name(), "--cycles", &cycles.to_string()]);
    let output = command.output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let collected = said.lines().find_map(|line| line.split_once("Collected :"));
    let number = collected.and_then(|(_, number)| number.trim().parse().ok());
    match (output.status.success(), number) {
        (true, Some(executed)) => Ok(executed),
        _ => Err(format!("callgrind failed with {}: {said}", output.status).into()),
    }
}

/// The compiler, for a baseline to name; empty if it cannot be asked.
fn compiler() -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("--version").output();
    output.map_or_else(
        |_| String::new(),
        |output| String::from_utf8_lossy(&output.stdout).trim().to_owned(),
    )
}
