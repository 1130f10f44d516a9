//! `apply`: another configuration while the node runs.

use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use isochrone_control::{
    ApplyParams, ApplyResult, ChangedValue, ClientError, Code, ConfigPlace, Given, Tuned,
};
use isochrone_engine::{Diagnostic, Diagnostics, Problem, Source};
use isochrone_report::Table;
use isochrone_timing::units::counted;

use super::node;
use super::transaction::{client, made, since, warn};
use super::types::typed;
use crate::base::failure::Failure;
use crate::base::terminal;

/// A configuration of a million blocks takes half a minute to check. Who is tired of waiting presses
/// Ctrl-C: what nobody waits for is not applied.
const PATIENCE: Duration = Duration::from_secs(600);

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
    /// Reason, for the journal
    #[arg(long, value_name = "TEXT")]
    comment: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let source = Source::read(&args.file).map_err(Failure::usage)?;
    let mut node = args.node.connect_to_act()?;
    node.wait_for(PATIENCE);
    let params = ApplyParams {
        configuration: source.text.to_string(),
        file: Some(source.name.clone()),
        dry_run: Some(args.dry_run),
        allow_missed: Some(args.allow_missed),
        comment: args.comment.clone(),
        client: client(),
    };
    let mut is_noted = false;
    let waiting = |refused: &isochrone_control::Refusal| {
        if !std::mem::replace(&mut is_noted, true) {
            terminal::note(&not_yet(refused));
        }
    };
    let asked = node.ask_again(PATIENCE, waiting, |node| node.ask(&params));
    let result = asked.map_err(|error| refused(error, source))?;
    let with_number = |printed| match result.transaction {
        Some(number) => made(number, printed),
        None => printed,
    };
    if args.json {
        return with_number(terminal::print_json(&result));
    }
    warn(&result.warnings);
    let head = match (result.transaction, &result.refused) {
        (Some(number), _) => format!("transaction {number}, applied{}", since(&result.tasks)),
        (None, Some(reason)) => format!("nothing was changed; it would be refused now: {reason}"),
        (None, None) => "nothing was changed; it would be:".into(),
    };
    with_number(terminal::print(&format!("{head}\n{}", text(&result))))
}

/// Why the node has to be asked again. What is in the way of a change has findings, each about a transaction.
fn not_yet(refused: &isochrone_control::Refusal) -> String {
    let why = &refused.message;
    let what = match &refused.findings[..] {
        [] => "the node",
        _ => "the transactions that are on their way, of others or for a later cycle",
    };
    format!("waits for {what}: {why} (Ctrl-C ends the wait)")
}

/// How the verb ends when the node does not do it. Errors of the file are shown as `check` shows them.
fn refused(error: ClientError, source: Source) -> Failure {
    match error {
        ClientError::Refused(isochrone_control::Refusal {
            code: Code::Configuration,
            findings,
            ..
        }) => {
            terminal::note("the node refuses, and nothing was changed:");
            let findings = findings.into_iter().map(|one| placed(one, &source)).collect();
            Failure::configuration(Diagnostics::new(source, findings))
        }
        ClientError::Refused(isochrone_control::Refusal { code: Code::InvalidRequest, .. }) => {
            Failure::usage(format!(
                "{} has {} bytes, which is more than a running node takes (256 KiB as JSON): take out what is not \
                 needed, such as comments, write blocks of one kind as one entry with `count`, or start the node again \
                 with the file",
                source.name,
                source.text.len()
            ))
        }
        error => node::failure(error, node::Purpose::Change),
    }
}

/// A finding of the node, at its place in the file.
fn placed(found: isochrone_control::Finding, source: &Source) -> Diagnostic {
    let bytes = |span: Range<u64>| {
        let [start, end] = [span.start, span.end].map(|byte| usize::try_from(byte).ok());
        let span = start?..end?;
        source.text.get(span.clone()).is_some().then_some(span)
    };
    let (span, first) = match found.place {
        Some(ConfigPlace { span, first, .. }) => (bytes(span), first.and_then(bytes)),
        None => (None, None),
    };
    // Which kind of error it is, the node does not tell.
    let mut finding = Diagnostic::new(Problem::Syntax, span.unwrap_or_default(), found.message);
    finding.first = first;
    match found.help {
        Some(help) => finding.help(help),
        None => finding,
    }
}

