//! `set`: new values of parameters and variables.

use isochrone_control::{At, SetParams};

use super::assignment::{self, Assignment};
use super::node;
use super::transaction::{Transaction, client, made};
use crate::base::failure::Failure;
use crate::base::terminal;

/// Set parameters and variables of a running node, all of them before one cycle
///
/// A parameter is an input pin of a block that no wire leads to, and a variable is a value that operators
/// give. All values of a task take effect before the same cycle, or none does: if one is refused, nothing
/// is changed, and every reason is reported. Prints the transaction's number (for `undo`), the cycle, and
/// the values before and after.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone set level ramp.setChangeRate=5\n  \
    isochrone set level setpoint=25\n  \
    isochrone set level level.x1=-100 level.x2=27648 --comment \"sensor 3 calibrated\"\n  \
    isochrone set level ramp.setChangeRate=2 --at +500\n\n\
    A value is true, false, a number such as 5, 0.5 or 16#8F00, for a TIME a time such as T#100ms, \
    or for a callOB the name of a task.")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Parameters and variables, and their new values
    #[arg(required = true, value_name = "NAME=VALUE")]
    parameters: Vec<Assignment>,
    /// Cycle before which the values take effect, at most 10 s ahead; all must be of one task. +500: in 500
    /// cycles. Default: the next cycle
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
    let values = assignment::values(&args.parameters);
    let (at, comment, client) = (args.at, args.comment.clone(), client());
    let asked = node.ask(&SetParams { values, at, comment, client });
    let result = asked.map_err(|error| assignment::failure(error, &args.parameters))?;
    if args.json {
        return made(result.transaction, terminal::print_json(&result));
    }
    let transaction = Transaction::from(&result);
    transaction.warn();
    let text = transaction.text(&result.after, |name| assignment::written(&args.parameters, name));
    made(result.transaction, terminal::print(&text))
}
