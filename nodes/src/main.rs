//! `isochrone`: the processes of a control node, and its command line.

mod blocks;
mod check;
mod failure;
mod load;
mod numbers;
mod recording;
mod simulate;
mod table;
mod terminal;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use failure::Failure;

/// Run function blocks at a deterministic period and exchange values through shared memory.
///
/// Without a verb, `demo` runs: three processes on one machine, live values, and a summary of
/// latency and jitter at the end.
#[derive(Parser)]
#[command(name = "isochrone", version, propagate_version = true)]
#[command(after_help = "Exit status: 0 done, 1 it ran and found something wrong, 2 usage or \
    configuration error, 3 nothing to talk to.\nResults go to stdout, progress and logs to stderr.")]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
}

#[derive(Subcommand)]
enum Verb {
    Check(check::Args),
    Simulate(simulate::Args),
    Blocks(blocks::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    terminal::set_up_reports();
    let done: Result<(), Failure> = match cli.verb {
        Some(Verb::Check(args)) => check::run(&args),
        Some(Verb::Simulate(args)) => simulate::run(&args),
        Some(Verb::Blocks(args)) => blocks::run(&args),
        None => Ok(()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
