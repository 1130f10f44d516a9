//! What `check` prints for people.

use isochrone_cyclic::{Margin, Wake};
use isochrone_engine::config::Cpu;
use isochrone_engine::{Plan, TaskPlan, format_duration_ns};
use isochrone_report::Table;
use isochrone_runtime::{TaskCpu, TaskCpus};
use isochrone_timing::units::counted;

use super::document::{Document, Follow, InputRow, WireRow};

/// Maximum rows shown of a long list; JSON has all of them.
const ROWS: usize = 40;

/// What would run, for people.
pub(super) fn of(plan: &Plan, cpus: &TaskCpus) -> String {
    let document = Document::of(plan, cpus);
    let outputs: usize = plan.tasks.iter().map(|task| task.outputs.len()).sum();
    let inputs: usize = plan.tasks.iter().map(|task| task.inputs.len()).sum();
    let mut text = format!(
        "{}: ok. Node \"{}\": {}, {}, {}, {}\n",
        plan.source.name,
        plan.node,
        counted(plan.tasks.len(), "task"),
        counted(inputs, "input"),
        counted(plan.instances(), "block"),
        counted(outputs, "output"),
    );
    for ((index, task), rows) in plan.tasks.iter().enumerate().zip(&document.tasks) {
        text += &format!("\ntask {}: {}\n", task.name, schedule(task));
        if let Some(TaskCpu::Chosen(choice)) = cpus.as_slice().get(index) {
            text += &format!("  auto would choose CPU {} now: {choice}\n", choice.cpu);
        }
        let inputs = rows.inputs.iter().map(InputRow::cells);
        text += &section("inputs", rows.inputs.len(), inputs);
        let order = rows.order.iter().enumerate().take(ROWS);
        let order = order.map(|(position, block)| block.cells(position));
        text += &section("order of execution", rows.order.len(), order);
        let wires = rows.wires.iter().take(ROWS).map(WireRow::cells);
        text += &section("wires", rows.wires.len(), wires);
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

fn schedule(task: &TaskPlan) -> String {
    let schedule = &task.schedule;
    let mut words = vec![format!("every {}", format_duration_ns(schedule.period_ns))];
    if let Some(reason) = task.phase_choice.reason() {
        let phase = format_duration_ns(schedule.phase_ns);
        let run = match task.followed_service {
            Some(_) => "run takes that of the source",
            None => "run keeps clear of what runs",
        };
        words.push(format!("phase {phase} (auto: {reason}; {run})"));
    } else if schedule.phase_ns > 0 {
        words.push(format!("phase {}", format_duration_ns(schedule.phase_ns)));
    }
    words.extend(task.ob.map(|ob| format!("OB {ob}")));
    words.push(match task.priority {
        Some(priority) => format!("SCHED_FIFO {priority}"),
        None => "normal scheduling".into(),
    });
    words.extend(match task.cpu {
        Cpu::Number(cpu) => Some(format!("CPU {cpu}")),
        Cpu::Auto { .. } => Some("CPU auto".into()),
        Cpu::Any => task.priority.map(|_| "any CPU".into()),
    });
    let wake = schedule.wake.as_str();
    words.push(match schedule.wake {
        Wake::Sleep | Wake::Spin => format!("wake {wake}"),
        Wake::Hybrid(Margin::Fixed(margin_ns)) => {
            format!("wake {wake} (margin {})", format_duration_ns(margin_ns))
        }
        Wake::Hybrid(Margin::Adaptive { cpu_budget }) => {
            format!("wake {wake} (cpu_budget {cpu_budget})")
        }
    });
    words.extend(Follow::of(task).map(|Follow { service, within_ns }| {
        let [within, watched, period] =
            [within_ns, schedule.longest_watch_in_a_period_ns(), schedule.period_ns]
                .map(format_duration_ns);
        format!("follows {service} within {within} (watches for up to {watched} of each {period})")
    }));
    words.push(format!("overrun {}", schedule.overrun.as_str()));
    let limit = schedule.limit;
    words.extend(limit.map(|limit| {
        let (misses, cycles) =
            (counted(limit.misses, "missed release"), counted(limit.cycles, "cycle"));
        format!("stop at {misses} in {cycles}")
    }));
    words.join(", ")
}
