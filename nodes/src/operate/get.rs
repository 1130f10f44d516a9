//! `get`: values alone.

use super::node;
use crate::failure::Failure;
use crate::terminal;

/// Print values of a running node, one per line
///
/// All values of a task are of the same cycle, after its blocks stepped. The values stand alone, as `show`
/// writes them but with all their digits; `set` takes them as they are. A program had better use --json,
/// where a TIME is a number of milliseconds and a WORD a whole number.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone get level ramp.setChangeRate\n  \
    isochrone get level level.y level_raw.ok\n  isochrone get level 'ramp.*' --json")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals: inputs, `block.pin`, `block.17.pin`; `*` matches within one part of a name
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    /// Print one JSON document, with names and cycles
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let reading = node.read(&args.names)?;
    if args.json {
        return terminal::print_json(&reading);
    }
    let known = node.known(reading.values.iter().map(|(name, _)| name))?;
    let lines = reading.values.iter().map(|(name, value)| known.shown(name, value) + "\n");
    terminal::print(&lines.collect::<String>())
}
