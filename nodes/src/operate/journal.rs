//! `journal`: what operators did.

mod file;

use std::cell::Cell;
use std::path::Path;

use isochrone_control::{
    Action, AppliedChange, AskedBy, Change, Entry, JournalParams, PendingEntry,
};
use isochrone_engine::escaped;
use isochrone_report::Table;
use jiff::Timestamp;

use super::node::{self, Node};
use super::types::typed;
use crate::failure::Failure;
use crate::terminal;

/// List what operators did to a running node
///
/// Every set, force, release, end of a force, undo and apply: its transaction, when (UTC) and from which
/// cycle of which task on, who asked for it and why, and the values before and after. The node keeps
/// the last 10,000. Give the name of a file (FILE.jsonl) instead of a node's to print what `run
/// --journal` wrote there, run after run.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone journal level\n  isochrone journal level --follow\n  \
    isochrone journal level.jsonl\n  \
    isochrone journal level --json | jq '.[-1].changes'"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Go on with each new entry until Ctrl-C
    #[arg(long)]
    follow: bool,
    /// Print one JSON document; with --follow, one JSON object per line
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if let Some(file) = path(&args.node.node) {
        return in_file(file, args);
    }
    let mut node = args.node.connect()?;
    let (entries, pending) = all(&mut node, None)?;
    if args.follow {
        return follow(&mut node, entries, args.json);
    }
    if args.json {
        return terminal::print_json(&entries);
    }
    if entries.is_empty() && pending.is_empty() {
        terminal::note("nothing was changed since the node started");
    }
    terminal::print(&(listed(&entries) + &pending.iter().map(to_come).collect::<String>()))
}

/// The file, if the argument looks like a path, which names of nodes do not.
fn path(name: &str) -> Option<&Path> {
    let is_path = name.contains(".jsonl") || name.contains('/');
    is_path.then_some(Path::new(name))
}

/// Prints the runs of a file.
fn in_file(path: &Path, args: &Args) -> Result<(), Failure> {
    if args.follow {
        let path = path.display();
        return Err(Failure::usage(format!("{path} is a file: --follow follows a running node")));
    }
    file::print(path, args.json)
}

/// Entries as people read them.
fn listed(entries: &[Entry]) -> String {
    entries.iter().map(text).collect()
}

fn follow(node: &mut Node, first: Vec<Entry>, json: bool) -> Result<(), Failure> {
    let next = Cell::new(None);
    let tell = |entries: Vec<Entry>| {
        for entry in &entries {
            if json {
                terminal::print(&terminal::json_line(entry)?)?;
            }
            next.set(Some(entry.sequence + 1));
        }
        if json { Ok(()) } else { terminal::print(&listed(&entries)) }
    };
    node.follow(first, tell, |node| since(node, next.get()))
}

/// The entries from a sequence number on, or all.
fn since(node: &mut Node, first: Option<u64>) -> Result<Vec<Entry>, Failure> {
    all(node, first).map(|(entries, _)| entries)
}

/// The entries from a sequence number on, or all, and what is still to come.
pub(super) fn all(
    node: &mut Node,
    first: Option<u64>,
) -> Result<(Vec<Entry>, Vec<PendingEntry>), Failure> {
    let mut entries: Vec<Entry> = Vec::new();
    loop {
        let since = entries.last().map(|entry| entry.sequence + 1).or(first);
        let page = node.call(&JournalParams { since, limit: None })?;
        let is_last = page.entries.len() as u64 >= page.total || page.entries.is_empty();
        entries.extend(page.entries);
        if is_last {
            return Ok((entries, page.pending));
        }
    }
}

/// The value of a signal after a change, where a wire or a block gives it.
pub(super) const COMPUTED: &str = "as computed";

/// A transaction that a task has not come to yet.
fn to_come(entry: &PendingEntry) -> String {
    let PendingEntry { transaction, action, task, cycle, names, values, types, .. } = entry;
    let mut text = format!(
        "still to come             {action} {transaction}, cycle {cycle} of task \"{task}\""
    );
    text += &by(&entry.by);
    text += "\n";
    let mut table = Table::default();
    for name in names {
        let value = values.get(name).map(|value| format!("-> {}", typed(types.get(name), value)));
        table.row([escaped(name).into(), value.unwrap_or_default()]);
    }
    text + &table.draw(2)
}

