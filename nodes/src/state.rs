//! `state`: what a node has retained.

use std::path::PathBuf;

use isochrone_blocks::BlockType;
use isochrone_control::desk::{AlarmRecord, RetainedValue, Signals};
use isochrone_control::{AlarmMoment, Value};
use isochrone_engine::{Plan, Source, escaped};
use isochrone_report::Table;
use isochrone_runtime::state::{NodeState, Restored, StateFile, StateValue};
use isochrone_timing::units::duration;
use jiff::Timestamp;
use serde::Serialize;

use crate::base::configuration;
use crate::base::failure::Failure;
use crate::base::numbers::{Digits, shown_value};
use crate::base::terminal;
use crate::operate::time;

/// Show the state that a node has retained
///
/// What `run` writes for a configuration with retain = true: the node, when it was written, the last cycle of each task,
/// the parameters and variables that were set, the process alarms that were ever active, and the values of inputs, variables and outputs. If the newest state is
/// damaged, the one before it (FILE.state.1) is shown, with a warning.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone state ~/.local/state/isochrone/level.state\n  \
    isochrone state level.state --config new.toml\n  isochrone state level.state --json | jq .values")]
pub(crate) struct Args {
    /// State of a node
    #[arg(value_name = "FILE.state")]
    file: PathBuf,
    /// Also say what a start with this configuration would restore
    #[arg(long, value_name = "NEW.toml")]
    config: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// The state as a JSON document.
#[derive(Serialize)]
struct Document<'a> {
    node: &'a str,
    unix_ns: u64,
    is_final: bool,
    file: &'a str,
    sha256: String,
    tasks: Vec<DocumentTask>,
    set: serde_json::Map<String, serde_json::Value>,
    alarms: &'a [AlarmRecord],
    values: serde_json::Map<String, serde_json::Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    restores: Option<&'a Restored>,
}

#[derive(Serialize)]
struct DocumentTask {
    name: String,
    is_retained: bool,
    cycle: Option<u64>,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let file = StateFile::at(&args.file);
    let path = args.file.display();
    let found = file.read().map_err(Failure::usage)?;
    let Some(stored) = found else {
        return Err(Failure::usage(format!(
            "there is no state {path}; a node whose configuration says retain = true writes one, NODE.state in \
             $STATE_DIRECTORY or ~/.local/state/isochrone unless `run --state` names another"
        )));
    };
    let state = stored.state.clone();
    if let Some(damage) = &stored.damage {
        terminal::note(&format!(
            "warning: {path} is damaged ({damage}); this is the one before it"
        ));
    }
    let source = Source::new(state.file.clone(), state.configuration.clone());
    let plan = configuration::plan_of(source, catalogue)?;
    let restores = args.config.as_ref().map(|config| {
        let new = configuration::plan(config, catalogue)?;
        Restored::preview(&new, &file, stored).map_err(Failure::usage)
    });
    let restores = restores.transpose()?.flatten();
    if args.json {
        return terminal::print_json(&document(&state, &plan, restores.as_ref()));
    }
    terminal::print(&text(&state, &plan))?;
    let Some(restores) = restores else { return Ok(()) };
    let config = args.config.iter().map(|config| config.display().to_string()).collect::<String>();
    let mut would = format!("\na start with {config} restores {restores}\n");
    if let Some(why) = &restores.cold {
        would += &format!("  starts cold: {why}\n");
    }
    for unexpected in &restores.unexpected {
        would += &format!("  {unexpected}\n");
    }
    terminal::print(&would)
}

/// The values that were set, and the constants that they replaced.
fn set(state: &NodeState, plan: &Plan) -> Vec<(StateValue, Value)> {
    let signals = Signals::of(plan);
    let value = |of: &RetainedValue| {
        let value_type = signals.find(&of.name).ok()?.value_type;
        let value = |bits| Value::of(f64::from_bits(bits), value_type);
        let set = StateValue::new(of.name.clone(), value_type, value(of.value));
        Some((set, value(of.constant)))
    };
    state.tuned.iter().filter_map(value).collect()
}

