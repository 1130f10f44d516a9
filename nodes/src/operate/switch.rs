//! `switch`: hands a node over to the process that stands by.

use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{DescribeParams, DescribeResult, SwitchParams};

use super::node;
use crate::base::failure::Failure;
use crate::base::terminal;

/// How long the standby may take: it takes over when it has had the state after a cycle of its slowest task.
const PATIENCE: Duration = Duration::from_secs(5);
const PAUSE: Duration = Duration::from_millis(10);

/// Hand a redundant node over to its standby, without losing a cycle
///
/// The process that holds the node ends the cycle that it is in, and the one that stands by runs the next one. Both go on,
/// with their parts exchanged: end the new standby to start it with another version of the program.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone list\n  isochrone switch level")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect_to_act()?;
    let result = node.call(&SwitchParams {})?;
    let began = Instant::now();
    // Whoever answers is the holder.
    let is_done = |described: DescribeResult| {
        described.redundancy.is_some_and(|redundancy| redundancy.holder == result.standby)
    };
    loop {
        // A question that is on its way while the node is handed over has no answer: another one is asked.
        let is_last = began.elapsed() > PATIENCE;
        if node.call(&DescribeParams {}).is_ok_and(is_done) {
            break;
        }
        if is_last {
            return Err(Failure::found(format!(
                "process {} has not taken node \"{}\" over within {} s, and process {} goes on; see `isochrone list`",
                result.standby,
                node.name(),
                PATIENCE.as_secs(),
                result.holder
            )));
        }
        thread::sleep(PAUSE);
    }
    if args.json {
        return terminal::print_json(&result);
    }
    let (name, holder, standby) = (node.name(), result.holder, result.standby);
    terminal::print(&format!(
        "node \"{name}\" is held by process {standby} now, and process {holder} stands by\n"
    ))
}
