//! `journal`: what operators did.

use std::cell::Cell;

use isochrone_report::Table;
use isochrone_runtime::control::{Action, JournalEntry, JournalParams};
use jiff::Timestamp;

use super::node::{self, Node};
use crate::failure::Failure;
use crate::terminal;

/// List what operators did to a running node
///
/// Every set, force, release, end of a force, undo and apply: its transaction, when (UTC) and from which
/// cycle of which task on, who asked for it and why, and the values before and after. The node
/// keeps the last 10,000.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone journal level\n  isochrone journal level --follow\n  \
    isochrone journal level --json | jq '.[-1].changes'"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Go on with each new entry until Ctrl-C
    #[arg(long)]
    follow: bool,
    /// Print one JSON document; with --follow, one JSON object a line
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let entries = since(&mut node, None)?;
    if args.follow {
        return follow(&mut node, entries, args.json);
    }
    if args.json {
        return terminal::print_json(&entries);
    }
    if entries.is_empty() {
        terminal::note("nothing was changed since the node started");
    }
    terminal::print(&entries.iter().map(text).collect::<String>())
}

fn follow(node: &mut Node, first: Vec<JournalEntry>, json: bool) -> Result<(), Failure> {
    let next = Cell::new(None);
    let tell = |entries: Vec<JournalEntry>| {
        for entry in entries {
            terminal::print(&if json { terminal::json_line(&entry)? } else { text(&entry) })?;
            next.set(Some(entry.sequence + 1));
        }
        Ok(())
    };
    node.follow(first, tell, |node| since(node, next.get()))
}

/// The entries from a sequence number on, or all.
pub(super) fn since(node: &mut Node, first: Option<u64>) -> Result<Vec<JournalEntry>, Failure> {
    let mut entries: Vec<JournalEntry> = Vec::new();
    loop {
        let since = entries.last().map(|entry| entry.sequence + 1).or(first);
        let page = node.call(&JournalParams { since, limit: None })?;
        let is_last = page.entries.len() as u64 >= page.total || page.entries.is_empty();
        entries.extend(page.entries);
        if is_last {
            return Ok(entries);
        }
    }
}

fn text(entry: &JournalEntry) -> String {
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
    match (&entry.client, entry.process) {
        (Some(client), Some(process)) => text += &format!(", by {client} (pid {process})"),
        (Some(client), None) => text += &format!(", by {client}"),
        (None, Some(process)) => text += &format!(", by pid {process}"),
        (None, None) => {}
    }
    if let Some(comment) = &entry.comment {
        text += &format!(": {comment}");
    }
    let mut table = Table::default();
    for change in &entry.changes {
        let after = change.after.map_or("as computed".to_owned(), |after| after.to_string());
        table.row([change.name.clone(), change.before.to_string(), format!("-> {after}")]);
    }
    text += "\n";
    text += &table.draw(2);
    if entry.left_out > 0 {
        text += &format!("  and {} more\n", entry.left_out);
    }
    text
}

fn word(action: Action) -> &'static str {
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
fn time(unix_ns: u64) -> String {
    match Timestamp::from_nanosecond(unix_ns.into()) {
        Ok(time) => format!("{time:.3}"),
        Err(_) => format!("{unix_ns} ns"),
    }
}

#[cfg(test)]
mod tests {
    use isochrone_runtime::control::{Change, Value};

    use super::*;

    #[test]
    fn an_entry_tells_when_what_who_and_why() {
        let entry = JournalEntry {
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
            }],
            left_out: 3,
            client: Some("anna".to_owned()),
            process: Some(42),
            comment: Some("pump test".to_owned()),
            configuration: None,
        };
        assert_eq!(
            text(&entry),
            "2023-11-14T22:13:20.123Z  force 12, cycle 4711 of task \"fast\", until cycle 5711, by anna \
             (pid 42): pump test\n  a.y  0.5  -> as computed\n  and 3 more\n"
        );
    }
}
