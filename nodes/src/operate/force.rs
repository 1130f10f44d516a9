//! `force`: holding signals at values.

use clap::ArgGroup;
use isochrone_control::{At, ForceParams, Hold, Values, Written};
use isochrone_engine::parse_seconds;

use super::assignment::{self, Assignment};
use super::node;
use super::transaction::{Transaction, client, made};
use crate::base::failure::Failure;
use crate::base::terminal;
use crate::program;

/// Hold signals of a running node at values, whatever would change them
///
/// An input is held after it was read, an input pin after its wires were copied, an output pin after
/// its block stepped. A force ends exactly at its cycle, or when `release` or the node's end ends it.
/// The node's configuration must say control = "force".
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone force level level_raw=13824 --seconds 30\n  \
    isochrone force level level.y=0.5 --hold --comment \"sensor is being changed\"\n\n\
    A value is true, false, a number such as 5, 0.5 or 16#8F00, or, for a TIME, a time such as T#100ms.")]
#[command(group = ArgGroup::new("duration").args(["seconds", "hold"]).required(true))]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals and the values to hold them at
    #[arg(required = true, value_name = "NAME=VALUE")]
    assignments: Vec<Assignment>,
    /// Hold the values for this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Hold the values until `release`
    #[arg(long)]
    hold: bool,
    /// Cycle before which the force begins, at most 10 s ahead; all signals must be of one task. +500: in
    /// 500 cycles. Default: the next cycle
    #[arg(long, value_name = "CYCLE")]
    at: Option<At>,
    /// Reason, for the journal
    #[arg(long, value_name = "TEXT")]
    comment: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect_to_act()?;
    let force = ForceParams {
        values: assignment::values(&args.assignments),
        seconds: args.seconds.map_or(Hold::UntilReleased, Hold::Seconds),
        at: args.at,
        comment: args.comment.clone(),
        client: client(),
    };
    let asked = node.ask(&force);
    let result = asked.map_err(|error| assignment::failure(error, &args.assignments))?;
    if args.json {
        return made(result.transaction, terminal::print_json(&result));
    }
    let transaction = Transaction::from(&result);
    transaction.warn();
    let mut text =
        transaction.text(&result.after, |name| assignment::written(&args.assignments, name));
    for (task, until) in &result.until {
        if let Some(cycle) = until {
            text += &format!("until cycle {cycle} of task \"{task}\"\n");
        }
    }
    if args.hold {
        text += &format!(
            "until `{} release {} {}`\n",
            program::name(),
            node.name(),
            names(&force.values)
        );
    }
    made(result.transaction, terminal::print(&text))
}

/// What `release` takes to end the forces of these signals.
fn names(values: &Values<Written>) -> String {
    /// As many as a line holds.
    const MOST: usize = 3;
    let names: Vec<&str> = values.0.iter().map(|(name, _)| name.as_str()).collect();
    if names.len() > MOST { "--all".into() } else { names.join(" ") }
}
