//! `ack`: somebody has seen a process alarm.

use isochrone_control::{AckParams, AlarmState};

use super::node;
use super::process_alarms::moment;
use super::transaction::client;
use crate::base::failure::Failure;
use crate::base::terminal;

/// Acknowledge a process alarm of a running node
///
/// Acknowledges all occurrences of the alarm so far, or those up to --occurrence: an occurrence that came since you
/// looked then stays unacknowledged. Prints the state of the alarm. `isochrone alarms NODE` lists alarms with their
/// occurrences.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone ack level high_level\n  isochrone ack level high_level --occurrence 3 \
    --comment 'valve 7 opened'"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// The alarm
    alarm: String,
    /// The last occurrence to acknowledge; default: the newest
    #[arg(long, value_name = "N")]
    occurrence: Option<u64>,
    /// Why; for the events
    #[arg(long, value_name = "TEXT")]
    comment: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect_to_act()?;
    let (alarm, occurrence) = (args.alarm.clone(), args.occurrence);
    let params = AckParams { alarm, occurrence, comment: args.comment.clone(), client: client() };
    let result = node.call(&params)?;
    if args.json {
        return terminal::print_json(&result);
    }
    let alarm = result.alarm;
    let occurrence = occurrence.unwrap_or(alarm.occurrence);
    let state = match (alarm.state, &alarm.first) {
        (AlarmState::Normal, _) => "normal".to_owned(),
        (state, Some(first)) => format!("{}, since {}", state.words(), moment(&alarm, first)),
        (state, None) => state.words().to_owned(),
    };
    terminal::print(&format!("{} {occurrence} is acknowledged: {state}\n", alarm.name))
}
