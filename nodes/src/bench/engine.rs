//! `bench engine`.

use super::outputs;
use crate::failure::Failure;

/// Measure what a block costs
#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    outputs: outputs::Args,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let _ = args.outputs.open()?;
    Err(Failure::found("not there yet"))
}