/// Who asked, and why.
fn by(by: &AskedBy) -> String {
    let AskedBy { client, process, comment } = by;
    // One line, whatever others have put into it.
    let who = match (client.as_deref().map(escaped), process) {
        (Some(client), Some(process)) => format!(", by {client} (pid {process})"),
        (Some(client), None) => format!(", by {client}"),
        (None, Some(process)) => format!(", by pid {process}"),
        (None, None) => String::new(),
    };
    who + &comment.as_deref().map_or_else(String::new, |comment| format!(": {}", escaped(comment)))
}

/// Which configuration was applied.
fn applied(change: &AppliedChange) -> String {
    let AppliedChange { file, sha256, added, removed, changed, limits } = change;
    let file = file.as_deref().map_or_else(String::new, |file| format!("{}, ", escaped(file)));
    let short = sha256.get(..12).unwrap_or(sha256);
    let mut text =
        format!("  {file}sha256 {short}…: {added} added, {removed} removed, {changed} changed\n");
    for limit in limits {
        text += &format!("  limits {limit}\n");
    }
    text
}

fn text(entry: &Entry) -> String {
    let mut text = format!(
        "{}  {} {}, cycle {} of task \"{}\"",
        time(entry.unix_ns),
        word(entry.action),
        entry.transaction,
        entry.cycle,
        entry.task
    );
    if let Some(until) = entry.until_cycle {
        text += &format!(", until cycle {until}");
    }
    if let Some(undone) = entry.undone {
        text += &format!(", takes {undone} back");
    }
    text += &by(&entry.by);
    let mut table = Table::default();
    for change in &entry.changes {
        let Change { name, before, after, value_type } = change;
        let shown = |value| typed(value_type.as_ref(), value);
        let after = after.map_or(COMPUTED.to_owned(), shown);
        table.row([escaped(name).into(), shown(*before), format!("-> {after}")]);
    }
    text += "\n";
    text += &entry.applied.as_ref().map_or_else(String::new, applied);
    text += &table.draw(2);
    if entry.left_out > 0 {
        text += &format!("  and {} more\n", entry.left_out);
    }
    text
}

pub(crate) fn word(action: Action) -> &'static str {
    match action {
        Action::Set => "set",
        Action::Force => "force",
        Action::Release => "release",
        Action::Expiry => "end of force",
        Action::Undo => "undo",
        Action::Apply => "apply",
    }
}

/// An instant of UTC to the millisecond.
pub(crate) fn time(unix_ns: u64) -> String {
    match Timestamp::from_nanosecond(unix_ns.into()) {
        Ok(time) => format!("{time:.3}"),
        Err(_) => format!("{unix_ns} ns"),
    }
}

#[cfg(test)]
mod tests {
    use isochrone_control::Value;

    use super::*;

    #[test]
    fn an_entry_tells_when_what_who_and_why() {
        let entry = Entry {
            sequence: 1,
            transaction: 12,
            action: Action::Force,
            task: "fast".to_owned(),
            cycle: 4711,
            unix_ns: 1_700_000_000_123_456_789,
            until_cycle: Some(5711),
            undone: None,
            changes: vec![Change {
                name: "a.y".to_owned(),
                before: Value::Number(0.5),
                after: None,
                value_type: None,
            }],
            left_out: 3,
            by: AskedBy {
                client: Some("anna".to_owned()),
                process: Some(42),
                comment: Some("pump\ntest".to_owned()),
            },
            configuration: None,
            applied: None,
        };
        assert_eq!(
            text(&entry),
            "2023-11-14T22:13:20.123Z  force 12, cycle 4711 of task \"fast\", until cycle 5711, by anna \
             (pid 42): pump\\ntest\n  a.y  0.5  -> as computed\n  and 3 more\n"
        );
    }
}
