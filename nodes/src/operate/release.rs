//! `release`: the end of forces.

use isochrone_runtime::control::ReleaseParams;

use super::transaction::{Transaction, client};
use super::{forces, node};
use crate::failure::Failure;
use crate::terminal;

/// End forces of a running node
///
/// A signal then has the value that it would have without the force: an input its newest sample, a
/// parameter the value that was set last. Prints the forced values and those after.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone release level level_raw\n  \
    isochrone release level 'ramp.*'\n  isochrone release level --all")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals to release; `*` matches within one part of a name
    #[arg(required_unless_present = "all", value_name = "NAME")]
    forced: Vec<String>,
    /// Release every signal that is forced
    #[arg(long, conflicts_with = "forced")]
    all: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let mut names = args.forced.clone();
    if args.all {
        names.extend(forces::of(&mut node)?.into_iter().map(|force| force.name));
        if names.is_empty() {
            terminal::note("nothing is forced");
            return if args.json { terminal::print_json(&()) } else { Ok(()) };
        }
    }
    let result = node.call(&ReleaseParams { names, client: client() })?;
    if args.json {
        return terminal::print_json(&result);
    }
    let transaction = Transaction::from(&result);
    transaction.warn();
    let names: Vec<_> = result.before.iter().map(|(name, _)| name.to_owned()).collect();
    terminal::print(&transaction.text(&node.read(&names)?.values))
}
