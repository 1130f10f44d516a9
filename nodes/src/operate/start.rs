//! `start`: lets a node send that goes on from its retained state.

use isochrone_control::StartParams;

use super::node;
use crate::base::failure::Failure;
use crate::base::terminal;

/// Let a node that waits after a warm start begin to send
///
/// With warm_start = "confirm", a node that finds a retained state runs its cycles and sends nothing until this verb lets
/// it. Look first at where it stands (`get`, `watch`, `top`).
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone get level 'ramp.*'\n  isochrone start level")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect_to_act()?;
    let result = node.call(&StartParams {})?;
    if args.json {
        return terminal::print_json(&result);
    }
    let name = node.name();
    terminal::print(&if result.waited {
        format!("node \"{name}\" sends from its next cycles on\n")
    } else {
        format!("node \"{name}\" was not waiting; it sends already\n")
    })
}
