//! `undo`: taking a transaction back.

use std::collections::BTreeSet;

use isochrone_runtime::control::{Action, UndoParams};

use super::journal;
use super::node::{self, Node};
use super::transaction::{Transaction, client};
use crate::failure::Failure;
use crate::terminal;

/// Take back what a `set` changed in a running node
///
/// A new transaction gives the parameters the values that they had before, whole or not at all: if one
/// of them was changed since, the node refuses. Without a number, takes back the last `set` that was
/// not taken back yet.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone undo level\n  isochrone undo level 12")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Number of the transaction, as `set` and `journal` print it. Default: the last `set`
    transaction: Option<u64>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let transaction = match args.transaction {
        Some(transaction) => transaction,
        None => last_set(&mut node)?,
    };
    let result = node.call(&UndoParams { transaction, client: client() })?;
    if args.json {
        return terminal::print_json(&result);
    }
    let done = Transaction::from(&result);
    done.warn();
    let names: Vec<_> = result.before.iter().map(|(name, _)| name.to_owned()).collect();
    let after = node.read(&names)?.values;
    terminal::print(&format!("transaction {transaction} is taken back\n{}", done.text(&after)))
}

/// The last `set` that was not taken back.
fn last_set(node: &mut Node) -> Result<u64, Failure> {
    let entries = journal::since(node, None)?;
    let undone: BTreeSet<u64> = entries.iter().filter_map(|entry| entry.undone).collect();
    let sets = entries.iter().filter(|entry| entry.action == Action::Set);
    let last = sets.map(|entry| entry.transaction).filter(|set| !undone.contains(set)).max();
    last.ok_or_else(|| {
        Failure::found("nothing was set since the node started, or all of it was taken back")
    })
}
