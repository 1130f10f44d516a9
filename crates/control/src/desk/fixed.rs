//! What cannot be changed while a node runs: what its threads and ports were made for.

use std::collections::{HashMap, HashSet};

use isochrone_engine::config::{Cpu, PhaseChoice};
use isochrone_engine::{InputPlan, OutputPlan, Plan, SignalPlan, TaskPlan};
use isochrone_engine::{escaped, format_duration_ns};
use isochrone_model::{Access, Code, Refusal, Schedule};

/// The parts of a plan that a configuration applied online must leave unchanged.
#[derive(Debug)]
pub(super) struct Fixed {
    node: String,
    control: Access,
    protected: Vec<String>,
    tasks: Vec<Named<TaskPart>>,
    inputs: Vec<Named<(String, InputPlan)>>,
    outputs: Vec<Named<OutputPart>>,
}

#[derive(Debug)]
struct Named<T> {
    name: String,
    part: T,
}

/// A task without what stands in its image.
#[derive(Debug)]
struct TaskPart {
    schedule: Schedule,
    phase_choice: PhaseChoice,
    ob: Option<i16>,
    priority: Option<u8>,
    cpu: Cpu,
    followed_service: Option<String>,
}

#[derive(Debug)]
struct OutputPart {
    task: String,
    signals: Vec<(String, isochrone_blocks::PinType)>,
}

impl Fixed {
    pub(super) fn of(plan: &Plan) -> Self {
        let inputs = plan.tasks.iter().flat_map(|task| {
            let part = |input: &InputPlan| (task.name.clone(), input.clone());
            task.inputs.iter().map(move |i| Named { name: i.name.clone(), part: part(i) })
        });
        let outputs =
            plan.tasks.iter().flat_map(|task| task.outputs.iter().map(|o| output(task, o)));
        Self {
            node: plan.node.clone(),
            control: plan.control,
            protected: plan.protected.clone(),
            tasks: plan.tasks.iter().map(task).collect(),
            inputs: inputs.collect(),
            outputs: outputs.collect(),
        }
    }

    /// A finding for each thing that another plan changes.
    pub(super) fn differences(&self, new: &Self) -> Vec<Refusal> {
        let mut findings = Vec::new();
        if self.node != new.node {
            let difference = format!("its name would be \"{}\"", escaped(&new.node));
            findings.push(fixed("node", &self.node, difference));
        }
        if self.control != new.control {
            let (old, new) = (self.control.as_str(), new.control.as_str());
            let difference = format!("its control is \"{old}\" and would be \"{new}\"");
            findings.push(fixed("node", &self.node, difference));
        }
        if self.protected != new.protected {
            findings.push(fixed("node", &self.node, "its [[protect]] would change".into()));
        }
        compare("task", &self.tasks, &new.tasks, task_differences, &mut findings);
        compare("input", &self.inputs, &new.inputs, input_differences, &mut findings);
        compare("output", &self.outputs, &new.outputs, output_differences, &mut findings);
        findings
    }
}

fn task(task: &TaskPlan) -> Named<TaskPart> {
    let TaskPlan { schedule, ob, priority, cpu, .. } = *task;
    let phase_choice = task.phase_choice.clone();
    let followed_service = task.followed_service.clone();
    let part = TaskPart { schedule, phase_choice, ob, priority, cpu, followed_service };
    Named { name: task.name.clone(), part }
}

fn output(task: &TaskPlan, output: &OutputPlan) -> Named<OutputPart> {
    let signal = |signal: &SignalPlan| (signal.name.clone(), signal.value_type);
    let signals = output.signals.iter().map(signal).collect();
    Named { name: output.service.clone(), part: OutputPart { task: task.name.clone(), signals } }
}

fn fixed(what: &'static str, name: &str, difference: String) -> Refusal {
    let shown = escaped(name);
    let message = format!("{what} \"{shown}\" cannot be changed while the node runs: {difference}");
    let help = "leave it as it is, or stop the node and start it with the new configuration";
    Refusal::one(Code::CannotChange, name, message, help)
}

/// Compares two lists by the names of their entries.
fn compare<T>(
    what: &'static str,
    old: &[Named<T>],
    new: &[Named<T>],
    differences: impl Fn(&T, &T) -> Vec<String>,
    findings: &mut Vec<Refusal>,
) {
    let before = findings.len();
    let by_name: HashMap<&str, &T> = new.iter().map(|new| (&*new.name, &new.part)).collect();
    let known: HashSet<&str> = old.iter().map(|known| &*known.name).collect();
    for known in old {
        match by_name.get(&*known.name) {
            None => findings.push(fixed(what, &known.name, "it would be gone".into())),
            Some(new) => {
                let differences = differences(&known.part, new).into_iter();
                findings.extend(differences.map(|text| fixed(what, &known.name, text)));
            }
        }
    }
    let added = new.iter().filter(|new| !known.contains(&*new.name));
    findings.extend(added.map(|new| fixed(what, &new.name, "it would be new".into())));
    let moved = old.iter().zip(new).find(|(old, new)| old.name != new.name);
    if let Some((known, _)) = moved.filter(|_| findings.len() == before) {
        findings.push(fixed(what, &known.name, "it would stand at another place".into()));
    }
}

fn task_differences(old: &TaskPart, new: &TaskPart) -> Vec<String> {
    let mut differences = Vec::new();
    let (a, b) = (&old.schedule, &new.schedule);
    let is_automatic = |part: &TaskPart| part.phase_choice != PhaseChoice::Given;
    // What was chosen at the start stays.
    let stays = is_automatic(old) && is_automatic(new);
    let phase_ns = if stays { a.phase_ns } else { b.phase_ns };
    for (what, old, new) in [("period", a.period_ns, b.period_ns), ("phase", a.phase_ns, phase_ns)]
    {
        if old != new {
            let (old, new) = (format_duration_ns(old), format_duration_ns(new));
            differences.push(format!("its {what} is {old} and would be {new}"));
        }
    }
    let others = [
        ("wake", a.wake != b.wake),
        ("overrun", a.overrun != b.overrun),
        ("on_overrun", a.limit != b.limit),
        ("ob", old.ob != new.ob),
        ("priority", old.priority != new.priority),
        ("cpu", old.cpu.as_written() != new.cpu.as_written()),
        (
            "follow",
            a.follow_within_ns != b.follow_within_ns
                || old.followed_service != new.followed_service,
        ),
    ];
    differences.extend(changes(&others));
    differences
}

fn input_differences(old: &(String, InputPlan), new: &(String, InputPlan)) -> Vec<String> {
    let (a, b) = (&old.1, &new.1);
    changes(&[
        ("task", old.0 != new.0),
        ("type", a.value_type != b.value_type),
        ("service", a.service != b.service),
        ("place in the service's frame", a.binding != b.binding),
        ("default", a.default.to_bits() != b.default.to_bits()),
        ("max_age", a.max_age_ns != b.max_age_ns),
        ("on_stale", a.on_stale != b.on_stale),
        ("bad", a.bad != b.bad),
        ("feedback", a.feedback != b.feedback),
    ])
}

fn output_differences(old: &OutputPart, new: &OutputPart) -> Vec<String> {
    changes(&[("task", old.task != new.task), ("signals", old.signals != new.signals)])
}

fn changes(parts: &[(&str, bool)]) -> Vec<String> {
    let changed = parts.iter().filter(|(_, is_changed)| *is_changed);
    changed.map(|(what, _)| format!("its {what} would change")).collect()
}
