//! `apply`: another configuration while the node runs.

use std::path::PathBuf;

use isochrone_engine::Source;
use isochrone_report::Table;
use isochrone_runtime::control::{ApplyParams, ApplyResult};
use isochrone_timing::units::counted;

use super::node;
use super::transaction::{client, since};
use crate::failure::Failure;
use crate::terminal;

/// Change the configuration of a running node without stopping it
///
/// Tasks, inputs and outputs must be the same; blocks, wires and constants may differ. Each task changes
/// before one of its cycles, all at one instant. A block of the same name, type and task keeps its state;
/// a new one starts from rest. A pin whose constant differs takes the new one, all others keep
/// their running values. The node's configuration must say control = "force".
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone apply level level.toml --dry-run\n  \
    isochrone apply level level.toml")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// New configuration (TOML)
    file: PathBuf,
    /// Change nothing; print what would change and what it would cost
    #[arg(long)]
    dry_run: bool,
    /// Change also if a task misses cycles by it
    #[arg(long)]
    allow_missed: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let source = Source::read(&args.file).map_err(Failure::usage)?;
    let mut node = args.node.connect()?;
    let result = node.call(&ApplyParams {
        configuration: source.text.to_string(),
        dry_run: Some(args.dry_run),
        allow_missed: Some(args.allow_missed),
        client: client(),
    })?;
    if args.json {
        return terminal::print_json(&result);
    }
    let head = if args.dry_run {
        "nothing was changed; it would be:".into()
    } else {
        format!("applied{}", since(&result.tasks))
    };
    terminal::print(&format!("{head}\n{}", text(&result)))
}

fn text(result: &ApplyResult) -> String {
    let mut table = Table::default();
    for (what, names) in
        [("added", &result.added), ("removed", &result.removed), ("changed", &result.changed)]
    {
        if names.is_empty() {
            table.row([what, "nothing"]);
        }
        for (index, name) in names.iter().enumerate() {
            table.row([if index == 0 { what } else { "" }, name]);
        }
    }
    table.row(["kept", &counted(result.kept.len(), "block")]);
    table.row(["cost", &format!("{} us", crate::numbers::six_digits(result.cost_ns as f64 / 1e3))]);
    table.draw(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_is_listed_name_by_name() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let result = ApplyResult {
            tasks: Default::default(),
            added: names(&["filter", "limit"]),
            removed: Vec::new(),
            kept: names(&["level", "ramp"]),
            changed: names(&["ramp.value"]),
            cost_ns: 12_340,
        };
        assert_eq!(
            text(&result),
            "  added    filter\n           limit\n  removed  nothing\n  changed  ramp.value\n  \
             kept     2 blocks\n  cost     12.34 us\n"
        );
    }
}
