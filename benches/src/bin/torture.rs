//! Kills and stops processes, damages files and takes away memory, in turns, for as long as one likes, and sees whether
//! what isochrone promises holds.
//!
//! ```text
//! cargo run --release -p isochrone-benches --bin torture -- --minutes 10
//! ```

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant, SystemTime};

use clap::{Parser, ValueEnum};
use isochrone_benches::torture::{Row, Scarcity, Stage, Summary, starve};
use isochrone_benches::{Failure, Profile, build};
use isochrone_processes::{Stop, end_with_parent};

/// Kill and stop processes of isochrone, damage its files and take away its memory, and see whether what it promises
/// holds
///
/// The tests take turns until the time is over; each turn has a seed, by which it can be repeated. Exit status: 0
/// everything held, 1 something did not, 2 usage.
#[derive(Parser)]
#[command(name = "torture")]
struct Args {
    /// How long
    #[arg(long, default_value_t = 10.0)]
    minutes: f64,
    /// How long, in place of --minutes
    #[arg(long)]
    seconds: Option<f64>,
    /// So many turns of each test, in place of a time
    #[arg(long, conflicts_with_all = ["minutes", "seconds"])]
    turns: Option<u64>,
    /// The seed of the first turn; that of each later one is one higher
    #[arg(long)]
    seed: Option<u64>,
    /// These tests only
    #[arg(long, value_delimiter = ',')]
    only: Vec<Row>,
    /// How many faults a turn does
    #[arg(long, default_value_t = 20)]
    faults: u64,
    /// How soon a peer that was started anew must have frames, and how long a node may be silent
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS")]
    within: f64,
    /// The program to use instead of building it
    #[arg(long)]
    program: Option<PathBuf>,
    /// Do what a turn of `exhaustion` does with this, in this process: for the program itself
    #[arg(long, hide = true)]
    starve: Option<Scarcity>,
}

fn main() -> Result<ExitCode, Failure> {
    end_with_parent();
    let args = Args::parse();
    // What was started has process groups of its own: Ctrl-C does not reach it, dropping ends it.
    let stop = Stop::on_signal(|| eprintln!("ended at once by another signal; files may be left"))?;
    let program = match &args.program {
        Some(program) => std::path::absolute(program)?,
        None => build(Profile::own())?,
    };
    let within = Duration::from_secs_f64(args.within);
    let stage = Stage { program, within, faults: args.faults, stop: stop.flag() };
    let seed = args.seed.unwrap_or_else(seed_by_time);
    if let Some(scarcity) = args.starve {
        println!("{}", starve(scarcity, &stage, seed)?);
        return Ok(ExitCode::SUCCESS);
    }
    let rows = if args.only.is_empty() { Row::value_variants() } else { &args.only };
    let mut summary = Summary::new(rows);
    let since = Instant::now();
    let time = Duration::from_secs_f64(args.seconds.unwrap_or(args.minutes * 60.0));
    let is_over = |turn: u64| match args.turns {
        Some(turns) => turn >= turns,
        None => since.elapsed() >= time,
    };
    let mut turns = 0;
    'turns: while !is_over(turns) {
        let seed = seed.wrapping_add(turns);
        for row in rows {
            let turn = row.turn(&stage, seed)?;
            let (seconds, name) = (since.elapsed().as_secs(), row.name());
            let (done, wrong) = (turn.done, turn.wrong.len());
            eprintln!("{seconds} s: {name} --seed {seed}: {done} done, {wrong} failed");
            turn.wrong.iter().for_each(|wrong| eprintln!("  {wrong}"));
            summary.add(*row, seed, turn);
            if stop.is_due() {
                eprintln!("interrupted");
                break 'turns;
            }
            if args.turns.is_none() && is_over(turns) {
                break 'turns;
            }
        }
        turns += 1;
    }
    print!("{summary}");
    Ok(if summary.is_well() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn seed_by_time() -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    now.map_or(1, |now| now.as_secs())
}
