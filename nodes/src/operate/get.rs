//! `get`: values alone.

use super::node;
use crate::failure::Failure;
use crate::terminal;

/// Print values of a running node, one a line
///
/// All values of a task are of the same cycle, after its blocks stepped. The values stand alone, with
/// all their digits, so that a script can use them; `set` takes them as they are.
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
    let reading = args.node.connect()?.read(&args.names)?;
    if args.json {
        return terminal::print_json(&reading);
    }
    terminal::print(
        &reading.values.iter().map(|(_, value)| format!("{value}\n")).collect::<String>(),
    )
}
