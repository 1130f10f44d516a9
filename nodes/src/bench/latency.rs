//! `bench latency`.

use super::outputs;
use crate::failure::Failure;

/// Measure how long a message takes from one process to another
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    outputs: outputs::Args,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let _ = args.outputs.open()?;
    Err(Failure::found("not there yet"))
}
