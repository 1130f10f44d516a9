//! The parts of a configuration that cannot change while a node runs, because its threads and ports were made for
//! them.

use std::collections::{HashMap, HashSet};

use isochrone_model::{Access, Code, Refusal};

use isochrone_engine::config::Retain;
use isochrone_engine::{InputPlan, OutputPlan, Plan, SignalPlan, TaskPlan, TaskSettings, escaped};

/// The parts of a plan that a configuration applied online must leave unchanged.
#[derive(Debug)]
pub(super) struct Fixed {
    node: String,
    control: Access,
    retain: Option<Retain>,
    protected: Vec<String>,
    tasks: Vec<Named<TaskSettings>>,
    inputs: Vec<Named<(String, InputPlan)>>,
    outputs: Vec<Named<OutputPart>>,
}

#[derive(Debug)]
struct Named<T> {
    name: String,
    part: T,
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
        let task = |task: &TaskPlan| Named { name: task.name.clone(), part: task.settings.clone() };
        Self {
            node: plan.node.clone(),
            control: plan.control,
            retain: plan.retain,
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
        if self.retain != new.retain {
            let difference = "what it retains, or when, would change".to_owned();
            findings.push(fixed("node", &self.node, difference));
        }
        if self.protected != new.protected {
            findings.push(fixed("node", &self.node, "its [[protect]] would change".into()));
        }
        compare("task", &self.tasks, &new.tasks, TaskSettings::differences, &mut findings);
        compare("input", &self.inputs, &new.inputs, input_differences, &mut findings);
        compare("output", &self.outputs, &new.outputs, output_differences, &mut findings);
        findings
    }
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

fn input_differences(old: &(String, InputPlan), new: &(String, InputPlan)) -> Vec<String> {
    let (a, b) = (&old.1, &new.1);
    changes(&[
        ("task", old.0 != new.0),
        ("type", a.value_type != b.value_type),
        ("service", a.service != b.service),
        ("place in the service's frame", a.binding != b.binding),
        ("default", a.default.to_bits() != b.default.to_bits()),
        ("range", a.range != b.range),
        ("finite", a.finite != b.finite),
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
