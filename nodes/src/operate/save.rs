//! `save`: the running values as configuration.

use std::path::{Path, PathBuf};

use isochrone_blocks::BlockType;
use isochrone_control::{DescribeParams, running_nodes};
use isochrone_engine::Source;
use serde_json::json;

use super::node::{self, Node};
use crate::configuration;
use crate::failure::Failure;
use crate::files::{Saved, save};
use crate::terminal;

/// Save the running values of a node as configuration
///
/// The text of the node's configuration with the values of now in place of the constants that were
/// changed; comments, order and all else stay. Forces are not saved. Prints the text to stdout, or writes it
/// to a file: whole or not at all. The old file is kept as FILE.bak, unless it has these values already.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone save level | diff level.toml -\n  \
    isochrone save level --in-place\n  isochrone save level -o tuned.toml")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Write to this file
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write to the file that the node was started with
    #[arg(long, conflicts_with = "output")]
    in_place: bool,
    /// Print one JSON document: the text, or the files that were written
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let text = node.save()?;
    let path = match &args.output {
        Some(path) if path == Path::new("-") => None,
        Some(path) => Some(path.clone()),
        None if args.in_place => Some(own_file(&mut node, &text)?),
        None => None,
    };
    let name = path.as_deref().unwrap_or(Path::new("the configuration")).display().to_string();
    configuration::note_refused_values(Source::new(name, &*text), catalogue);
    let Some(path) = path else {
        return if args.json {
            terminal::print_json(&json!({"configuration": text}))
        } else {
            terminal::print(&text)
        };
    };
    let (file, saved) = (path.display(), save(&path, &text)?);
    let (note, backup) = match &saved {
        Saved::Written => (format!("saved to {file}"), None),
        Saved::Kept(backup) => {
            (format!("saved to {file}; the old file is {}", backup.display()), Some(backup))
        }
        Saved::Unchanged => (format!("{file} has these values already; nothing was written"), None),
    };
    if args.json {
        let is_written = saved != Saved::Unchanged;
        return terminal::print_json(
            &json!({"file": path, "backup": backup, "written": is_written}),
        );
    }
    terminal::note(&note);
    Ok(())
}

/// The file that the node was started with.
fn own_file(node: &mut Node, text: &str) -> Result<PathBuf, Failure> {
    let origin = node.call(&DescribeParams {})?.configuration;
    let running = running_nodes(node.participant()).map_err(Failure::found)?;
    let process = running.into_iter().find(|one| one.name == node.name()).map(|one| one.process);
    // The name is as it was given to the node, from where it was started.
    let folder = process.and_then(|pid| std::fs::read_link(format!("/proc/{pid}/cwd")).ok());
    let file = match folder {
        Some(folder) => folder.join(&origin.file),
        None => PathBuf::from(&origin.file),
    };
    let found = Source::read(&file).map_err(|error| {
        Failure::found(format!("{error}; `save -o FILE` writes to a file of your choice"))
    })?;
    let (sha256, started) = (found.sha256(), origin.started_sha256.unwrap_or_default());
    if ![origin.sha256, started].contains(&sha256) && *found.text != *text {
        let file = file.display();
        terminal::note(&format!(
            "note: {file} was changed since the node started, by hand or by a save; its present text is \
             kept as {file}.bak"
        ));
    }
    Ok(file)
}
