//! `show`: the signals of a node.

use std::collections::{HashMap, HashSet};

use isochrone_blocks::PinType;
use isochrone_control::{Role, SignalDescription, Value};
use isochrone_report::Table;
use serde_json::json;

use super::forces;
use super::node::{self, Node};
use super::reading::Reading;
use crate::base::failure::Failure;
use crate::base::numbers::{self, Digits, shown_value, type_of};
use crate::base::terminal;

/// Show signals of a running node: value, unit, role, type and comment
///
/// Roles: `input` (a value from another process), `variable` (a value that operators give) and `parameter`
/// (an input pin that no wire leads to), which `set` changes, `wired` (an input pin with a wire), `output`,
/// and `ok` and `age` of an input. Also noted: whether a signal is forced or protected, whether an input is not
/// ok, the limits of a value, the comment of the configuration, and the flags that a frame with the signal
/// alone would carry, such as `STALE` where a value is computed from a dead sensor.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone show level\n  isochrone show level ramp level_raw\n  isochrone show level 'ramp.set*'\n  \
    isochrone show level --parameters"
)]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals to show, or blocks with all of their pins; `*` matches within one part of a name:
    /// 'ramp.set*'. Default: all
    #[arg(value_name = "NAME")]
    patterns: Vec<String>,
    /// Show only parameters and variables, which `set` can change unless they are marked as protected
    #[arg(long)]
    parameters: bool,
    /// Show only what `force` can hold: everything but the ages of inputs
    #[arg(long, conflicts_with = "parameters")]
    forceable: bool,
    /// Print only the names, one per line
    #[arg(long, conflicts_with = "json")]
    names: bool,
    /// Print one JSON document, with what each signal is for
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let SelectedSignals { mut signals, left_out } = chosen(&mut node, &args.patterns)?;
    if args.parameters {
        signals.retain(|signal| signal.role.is_settable());
    }
    if args.forceable {
        signals.retain(|signal| signal.role != Role::Age);
    }
    if args.names {
        let names = signals.iter().map(|signal| format!("{}\n", signal.name));
        return terminal::print(&names.collect::<String>());
    }
    let reading = read(&mut node, &signals)?;
    let values: HashMap<&str, Value> = reading.values.iter().collect();
    let truth = truth(&mut node, &signals)?;
    let mut oks = values.clone();
    oks.extend(truth.iter().map(|(name, is_ok)| (name.as_str(), Value::Bool(*is_ok))));
    if args.json {
        return terminal::print_json(&json!({
            "tasks": reading.tasks,
            "signals": signals.iter().map(|signal| document(signal, (&values, &oks), &reading)).collect::<Vec<_>>(),
        }));
    }
    let mut table = Table::default();
    table.row(["signal", "value", "unit", "role", "type", "", ""]);
    let mut shown = None;
    for signal in &signals {
        let value_type = type_of(&signal.value_type);
        let value = values.get(signal.name.as_str());
        // A time is written with its unit.
        let unit = signal.unit.as_deref().filter(|_| value_type != PinType::Time);
        let comment = signal.comment.as_deref();
        let is_new = std::mem::replace(&mut shown, comment) != comment;
        table.row([
            &*signal.name,
            &value.map_or_else(String::new, |value| shown_value(*value, value_type, Digits::Six)),
            unit.unwrap_or_default(),
            role(signal.role),
            &signal.value_type,
            &marks(signal, &oks, &reading).join(", "),
            // That of a block is shown with the first of its pins.
            comment.filter(|_| is_new).unwrap_or_default(),
        ]);
    }
    terminal::print(&table.draw(0))?;
    if !left_out.is_empty() {
        let more =
            left_out.iter().map(|(pattern, count)| format!("{count} more match '{pattern}'"));
        let more = more.collect::<Vec<_>>().join(", ");
        terminal::note(&format!("note: * stands for one part of a name: {more}"));
    }
    Ok(())
}

/// The selected signals, and patterns that may have been intended, too.
#[derive(Default)]
struct SelectedSignals {
    signals: Vec<SignalDescription>,
    /// Patterns of longer names, and how many signals match each.
    left_out: Vec<(String, u64)>,
}

/// The signals that names, globs and blocks select; all signals without any.
fn chosen(node: &mut Node, patterns: &[String]) -> Result<SelectedSignals, Failure> {
    if patterns.is_empty() {
        return Ok(SelectedSignals { signals: node.signals(None)?, ..SelectedSignals::default() });
    }
    let mut chosen = SelectedSignals::default();
    let mut names = HashSet::new();
    for pattern in patterns {
        let is_for_all = pattern == "*" || pattern.ends_with(".*");
        let mut found = Vec::new();
        // A name, that of an instance, or that of a block with several.
        for pins in ["", ".*", ".*.*"] {
            let longer = format!("{pattern}{pins}");
            if found.is_empty() {
                found = node.signals_if_any(&longer)?;
            } else if is_for_all && let count @ 1.. = node.count(Some(&longer))? {
                chosen.left_out.push((longer, count));
            }
        }
        if found.is_empty() {
            found = node.signals(Some(pattern))?;
        }
        chosen.signals.extend(found.into_iter().filter(|it| names.insert(it.name.clone())));
    }
    chosen.left_out.retain(|(longer, _)| !patterns.contains(longer));
    Ok(chosen)
}

