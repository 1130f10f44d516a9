//! `journal`: what operators did.

mod file;
mod text;

use std::cell::Cell;
use std::path::Path;

use isochrone_control::{Entry, JournalParams, PendingEntry};

use super::node::{self, Node};
use crate::base::failure::Failure;
use crate::base::terminal;
pub(super) use text::COMPUTED;
use text::{text, to_come};
pub(crate) use text::{time, word};

/// List what operators did to a running node
///
/// Every set, force, release, end of a force, undo, apply and acknowledgement of a process alarm: its transaction, when (UTC) and from which
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