fn text(result: &ApplyResult) -> String {
    let mut table = Table::default();
    /// How many unchanged blocks are named.
    const KEPT: usize = 12;
    let number = [counted(result.kept.len(), "block")];
    let kept = if result.kept.len() > KEPT { &number[..] } else { &result.kept };
    let values = result.values.iter().map(|ChangedValue { name, before, after, value_type }| {
        let shown = |given: &Given| match given {
            Given::Value(value) => typed(value_type.as_ref(), *value),
            Given::Wire { wire } => wire.clone(),
        };
        match (shown(before), shown(after)) {
            (before, after) if before == after => format!("{name}: is {after} already"),
            (before, after) => format!("{name}: {before} -> {after}"),
        }
    });
    let left_out = result.values_left_out;
    let more = (left_out > 0).then(|| format!("and {left_out} more"));
    let values: Vec<_> = values.chain(more).collect();
    let changed = if result.values.is_empty() { &result.changed } else { &values };
    let tuned = result.tuned.iter().map(|Tuned { name, value, configured, value_type }| {
        let [value, configured] =
            [value, configured].map(|value| typed(value_type.as_ref(), *value));
        format!("{name} at {value}, as it was set (the file has {configured})")
    });
    let tuned: Vec<_> = tuned.collect();
    for (what, names) in [
        ("added", &result.added[..]),
        ("removed", &result.removed),
        ("changed", changed),
        ("stays", &tuned),
        ("limits", &result.limits),
        ("loses", &result.lost_alarms),
        ("kept", kept),
    ] {
        if names.is_empty() && !["limits", "loses", "stays"].contains(&what) {
            table.row([what, "nothing"]);
        }
        for (index, name) in names.iter().enumerate() {
            table.row([if index == 0 { what } else { "" }, name]);
        }
    }
    table.row([
        "cost",
        &format!("{} us", crate::base::numbers::six_digits(result.cost_ns as f64 / 1e3)),
    ]);
    table.draw(2)
}

#[cfg(test)]
mod tests {
    use isochrone_control::Value;

    use super::*;

    #[test]
    fn what_changes_is_listed_name_by_name() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let result = ApplyResult {
            transaction: Some(7),
            tasks: Default::default(),
            warnings: Vec::new(),
            added: names(&["filter", "limit"]),
            removed: Vec::new(),
            kept: names(&["level", "ramp"]),
            changed: names(&["ramp.value", "ramp.setChangeRate"]),
            values: vec![
                ChangedValue {
                    name: "ramp.value".into(),
                    before: Given::Value(Value::Number(1.5)),
                    after: Given::Wire { wire: "level.y".into() },
                    value_type: None,
                },
                ChangedValue {
                    name: "ramp.setChangeRate".into(),
                    before: Given::Value(Value::Integer(10)),
                    after: Given::Value(Value::Integer(20)),
                    value_type: None,
                },
                // It was set to what the file has now.
                ChangedValue {
                    name: "ramp.defaultOutValue".into(),
                    before: Given::Value(Value::Number(2.0)),
                    after: Given::Value(Value::Number(2.0)),
                    value_type: None,
                },
            ],
            values_left_out: 3,
            tuned: vec![Tuned {
                name: "beat.reset".into(),
                value: Value::Bool(true),
                configured: Value::Bool(false),
                value_type: None,
            }],
            limits: names(&["ramp.*: none -> 0.0 to 1.0"]),
            lost_alarms: names(&["high (2 unacknowledged occurrences)"]),
            cost_ns: 12_340,
            refused: None,
        };
        assert_eq!(
            text(&result),
            "  added    filter\n           limit\n  removed  nothing\n  \
             changed  ramp.value: 1.5 -> level.y\n           ramp.setChangeRate: 10 -> 20\n           ramp.defaultOutValue: is 2 already\n           and 3 more\n  \
             stays    beat.reset at TRUE, as it was set (the file has FALSE)\n  \
             limits   ramp.*: none -> 0.0 to 1.0\n  loses    high (2 unacknowledged occurrences)\n  kept     level\n           ramp\n  cost     12.34 us\n"
        );
    }
}
