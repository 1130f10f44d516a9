//! `bench`: what a controller feels, measured on the code that ships.

mod engine;
mod jitter;
mod latency;
mod live;
mod outputs;

use isochrone_blocks::BlockType;
use isochrone_engine::parse_seconds;

use crate::failure::Failure;

/// Measure release jitter, latency between processes, or the cost of blocks
///
/// Arms take short turns, so that what the machine does meanwhile meets them all; the
/// result is how they compare. Results can be kept, drawn, compared with another run (`compare`)
/// and held against a gate.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Jitter(jitter::Args),
    Latency(latency::Args),
    Engine(engine::Args),
    LatencyPeer(latency::PeerArgs),
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    match &args.what {
        What::Jitter(args) => jitter::run(args, catalogue),
        What::Latency(args) => latency::run(args),
        What::Engine(args) => engine::run(args, catalogue),
        What::LatencyPeer(args) => latency::serve(args),
    }
}

/// Reads how long a bench takes: a week at most.
fn parse_length(text: &str) -> Result<f64, String> {
    match parse_seconds(text)? {
        seconds if seconds <= 604_800.0 => Ok(seconds),
        _ => Err("give at most a week, 604800s".into()),
    }
}

/// Reads how long a turn takes: what it measures is kept in memory until it is over.
fn parse_turn(text: &str) -> Result<f64, String> {
    match parse_seconds(text)? {
        seconds @ 0.01..=60.0 => Ok(seconds),
        _ => Err("a turn takes 10ms to 60s".into()),
    }
}
