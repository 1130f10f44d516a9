//! `show`: the signals of a node.

use std::collections::HashMap;

use isochrone_blocks::PinType;
use isochrone_report::Table;
use isochrone_runtime::control::{Role, SignalDescription, Value};
use serde_json::json;

use super::assignment::shown;
use super::node::{self, Node, Reading};
use crate::failure::Failure;
use crate::numbers::type_of;
use crate::terminal;

/// Show signals of a running node: value, unit, role and type
///
/// Roles: `input` (a value from another process), `parameter` (an input pin that no wire leads to;
/// `set` changes it), `wired` (an input pin with a wire), `output`, and `ok` and `age` of an input.
/// Signals that are forced and inputs that are not ok are marked.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone show level\n  isochrone show level 'ramp.*'\n  \
    isochrone show level --parameters")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals to show; `*` matches within one part of a name: 'ramp.*'. Default: all
    #[arg(value_name = "GLOB")]
    pattern: Option<String>,
    /// Show only parameters, which `set` can change
    #[arg(long)]
    parameters: bool,
    /// Print only the names, one per line
    #[arg(long, conflicts_with = "json")]
    names: bool,
    /// Print one JSON document, with what each signal is for
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let mut signals = node.signals(args.pattern.as_deref())?;
    if args.parameters {
        signals.retain(|signal| signal.role == Role::Parameter);
    }
    if args.names {
        let names = signals.iter().map(|signal| format!("{}\n", signal.name));
        return terminal::print(&names.collect::<String>());
    }
    let reading = read(&mut node, &signals)?;
    let values: HashMap<&str, Value> = reading.values.iter().collect();
    if args.json {
        return terminal::print_json(&json!({
            "tasks": reading.tasks,
            "signals": signals.iter().map(|signal| document(signal, &values)).collect::<Vec<_>>(),
        }));
    }
    let mut table = Table::default();
    table.row(["signal", "value", "unit", "role", "type", ""]);
    for signal in &signals {
        let value_type = type_of(&signal.value_type);
        let value = values.get(signal.name.as_str());
        // A time is written with its unit.
        let unit = signal.unit.as_deref().filter(|_| value_type != PinType::Time);
        table.row([
            &*signal.name,
            &value.map_or_else(String::new, |value| shown(*value, value_type)),
            unit.unwrap_or_default(),
            role(signal.role),
            &signal.value_type,
            &marks(signal, &values).join(", "),
        ]);
    }
    terminal::print(&table.draw(0))
}

/// The values of signals, and whether the inputs among them are ok.
fn read(node: &mut Node, signals: &[SignalDescription]) -> Result<Reading, Failure> {
    let mut names: Vec<String> = signals.iter().map(|signal| signal.name.clone()).collect();
    let inputs = signals.iter().filter(|signal| signal.role == Role::Input);
    let quality = inputs.map(|signal| ok_of(&signal.name));
    let missing: Vec<String> = quality.filter(|name| !names.contains(name)).collect();
    names.extend(missing);
    node.read(&names)
}

/// The signal that says whether an input is ok.
pub(crate) fn ok_of(input: &str) -> String {
    format!("{input}.ok")
}

/// What is to be known of a signal before its value is believed.
fn marks(signal: &SignalDescription, values: &HashMap<&str, Value>) -> Vec<&'static str> {
    let is_not_ok = signal.role == Role::Input
        && values.get(ok_of(&signal.name).as_str()) == Some(&Value::Bool(false));
    [(signal.forced, "forced"), (is_not_ok, "not ok")]
        .into_iter()
        .filter_map(|(is_so, mark)| is_so.then_some(mark))
        .collect()
}

fn document(signal: &SignalDescription, values: &HashMap<&str, Value>) -> serde_json::Value {
    let ok = (signal.role == Role::Input).then(|| values.get(ok_of(&signal.name).as_str()));
    json!({
        "name": signal.name,
        "value": values.get(signal.name.as_str()),
        "unit": signal.unit,
        "role": signal.role,
        "type": signal.value_type,
        "task": signal.task,
        "forced": signal.forced,
        "ok": ok,
        "doc": signal.doc,
    })
}

/// A role in a word.
pub(crate) fn role(role: Role) -> &'static str {
    match role {
        Role::Input => "input",
        Role::Parameter => "parameter",
        Role::Wired => "wired",
        Role::Output => "output",
        Role::Ok => "ok",
        Role::Age => "age",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_forced_signal_and_an_input_that_is_not_ok_are_marked() {
        let signal = |name: &str, role, forced| SignalDescription {
            name: name.to_owned(),
            value_type: "LREAL".to_owned(),
            unit: None,
            role,
            task: "fast".to_owned(),
            forced,
            doc: String::new(),
        };
        let values = HashMap::from([("x.ok", Value::Bool(false)), ("y.ok", Value::Bool(true))]);
        let marks = |name, role, forced| marks(&signal(name, role, forced), &values).join(", ");
        assert_eq!(marks("x", Role::Input, true), "forced, not ok");
        assert_eq!(marks("y", Role::Input, false), "");
        assert_eq!(marks("a.out", Role::Output, true), "forced");
        assert_eq!(marks("z", Role::Input, false), "", "what is not known is not said");
    }
}
