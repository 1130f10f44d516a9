//! The document of `check`: printed as JSON, and as tables by the same rows.

use std::collections::BTreeMap;

use isochrone_engine::config::{Bad, Binding, OnStale};
use isochrone_engine::{
    Diagnostics, InputPlan, OutputPlan, Plan, SignalPlan, TaskPlan, TaskSettings, VariablePlan,
    WirePlan, format_duration_ns,
};
use isochrone_runtime::TaskCpus;
use serde::{Serialize, Serializer};
use serde_json::Value;

use super::alarms::AlarmRow;
use super::expressions::ExpressionRow;
use crate::base::configuration::{self, Kind};
use crate::base::numbers::{Digits, Typed};

/// A configuration that passes.
#[derive(Serialize)]
pub(super) struct Document<'a> {
    file: &'a str,
    pub(super) node: &'a str,
    pub(super) tasks: Vec<TaskRow<'a>>,
    errors: [(); 0],
    warnings: Vec<Value>,
    notes: Vec<Value>,
}

impl<'a> Document<'a> {
    pub(super) fn of(plan: &'a Plan, cpus: &TaskCpus) -> Self {
        let tasks = plan.tasks.iter().enumerate();
        let note = |note| configuration::diagnostic_json(&plan.source, note);
        Self {
            file: &plan.source.name,
            node: &plan.node,
            tasks: tasks.map(|(index, task)| TaskRow::of(plan, index, task, cpus)).collect(),
            errors: [],
            warnings: configuration::diagnostics_json(
                &configuration::warnings(plan),
                Kind::Warnings,
            ),
            notes: plan.notes.iter().map(note).collect(),
        }
    }
}

/// A configuration that has errors.
#[derive(Serialize)]
pub(super) struct Refusal<'a> {
    file: &'a str,
    errors: Vec<Value>,
    warnings: Vec<Value>,
}

impl<'a> Refusal<'a> {
    pub(super) fn of(diagnostics: &'a Diagnostics) -> Self {
        Self {
            file: &diagnostics.source.name,
            errors: configuration::diagnostics_json(diagnostics, Kind::Errors),
            warnings: configuration::diagnostics_json(diagnostics, Kind::Warnings),
        }
    }
}

/// A task and all that belongs to it.
#[derive(Serialize)]
pub(super) struct TaskRow<'a> {
    name: &'a str,
    #[serde(flatten)]
    settings: &'a TaskSettings,
    cpu_reason: Option<String>,
    pub(super) inputs: Vec<InputRow<'a>>,
    pub(super) variables: Vec<VariableRow<'a>>,
    pub(super) order: Vec<BlockRow<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) expressions: Vec<ExpressionRow<'a>>,
    pub(super) wires: Vec<WireRow<'a>>,
    pub(super) alarms: Vec<AlarmRow<'a>>,
    pub(super) outputs: Vec<OutputRow<'a>>,
}

impl<'a> TaskRow<'a> {
    fn of(plan: &'a Plan, index: usize, task: &'a TaskPlan, cpus: &TaskCpus) -> Self {
        Self {
            name: &task.name,
            settings: &task.settings,
            cpu_reason: cpus.reason(index),
            inputs: task.inputs.iter().map(InputRow::of).collect(),
            variables: task.variables.iter().map(|it| VariableRow::of(plan, it)).collect(),
            order: BlockRow::all(plan, task),
            expressions: ExpressionRow::all(task),
            wires: WireRow::all(plan, index, task),
            alarms: task.alarms.iter().map(AlarmRow::of).collect(),
            outputs: task.outputs.iter().map(OutputRow::of).collect(),
        }
    }
}

/// An input.
#[derive(Serialize)]
pub(super) struct InputRow<'a> {
    name: &'a str,
    #[serde(rename = "type")]
    value_type: &'static str,
    service: Option<&'a str>,
    /// As `channel` or `signal`.
    #[serde(flatten)]
    binding: Bound<'a>,
    default: Typed,
    /// Smallest and largest sample.
    range: Option<(f64, f64)>,
    finite: bool,
    max_age_ns: Option<u64>,
    #[serde(serialize_with = "on_stale")]
    on_stale: OnStale,
    #[serde(serialize_with = "bad")]
    bad: Bad,
    feedback: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    comment: Option<&'a str>,
}

/// Where an input's value is in a frame.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Bound<'a> {
    Channel(usize),
    Signal(&'a str),
}