/// The values of signals, and whether the inputs among them are ok.
fn read(node: &mut Node, signals: &[SignalDescription]) -> Result<Reading, Failure> {
    let mut names: Vec<String> = signals.iter().map(|signal| signal.name.clone()).collect();
    let inputs = signals.iter().filter(|signal| signal.role == Role::Input);
    let shown: HashSet<&str> = signals.iter().map(|signal| signal.name.as_str()).collect();
    let oks = inputs.map(|signal| ok_of(&signal.name));
    names.extend(oks.filter(|name| !shown.contains(name.as_str())));
    node.read(&names)
}

/// The actual `ok` of inputs whose `ok` is forced.
fn truth(node: &mut Node, signals: &[SignalDescription]) -> Result<HashMap<String, bool>, Failure> {
    let inputs = signals.iter().filter(|signal| signal.role == Role::Input);
    let mut inputs: Vec<_> = inputs.collect();
    if inputs.is_empty() {
        return Ok(HashMap::new());
    }
    let forced: HashSet<String> = forces::of(node)?.into_iter().map(|force| force.name).collect();
    inputs.retain(|input| forced.contains(&ok_of(&input.name)));
    if inputs.is_empty() {
        return Ok(HashMap::new());
    }
    let alarmed: HashSet<String> = node.alarms()?.0.into_iter().map(|alarm| alarm.name).collect();
    Ok(inputs.iter().map(|it| (ok_of(&it.name), !alarmed.contains(&it.name))).collect())
}

/// The signal that says whether an input is ok.
pub(crate) fn ok_of(input: &str) -> String {
    format!("{input}.ok")
}

/// The signal that says how old an input is.
pub(crate) fn age_of(input: &str) -> String {
    format!("{input}.age")
}

/// Reasons to doubt the value of a signal.
fn marks(signal: &SignalDescription, oks: &HashMap<&str, Value>, reading: &Reading) -> Vec<String> {
    let is_not_ok = signal.role == Role::Input
        && oks.get(ok_of(&signal.name).as_str()) == Some(&Value::Bool(false));
    let marks = [
        (signal.forced, "forced"),
        (is_not_ok, "not ok"),
        (signal.protected.unwrap_or_default(), "protected"),
    ];
    let marks = marks.into_iter().filter(|(is_so, _)| *is_so).map(|(_, mark)| mark.to_owned());
    let limits = signal.limits.map(limits);
    let flags = reading.flags(&signal.name);
    // For a signal that is forced itself, this is shown already.
    let flags = flags.split(' ').filter(|flag| !(signal.forced && *flag == "FORCED"));
    let flags = flags.collect::<Vec<_>>().join(" ");
    marks.chain(Some(flags).filter(|flags| !flags.is_empty())).chain(limits).collect()
}

/// The least and the greatest value of a parameter or a variable.
pub(crate) fn limits([min, max]: [f64; 2]) -> String {
    let digits = |value| numbers::shown(value, PinType::Lreal, Digits::Exact);
    format!("{} to {}", digits(min), digits(max))
}

fn document(
    signal: &SignalDescription,
    (values, oks): (&HashMap<&str, Value>, &HashMap<&str, Value>),
    reading: &Reading,
) -> serde_json::Value {
    let flags = reading.quality.as_ref().map(|quality| quality.get(&signal.name));
    let ok = (signal.role == Role::Input).then(|| oks.get(ok_of(&signal.name).as_str()));
    json!({
        "name": signal.name,
        "value": values.get(signal.name.as_str()),
        "unit": signal.unit,
        "comment": signal.comment,
        "role": signal.role,
        "type": signal.value_type,
        "task": signal.task,
        "forced": signal.forced,
        "ok": ok,
        "quality": flags.map(|flags| flags.cloned().unwrap_or_default()),
        "protected": signal.protected,
        "limits": signal.limits,
        "doc": signal.doc,
    })
}

/// A role in a word.
pub(crate) fn role(role: Role) -> &'static str {
    match role {
        Role::Input => "input",
        Role::Variable => "variable",
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
            comment: None,
            role,
            task: "fast".to_owned(),
            forced,
            protected: Some(name == "z"),
            limits: (name == "a.in").then_some([0.0, 2.5]),
            can_be_unset: false,
            doc: String::new(),
        };
        let values = HashMap::from([("x.ok", Value::Bool(false)), ("y.ok", Value::Bool(true))]);
        let flags = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        let quality = [
            ("x".to_owned(), flags(&["STALE", "FORCED"])),
            ("a.out".to_owned(), flags(&["FORCED"])),
            ("b.out".to_owned(), flags(&["STALE", "FORCED"])),
        ];
        let reading = Reading { quality: Some(quality.into()), ..Reading::default() };
        let marks =
            |name, role, forced| marks(&signal(name, role, forced), &values, &reading).join(", ");
        assert_eq!(marks("x", Role::Input, true), "forced, not ok, STALE");
        assert_eq!(marks("b.out", Role::Output, false), "STALE FORCED");
        assert_eq!(marks("y", Role::Input, false), "");
        assert_eq!(marks("a.out", Role::Output, true), "forced");
        assert_eq!(marks("z", Role::Input, false), "protected", "what is not known is not said");
        assert_eq!(marks("a.in", Role::Parameter, true), "forced, 0 to 2.5");
    }
}
