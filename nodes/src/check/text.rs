//! The text output of `check`.

use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskSettings, format_duration_ns};
use isochrone_model::Followed;
use isochrone_report::Table;
use isochrone_runtime::{TaskCpu, TaskCpus};
use isochrone_timing::units::counted;

use super::alarms::AlarmRow;
use super::document::{Document, InputRow, VariableRow, WireRow};
use super::expressions::ExpressionRow;

/// Maximum rows shown of a long list; JSON has all of them.
const ROWS: usize = 40;

/// The plan that would run, as text.
pub(super) fn of(plan: &Plan, cpus: &TaskCpus) -> String {
    let document = Document::of(plan, cpus);
    let outputs: usize = plan.tasks.iter().map(|task| task.outputs.len()).sum();
    let inputs: usize = plan.tasks.iter().map(|task| task.inputs.len()).sum();
    let variables: usize = plan.tasks.iter().map(|task| task.variables.len()).sum();
    let variables = match variables {
        0 => String::new(),
        some => format!(", {}", counted(some, "variable")),
    };
    let alarms = match plan.alarms().count() {
        0 => String::new(),
        some => format!(", {}", counted(some, "alarm")),
    };
    let mut text = format!(
        "{}: ok. Node \"{}\": {}, {}{variables}, {}{alarms}, {}\n",
        plan.source.name,
        plan.node,
        counted(plan.tasks.len(), "task"),
        counted(inputs, "input"),
        counted(plan.instances(), "block"),
        counted(outputs, "output"),
    );
    for ((index, task), rows) in plan.tasks.iter().enumerate().zip(&document.tasks) {
        text += &format!("\ntask {}: {}\n", task.name, settings(&task.settings));
        if let Some(TaskCpu::Chosen(choice)) = cpus.as_slice().get(index) {
            text += &format!("  auto would choose CPU {} now: {choice}\n", choice.cpu);
        }
        let inputs = rows.inputs.iter().map(InputRow::cells);
        text += &section("inputs", rows.inputs.len(), inputs);
        let variables = rows.variables.iter().map(VariableRow::cells);
        text += &section("variables", rows.variables.len(), variables);
        let order = rows.order.iter().enumerate().take(ROWS);
        let order = order.map(|(position, block)| block.cells(position));
        text += &section("order of execution", rows.order.len(), order);
        let expressions = rows.expressions.iter().take(ROWS).map(ExpressionRow::cells);
        text += &section("expressions", rows.expressions.len(), expressions);
        let wires = rows.wires.iter().take(ROWS).map(WireRow::cells);
        text += &section("wires", rows.wires.len(), wires);
        let alarms = rows.alarms.iter().map(AlarmRow::cells);
        text += &section("alarms", rows.alarms.len(), alarms);
        let outputs = rows.outputs.iter().map(|output| output.cells(ROWS));
        text += &section("outputs", rows.outputs.len(), outputs);
    }
    if !plan.notes.is_empty() {
        text += "\nnotes\n";
    }
    for note in &plan.notes {
        let (line, column) = plan.source.position(note.span.start);
        text += &format!("  {}:{line}:{column}: {note}\n", plan.source.name);
        text += &note.help.as_ref().map_or_else(String::new, |help| format!("    {help}\n"));
    }
    text
}

/// The rows of a list of `all`, or nothing if that has none.
fn section<const N: usize>(
    title: &str,
    all: usize,
    rows: impl Iterator<Item = [String; N]>,
) -> String {
    if all == 0 {
        return String::new();
    }
    let mut table = Table::default();
    rows.for_each(|cells| table.row(cells));
    let mut text = format!("  {title}\n{}", table.draw(4));
    if table.rows() < all {
        text += &format!("    … and {} more (--json lists all)\n", all - table.rows());
    }
    text
}

/// What the configuration says of a task, in the words of the field; a key without words of its own stands there as
/// it is written.
pub(crate) fn settings(settings: &TaskSettings) -> String {
    let schedule = settings.schedule();
    let words = settings.written().into_iter().filter_map(|(key, value)| {
        let written = || value.as_ref().map(|value| format!("{key} {value}"));
        match key {
            "period" => value.map(|period| format!("every {period}")),
            "phase" => match &settings.phase_reason {
                Some(reason) => {
                    let run = match settings.follow {
                        Some(_) => "run takes that of the source",
                        None => "run keeps clear of what runs",
                    };
                    Some(format!("{} (auto: {reason}; {run})", written()?))
                }
                None => written().filter(|_| settings.phase_ns > 0),
            },
            "ob" => value.map(|ob| format!("OB {ob}")),
            "priority" => Some(match value {
                Some(priority) => format!("SCHED_FIFO {priority}"),
                None => "normal scheduling".into(),
            }),
            "cpu" => match settings.cpu {
                Cpu::Number(cpu) => Some(format!("CPU {cpu}")),
                Cpu::Auto { .. } => Some("CPU auto".into()),
                Cpu::Any => settings.priority.map(|_| "any CPU".into()),
            },
            "follow" => settings.follow.as_ref().map(|Followed { service, within_ns }| {
                let [within, watched, period] =
                    [*within_ns, schedule.longest_watch_in_a_period_ns(), schedule.period_ns]
                        .map(format_duration_ns);
                format!(
                    "follows {service} within {within} (watches for up to {watched} of each {period})"
                )
            }),
            "on_overrun" => settings.on_overrun.map(|limit| {
                let misses = counted(limit.misses, "missed release");
                format!("stop at {misses} in {}", counted(limit.cycles, "cycle"))
            }),
            _ => written(),
        }
    });
    words.collect::<Vec<_>>().join(", ")
}
