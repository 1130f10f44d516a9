//! `undo`: taking a transaction back.

use std::collections::BTreeSet;

use isochrone_control::{Action, Entry, PendingEntry, SetResult, UndoParams};
use isochrone_engine::escaped;

use super::journal;
use super::node::{self, Node};
use super::transaction::{Transaction, client, made};
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
    /// Number of the transaction, as `set` and `journal` print it; that of an undo makes it good again.
    /// Default: the last `set`
    #[arg(value_parser = number)]
    transaction: Option<u64>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect_to_act()?;
    let (undone, undone_client) = match args.transaction {
        Some(transaction) => (transaction, client_of(&mut node, transaction)?),
        None => last_set(&mut node)?,
    };
    let result = node.call(&UndoParams { transaction: undone, client: client() })?;
    if args.json {
        let number = result.transaction;
        return made(number, terminal::print_json(&Undone { undone, undone_client, result }));
    }
    let by = undone_client.as_deref().map(escaped);
    let by = by.map_or_else(String::new, |client| format!(" of {client}"));
    let done = Transaction::from(&result);
    done.warn();
    // The stored value: a force may hide it.
    let done = done.text(&result.after, |_| None);
    let text = format!("transaction {undone}{by} is taken back\n{done}");
    made(result.transaction, terminal::print(&text))
}

/// The result of an undo, and what was undone.
#[derive(serde::Serialize)]
struct Undone {
    undone: u64,
    /// Who had asked for that, as they call themselves.
    undone_client: Option<String>,
    #[serde(flatten)]
    result: SetResult,
}

/// Who asked for a transaction, if the node knows.
fn client_of(node: &mut Node, transaction: u64) -> Result<Option<String>, Failure> {
    let (entries, _) = journal::all(node, None)?;
    let mut of_it = entries.into_iter().filter(|entry| entry.transaction == transaction);
    Ok(of_it.next().and_then(|entry| entry.by.client))
}

fn number(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "give the number of a transaction; `journal` lists them".into())
}

/// The last `set` that was not taken back, and who asked for it.
fn last_set(node: &mut Node) -> Result<(u64, Option<String>), Failure> {
    let (entries, pending) = journal::all(node, None)?;
    let node = node.name();
    let last = last_change(&entries);
    if let Some(one) = still_to_come(last.as_ref(), &pending) {
        let PendingEntry { action, transaction, cycle, task, .. } = one;
        let older = match last {
            Some(Last::Set(older)) => {
                format!("; `undo {node} {older}` takes back the set before it")
            }
            Some(Last::Apply(_)) | None => String::new(),
        };
        return Err(Failure::found(format!(
            "{action} {transaction} is still to come, in cycle {cycle} of task \"{task}\", and can be undone \
             from then on{older}"
        )));
    }
    match last {
        Some(Last::Set(transaction)) => {
            let mut of_it = entries.into_iter().filter(|entry| entry.transaction == transaction);
            Ok((transaction, of_it.next().and_then(|entry| entry.by.client)))
        }
        Some(Last::Apply(number)) => Err(Failure::found(format!(
            "the last change of node \"{node}\" is apply {number}, which cannot be undone: apply the \
             configuration from before it to go back, or name the set that is to be taken back"
        ))),
        None => {
            let force = entries.iter().rev().find(|entry| entry.action == Action::Force);
            let force = force.map_or_else(String::new, |Entry { transaction, .. }| {
                format!("; force {transaction} is no set, and ends with `release {node}` and its signals")
            });
            Err(Failure::found(format!(
                "nothing was set since the node started, or all of it was taken back{force}"
            )))
        }
    }
}

/// The last set or undo that its tasks have not all come to, if it is younger than the last change that they
/// have come to.
fn still_to_come<'p>(last: Option<&Last>, pending: &'p [PendingEntry]) -> Option<&'p PendingEntry> {
    let last = last.map_or(0, |(Last::Set(number) | Last::Apply(number))| *number);
    let mut pending = pending.iter().rev();
    pending.find(|one| matches!(one.action, Action::Set | Action::Undo) && one.transaction >= last)
}

/// The transaction that `undo` without a number takes back.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Last {
    Set(u64),
    Apply(u64),
}

/// The youngest of the sets that stand and the applies.
pub(crate) fn last_change(entries: &[Entry]) -> Option<Last> {
    let undone = taken_back(entries);
    entries.iter().rev().find_map(|entry| match entry.action {
        Action::Set if !undone.contains(&entry.transaction) => Some(Last::Set(entry.transaction)),
        Action::Apply => Some(Last::Apply(entry.transaction)),
        _ => None,
    })
}

/// The transactions that were taken back and not made good again.
pub(crate) fn taken_back(entries: &[Entry]) -> BTreeSet<u64> {
    let mut undone = BTreeSet::new();
    // An undo is younger than what it takes back, and may be taken back itself.
    for entry in entries.iter().rev().filter(|entry| entry.action == Action::Undo) {
        if !undone.contains(&entry.transaction) {
            undone.extend(entry.undone);
        }
    }
    undone
}

#[cfg(test)]
mod tests {
    use isochrone_control::{AskedBy, Values};

    use super::*;

    fn entry(transaction: u64, action: Action, undone: Option<u64>) -> Entry {
        Entry {
            sequence: transaction,
            transaction,
            action,
            task: "fast".to_owned(),
            cycle: transaction,
            unix_ns: 0,
            until_cycle: None,
            undone,
            changes: Vec::new(),
            left_out: 0,
            by: AskedBy::default(),
            configuration: None,
            applied: None,
        }
    }

    #[test]
    fn what_is_still_to_come_is_undone_before_what_was_set_earlier() {
        let one = |transaction, action| PendingEntry {
            transaction,
            action,
            task: "slow".to_owned(),
            cycle: 3,
            names: Vec::new(),
            values: Values::default(),
            types: Default::default(),
            by: AskedBy::default(),
        };
        let pending = [one(4, Action::Set), one(6, Action::Set), one(7, Action::Force)];
        let found =
            |last: Option<Last>| still_to_come(last.as_ref(), &pending).map(|one| one.transaction);
        assert_eq!(found(None), Some(6));
        assert_eq!(found(Some(Last::Set(5))), Some(6));
        assert_eq!(found(Some(Last::Set(6))), Some(6), "one of its tasks has come to it");
        assert_eq!(found(Some(Last::Set(8))), None);
        assert_eq!(found(Some(Last::Apply(8))), None);
    }

    #[test]
    fn the_last_set_that_stands_is_taken_back_unless_an_apply_is_younger() {
        let mut entries = vec![entry(1, Action::Set, None), entry(2, Action::Set, None)];
        assert_eq!(last_change(&entries), Some(Last::Set(2)));
        entries.push(entry(3, Action::Undo, Some(2)));
        assert_eq!(last_change(&entries), Some(Last::Set(1)));
        entries.push(entry(4, Action::Undo, Some(3)));
        assert_eq!(last_change(&entries), Some(Last::Set(2)), "its undo was undone");
        entries.extend([entry(5, Action::Undo, Some(2)), entry(6, Action::Undo, Some(1))]);
        assert_eq!(last_change(&entries), None);
        entries.push(entry(7, Action::Apply, None));
        assert_eq!(last_change(&entries), Some(Last::Apply(7)));
        entries.push(entry(8, Action::Set, None));
        assert_eq!(last_change(&entries), Some(Last::Set(8)));
    }
}