impl<'a> InputRow<'a> {
    fn of(input: &'a InputPlan) -> Self {
        Self {
            name: &input.name,
            value_type: input.value_type.as_str(),
            service: input.service.as_deref(),
            binding: match &input.binding {
                Binding::Channel(channel) => Bound::Channel(*channel),
                Binding::Signal(signal) => Bound::Signal(signal),
            },
            default: Typed { value: input.default, value_type: input.value_type },
            range: input.range,
            finite: input.finite,
            max_age_ns: input.max_age_ns,
            on_stale: input.on_stale,
            bad: input.bad,
            feedback: input.feedback,
            unit: given(&input.unit),
            comment: given(&input.comment),
        }
    }

    pub(super) fn cells(&self) -> [String; 5] {
        let value_type = in_unit(self.value_type, self.unit);
        [self.name.to_owned(), value_type, self.origin(), self.fallback(), text(self.comment)]
    }

    fn origin(&self) -> String {
        match (self.service, &self.binding) {
            (Some(service), Bound::Channel(channel)) => format!("{service}[{channel}]"),
            (Some(service), Bound::Signal(signal)) => format!("{service}[{signal}]"),
            (None, _) => "no service (only for simulate)".into(),
        }
    }

    fn fallback(&self) -> String {
        let mut text = format!("default {}", self.default.shown(Digits::All));
        if let Some((min, max)) = self.range {
            text += &format!(", from {min:?} to {max:?}");
        }
        if !self.finite {
            text += ", NaN and infinity too";
        }
        if let Some(age_ns) = self.max_age_ns {
            text += &format!(", stale after {}", format_duration_ns(age_ns));
        }
        if self.bad == Bad::Stale {
            text += ", stale if bad";
        }
        if self.max_age_ns.is_some() || self.bad == Bad::Stale {
            text += &format!(": {}", self.on_stale);
        }
        if self.feedback {
            text += ", feedback";
        }
        text
    }
}

fn on_stale<S: Serializer>(on_stale: &OnStale, serializer: S) -> Result<S::Ok, S::Error> {
    match on_stale {
        OnStale::Ramp(rate) => serializer.collect_map([("ramp", rate)]),
        word => serializer.serialize_str(word.as_str()),
    }
}

fn bad<S: Serializer>(bad: &Bad, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(bad.as_str())
}

/// A text that the file gives, if it is not empty.
fn given(text: &str) -> Option<&str> {
    Some(text).filter(|text| !text.is_empty())
}

/// A type, or a name with its type, and behind it the unit.
fn in_unit(value_type: &str, unit: Option<&str>) -> String {
    unit.map_or_else(|| value_type.to_owned(), |unit| format!("{value_type} in {unit}"))
}

fn text(given: Option<&str>) -> String {
    given.unwrap_or_default().to_owned()
}

/// A variable.
#[derive(Serialize)]
pub(super) struct VariableRow<'a> {
    name: &'a str,
    #[serde(rename = "type")]
    value_type: &'static str,
    initial: Typed,
    /// Smallest and largest value.
    range: Option<(f64, f64)>,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    comment: Option<&'a str>,
}

impl<'a> VariableRow<'a> {
    fn of(plan: &Plan, variable: &'a VariablePlan) -> Self {
        let VariablePlan { name, value_type, initial, unit, comment, .. } = variable;
        let range = plan.limits.iter().find(|limits| limits.names == *name);
        Self {
            name,
            value_type: value_type.as_str(),
            initial: Typed { value: *initial, value_type: *value_type },
            range: range.map(|limits| (limits.min, limits.max)),
            unit: given(unit),
            comment: given(comment),
        }
    }

    pub(super) fn cells(&self) -> [String; 4] {
        let mut value = format!("initial {}", self.initial.shown(Digits::All));
        if let Some((min, max)) = self.range {
            value += &format!(", from {min:?} to {max:?}");
        }
        let value_type = in_unit(self.value_type, self.unit);
        [self.name.to_owned(), value_type, value, text(self.comment)]
    }
}

/// A block, in the order of execution.
#[derive(Serialize)]
pub(super) struct BlockRow<'a> {
    block: &'a str,
    #[serde(rename = "type")]
    block_type: &'a str,
    depth: usize,
    /// Units that the file gives to its pins, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    units: BTreeMap<&'static str, &'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    comment: Option<&'a str>,
}

