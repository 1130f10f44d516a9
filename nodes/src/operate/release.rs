//! `release`: the end of forces.

use isochrone_control::ReleaseParams;

use super::journal::COMPUTED;
use super::node;
use super::transaction::{Transaction, client, made};
use crate::failure::Failure;
use crate::{program, terminal};

/// The signals of all names: `input`, `block.pin` and `input.ok`, `block.17.pin`.
const ALL: [&str; 3] = ["*", "*.*", "*.*.*"];

/// End forces of a running node
///
/// A signal then has the value that it would have without the force: an input its newest sample, a
/// parameter the value that was set last. Prints what each signal was forced to and the value that it has without the force:
/// "as computed", where a wire or a block gives it. A force that is still to come is called off.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone release level level_raw\n  \
    isochrone release level 'ramp.*'\n  isochrone release level --all")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals to release; `*` matches within one part of a name
    #[arg(value_name = "NAME")]
    forced: Vec<String>,
    /// Release every signal that is forced
    #[arg(long, conflicts_with = "forced")]
    all: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if args.forced.is_empty() && !args.all {
        let (program, node) = (program::name(), &args.node.node);
        return Err(Failure::usage(format!(
            "name the signals to release, or give --all to release every one; `{program} forces {node}` lists them"
        )));
    }
    let mut node = args.node.connect_to_act()?;
    // The node finds the forced signals at the moment of the release.
    let all = ALL.map(str::to_owned).to_vec();
    let names = if args.all { all } else { args.forced.clone() };
    let result = node.call(&ReleaseParams { names, client: client() })?;
    if result.tasks.is_empty() {
        terminal::note(if args.all { "nothing is forced" } else { "nothing of that is forced" });
        return if args.json { terminal::print_json(&()) } else { Ok(()) };
    }
    if args.json {
        return made(result.transaction, terminal::print_json(&result));
    }
    let transaction = Transaction::from(&result);
    transaction.warn();
    let text = transaction.text(&result.after, |_| Some(COMPUTED.to_owned()));
    made(result.transaction, terminal::print(&text))
}
