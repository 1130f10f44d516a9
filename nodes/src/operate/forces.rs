//! `forces`: what is forced.

use isochrone_control::{Force, ForcesParams};
use isochrone_report::Table;

use super::node::{self, Node};
use super::types::typed;
use crate::base::failure::Failure;
use crate::base::terminal;

/// List what is forced in a running node
///
/// For each signal, shows the value that it is held at, the first cycle with the force, the first
/// cycle without it, and who asked for it.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone forces level\n  isochrone forces level --json | jq length"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Print only the names, one per line
    #[arg(long, conflicts_with = "json")]
    names: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let forces = of(&mut node)?;
    if args.names {
        let names = forces.iter().map(|force| format!("{}\n", force.name));
        return terminal::print(&names.collect::<String>());
    }
    if args.json {
        return terminal::print_json(&forces);
    }
    if forces.is_empty() {
        terminal::note("nothing is forced");
        return Ok(());
    }
    let mut table = Table::default();
    table.row(["signal", "value", "since cycle", "until cycle", "by"]);
    for force in forces {
        let until = force.until_cycle.map_or("release".to_owned(), |cycle| cycle.to_string());
        let value = typed(force.value_type.as_ref(), force.value);
        let since = force.since_cycle.to_string();
        table.row([force.name, value, since, until, force.client.unwrap_or_default()]);
    }
    terminal::print(&table.draw(0))
}

/// All forces of a node.
pub(super) fn of(node: &mut Node) -> Result<Vec<Force>, Failure> {
    node.pages(
        |offset| ForcesParams { offset: Some(offset), limit: None },
        |page| (page.total, page.forces),
    )
}
