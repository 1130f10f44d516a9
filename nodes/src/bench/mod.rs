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
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Jitter(jitter::Args),
    Latency(latency::Args),
    Engine(engine::Args),
    LatencyPeer(latency::PeerArgs),
    NodePeers(jitter::PeersArgs),
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    hold_panic_messages();
    match &args.what {
        What::Jitter(args) => jitter::run(args, catalogue),
        What::Latency(args) => latency::run(args),
        What::Engine(args) => engine::run(args, catalogue),
        What::LatencyPeer(args) => latency::serve(args),
        What::NodePeers(args) => jitter::serve(args),
    }
}