impl<'a> BlockRow<'a> {
    fn all(plan: &'a Plan, task: &'a TaskPlan) -> Vec<Self> {
        let mut rows = Vec::new();
        for bank in task.block_banks() {
            let (known, depth) = (bank.block_type, bank.depth);
            rows.extend(bank.instances.iter().map(|block| {
                let labels = plan.labels(block);
                let units =
                    labels.map_or_else(BTreeMap::new, |labels| labels.by_pin(&known).collect());
                let comment = labels.and_then(|labels| given(&labels.comment));
                Self { block, block_type: known.name, depth, units, comment }
            }));
        }
        rows
    }

    /// Of the block that is executed after so many others.
    pub(super) fn cells(&self, position: usize) -> [String; 5] {
        let (block, block_type) = (self.block.to_owned(), self.block_type.to_owned());
        let units = self.units.iter().map(|(pin, unit)| format!("{pin} in {unit}"));
        let units = units.collect::<Vec<_>>().join(", ");
        [format!("{}.", position + 1), block, block_type, units, text(self.comment)]
    }
}

/// Behind the name of a signal whose value is that of the cycle before.
const PREVIOUS: &str = "@prev";

/// A wire by names.
#[derive(Serialize)]
pub(crate) struct WireRow<'a> {
    from: String,
    /// The task that computes the value. If it is another one, its last finished cycle counts.
    from_task: &'a str,
    to: String,
    #[serde(skip)]
    is_from_other: bool,
    #[serde(skip)]
    unit: &'a str,
}

impl<'a> WireRow<'a> {
    /// The wires of a task in the order in which they are copied.
    pub(crate) fn all(plan: &'a Plan, index: usize, task: &'a TaskPlan) -> Vec<Self> {
        // An alarm says by its condition what it reads.
        let direct = task.block_banks().flat_map(|bank| &bank.wires).map(|wire| (wire, ""));
        let previous =
            task.previous.iter().filter(|wire| task.alarm_at(wire.to as usize).is_none());
        let previous = previous.map(|wire| (wire, PREVIOUS));
        let named = |(WirePlan { from, to }, suffix): (&WirePlan, &str)| {
            let name = |slot: u32| plan.slot_name(index, slot as usize);
            let link = plan.links.iter().find(|link| link.to == index && link.carries_to(*from));
            let other = link.and_then(|link| plan.tasks.get(link.from));
            Self {
                from: name(*from) + suffix,
                from_task: &other.unwrap_or(task).name,
                to: name(*to),
                is_from_other: other.is_some(),
                unit: plan.slot_unit(index, *from as usize),
            }
        };
        previous.chain(direct).map(named).collect()
    }

    /// The signal that it carries, of this cycle or of the one before.
    pub(crate) fn signal(&self) -> &str {
        self.from.strip_suffix(PREVIOUS).unwrap_or(&self.from)
    }

    /// The unit of its value; empty for none.
    pub(crate) fn unit(&self) -> &str {
        self.unit
    }

    pub(crate) fn cells(&self) -> [String; 3] {
        let Self { from, from_task, to, is_from_other, .. } = self;
        let from =
            if *is_from_other { format!("{from} of task {from_task}") } else { from.clone() };
        [from, "->".to_owned(), to.clone()]
    }
}

/// An output: the signals published on a service.
#[derive(Serialize)]
pub(super) struct OutputRow<'a> {
    service: &'a str,
    signals: Vec<SignalRow<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    comment: Option<&'a str>,
}

/// A signal of an output.
#[derive(Serialize)]
struct SignalRow<'a> {
    name: &'a str,
    #[serde(rename = "type")]
    value_type: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<&'a str>,
}

impl<'a> OutputRow<'a> {
    fn of(output: &'a OutputPlan) -> Self {
        let signal = |signal: &'a SignalPlan| SignalRow {
            name: &signal.name,
            value_type: signal.value_type.as_str(),
            unit: given(&signal.unit),
        };
        Self {
            service: &output.service,
            signals: output.signals.iter().map(signal).collect(),
            comment: given(&output.comment),
        }
    }

    /// With no more signals than `most`.
    pub(super) fn cells(&self, most: usize) -> [String; 3] {
        let shown = |it: &SignalRow<'_>| format!("{} {}", it.name, in_unit(it.value_type, it.unit));
        let signals = self.signals.iter().take(most).map(shown);
        let mut text = signals.collect::<Vec<_>>().join(", ");
        if self.signals.len() > most {
            text += &format!(", … and {} more", self.signals.len() - most);
        }
        [self.service.to_owned(), text, self::text(self.comment)]
    }
}
