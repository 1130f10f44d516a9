//! `bench`: what a controller feels, measured on the code that ships.

mod engine;
mod jitter;
mod latency;
mod live;
mod outputs;
mod times;

use isochrone_blocks::BlockType;
use isochrone_runtime::hold_panic_messages;

use crate::failure::Failure;

/// Measure release jitter, latency between processes, or the cost of blocks
///
/// Arms run in short alternating turns, so that disturbances of the machine affect all of them; the
/// result is their comparison. Results can be saved, plotted, compared with another run (`compare`)
/// and checked against a gate.
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: Benchmark,
}

#[derive(clap::Subcommand)]
enum Benchmark {
    Jitter(jitter::Args),
    Latency(latency::Args),
    Engine(engine::Args),
    LatencyPeer(latency::PeerArgs),
    NodePeers(jitter::PeersArgs),
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    hold_panic_messages();
    match &args.what {
        Benchmark::Jitter(args) => jitter::run(args, catalogue),
        Benchmark::Latency(args) => latency::run(args),
        Benchmark::Engine(args) => engine::run(args, catalogue),
        Benchmark::LatencyPeer(args) => latency::serve(args),
        Benchmark::NodePeers(args) => jitter::serve(args),
    }
}