fn document<'a>(state: &'a NodeState, plan: &Plan, restores: Option<&'a Restored>) -> Document<'a> {
    let json = |of: StateValue| (of.name, serde_json::to_value(of.value).unwrap_or_default());
    let tasks = plan.tasks.iter().zip(&state.tasks).map(|(task, state)| DocumentTask {
        name: task.name.clone(),
        is_retained: state.is_some(),
        cycle: state.as_ref().and_then(|task| task.state.cycle),
    });
    let set = set(state, plan).into_iter().map(|(set, _)| json(set));
    let values = state.values(plan).into_iter().map(json);
    Document {
        node: &state.node,
        unix_ns: state.unix_ns,
        is_final: state.is_final,
        file: &state.file,
        sha256: plan.source.sha256(),
        tasks: tasks.collect(),
        set: set.collect(),
        values: values.collect(),
        alarms: &state.alarms,
        restores,
    }
}

fn text(state: &NodeState, plan: &Plan) -> String {
    let sha256 = plan.source.sha256();
    let short = sha256.get(..12).unwrap_or(&sha256);
    let mut text = format!("node \"{}\", {} (sha256 {short}…)\n", state.node, escaped(&state.file));
    let when = if state.is_final { "after the last cycle" } else { "while the node ran" };
    text += &format!("written {}, {when}\n", written(state.unix_ns));
    let mut tasks = Table::default();
    for (task, state) in plan.tasks.iter().zip(&state.tasks) {
        let cycle = match state.as_ref().map(|task| task.state.cycle) {
            None => "its state was not retained".to_owned(),
            Some(None) => "no cycle ran".to_owned(),
            Some(Some(cycle)) => format!("cycle {cycle}"),
        };
        tasks.row([format!("task \"{}\"", task.name), cycle]);
    }
    text += &tasks.draw(0);
    let mut of_set = Table::default();
    for (StateValue { name, value_type, value, .. }, constant) in set(state, plan) {
        let [value, constant] =
            [value, constant].map(|value| shown_value(value, value_type, Digits::Exact));
        of_set.row([escaped(&name).into(), value, format!("in the file: {constant}")]);
    }
    let of_set = of_set.draw(2);
    if !of_set.is_empty() {
        text += &format!("\nset\n{of_set}");
    }
    let mut alarms = Table::default();
    state.alarms.iter().for_each(|alarm| alarms.row(alarm_row(alarm)));
    let alarms = alarms.draw(2);
    if !alarms.is_empty() {
        text += &format!("\nalarms\n{alarms}");
    }
    let mut values = Table::default();
    for StateValue { name, value_type, value, .. } in state.values(plan) {
        values.row([escaped(&name).into(), shown_value(value, value_type, Digits::Exact)]);
    }
    text + "\nvalues\n" + &values.draw(2)
}

/// Its name, since when it is what it is, its newest occurrence, and which one was acknowledged.
fn alarm_row(alarm: &AlarmRecord) -> [String; 4] {
    let state = if alarm.active { "active" } else { "not active" };
    let since = |at: AlarmMoment| format!("{state} since {} cycle {}", time(at.unix_ns), at.cycle);
    let since = alarm.last.map_or_else(|| state.to_owned(), since);
    let acknowledged = match alarm.occurrence - alarm.acknowledged.min(alarm.occurrence) {
        0 => "acknowledged".to_owned(),
        1 => "not acknowledged".to_owned(),
        several => format!("{several} not acknowledged"),
    };
    let occurrence = format!("occurrence {}", alarm.occurrence);
    [escaped(&alarm.name).into(), since, occurrence, acknowledged]
}

/// When it was written, and how long ago.
fn written(unix_ns: u64) -> String {
    let now = Timestamp::now();
    let Ok(time) = Timestamp::from_nanosecond(unix_ns.into()) else {
        return "at no time".to_owned();
    };
    let shown = time.strftime("%Y-%m-%dT%H:%M:%SZ");
    let ago_ns = now.as_nanosecond() - i128::from(unix_ns);
    if ago_ns < 0 {
        return format!("{shown}, which is in the future");
    }
    format!("{shown}, {} ago", duration(ago_ns as f64))
}
