//! The blocks, each with its pins.

use std::collections::HashMap;

use isochrone_blocks::{BlockType, Pin};
use isochrone_engine::{Plan, TaskPlan, format_duration_ns};
use isochrone_model::Value;
use isochrone_report::{Page, Row, TableColumn};
use isochrone_timing::units::counted;

use super::connections::{Connections, joined};
use crate::base::numbers::{Digits, shown_value};

/// Stands for the number of an instance in the names of its neighbours, as in a configuration.
const INSTANCE: &str = "{i}";

/// Instances of one block whose inputs differ only in their number.
struct Group<'a> {
    block_type: BlockType,
    instances: Vec<&'a str>,
    /// The place of the first in the order of execution, from 1.
    position: usize,
    inputs: Vec<PinRow>,
    /// For each output what an expression reads for it, its readers, of all instances, and its unit.
    outputs: Vec<Output>,
}

struct Output {
    sources: Vec<String>,
    readers: Vec<String>,
    unit: String,
}

/// A pin: its connection or its value, and its unit.
type PinRow = (String, String);

pub(super) fn section(page: &mut Page, plan: &Plan, connections: &Connections) {
    if plan.instances() == 0 {
        return;
    }
    page.heading("Blocks");
    for (index, task) in plan.tasks.iter().enumerate() {
        for group in groups(plan, (index, task), connections) {
            write(page, plan, task, &group);
        }
    }
}

fn groups<'a>(
    plan: &'a Plan,
    (index, task): (usize, &'a TaskPlan),
    connections: &Connections,
) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    let mut known: HashMap<(&str, Vec<PinRow>, Vec<String>), usize> = HashMap::new();
    let mut position = 0;
    for bank in task.block_banks() {
        let (block_type, stride) = (bank.block_type, bank.block_type.slots());
        for (place, instance) in bank.instances.iter().enumerate() {
            position += 1;
            let first = bank.first_slot + place * stride;
            let inputs = block_type.parameters().iter().zip(first..);
            let inputs =
                inputs.map(|(pin, slot)| input(plan, (index, slot), (instance, pin), connections));
            let inputs: Vec<PinRow> = inputs.collect();
            let number = instance.split_once('.').map(|(_, number)| number);
            let outputs = block_type.outputs.iter().zip(first + block_type.inputs.len()..);
            let outputs = outputs.map(|(pin, slot)| {
                let name = format!("{instance}.{}", pin.name);
                let sources = connections.sources(&name).iter();
                Output {
                    sources: sources.map(|source| numberless(&source.name, number)).collect(),
                    readers: connections.readers(&name).to_vec(),
                    unit: plan.slot_unit(index, slot).to_owned(),
                }
            });
            let outputs: Vec<Output> = outputs.collect();
            let (base, _) = instance.split_once('.').unwrap_or((instance, ""));
            let read: Vec<_> = outputs.iter().flat_map(|output| output.sources.clone()).collect();
            let group = *known.entry((base, inputs.clone(), read)).or_insert(groups.len());
            if let Some(group) = groups.get_mut(group) {
                group.instances.push(instance);
                for (of_group, own) in group.outputs.iter_mut().zip(outputs) {
                    of_group.readers.extend(own.readers);
                }
            } else {
                groups.push(Group {
                    block_type,
                    instances: vec![instance],
                    position,
                    inputs,
                    outputs,
                });
            }
        }
    }
    groups
}

/// What stands at an input pin. One with a wire and without a unit has that of the wire.
fn input(
    plan: &Plan,
    (task, slot): (usize, usize),
    (instance, pin): (&str, &Pin),
    connections: &Connections,
) -> PinRow {
    let own = plan.slot_unit(task, slot).to_owned();
    let Some(source) = connections.sources(&format!("{instance}.{}", pin.name)).first() else {
        let image = plan.tasks.get(task).and_then(|task| task.image.get(slot));
        return (constant(plan, pin, image.copied().unwrap_or_default()), own);
    };
    let number = instance.split_once('.').map(|(_, number)| number);
    let unit = if own.is_empty() { source.unit.clone() } else { own };
    (format!("\u{2190} {}", numberless(&source.name, number)), unit)
}

/// A text with `{i}` for the number of the instance that it is about.
fn numberless(text: &str, number: Option<&str>) -> String {
    let Some(number) = number else { return text.to_owned() };
    text.replace(&format!(".{number}."), &format!(".{INSTANCE}."))
}

/// A constant as the file would have it.
fn constant(plan: &Plan, pin: &Pin, value: f64) -> String {
    let is_default = pin.default.slot().is_some_and(|slot| slot.to_bits() == value.to_bits());
    let text = match Value::of(value, pin.pin_type) {
        Value::Task { period_ns } => {
            let task = plan.tasks.iter().find(|task| task.settings.period_ns == period_ns);
            let named = task.map(|task| format!("task {}", task.name));
            named.unwrap_or_else(|| format!("a task of {}", format_duration_ns(period_ns)))
        }
        value => shown_value(value, pin.pin_type, Digits::All),
    };
    if is_default { format!("{text} (default)") } else { text }
}

/// The names of instances; those that follow each other as one.
fn names(instances: &[&str]) -> String {
    let mut runs: Vec<(&str, &str, usize)> = Vec::new();
    for name in instances {
        let number = name.split_once('.').and_then(|(_, number)| number.parse().ok());
        match (runs.last_mut(), number) {
            (Some((_, last, at)), Some(number)) if *at + 1 == number => {
                (*last, *at) = (name, number)
            }
            (_, number) => runs.push((name, name, number.unwrap_or_default())),
        }
    }
    let of_run = |(first, last, _): &(&str, &str, usize)| {
        if first == last { (*first).to_owned() } else { format!("{first} to {last}") }
    };
    runs.iter().map(of_run).collect::<Vec<_>>().join(", ")
}

/// A sentence without the marks of its code.
fn plain(doc: &str) -> String {
    doc.replace('`', "")
}

fn write(page: &mut Page, plan: &Plan, task: &TaskPlan, group: &Group<'_>) {
    let Group { block_type, instances, position, inputs, outputs } = group;
    page.markup("<section class=\"block\">\n<h3><code>");
    page.text(names(instances));
    page.element("</code> \u{2013} ", block_type.name, "</h3>\n");
    let comment = instances.first().and_then(|name| plan.labels(name));
    if let Some(labels) = comment.filter(|labels| !labels.comment.is_empty()) {
        page.element("<p>", &labels.comment, "</p>\n");
    }
    page.element("<p class=\"soft\">", plain(block_type.doc()), "</p>\n");
    let columns =
        ["pin", "", "type", "constant, source, readers", "unit", "meaning"].map(TableColumn::Words);
    let row = |pin: &Pin, direction: &str, connection: &str, unit: &str| {
        let name = pin.name.to_owned();
        let (direction, value_type) = (direction.to_owned(), pin.pin_type.to_string());
        Row::of([
            name,
            direction,
            value_type,
            connection.to_owned(),
            unit.to_owned(),
            plain(pin.doc()),
        ])
    };
    let read = block_type.parameters().iter().zip(inputs);
    let read = read.map(|(pin, (text, unit))| row(pin, "in", text, unit));
    let written = block_type.outputs.iter().zip(outputs).map(|(pin, output)| {
        let both = [("\u{2190}", output.sources.join(", ")), ("\u{2192}", joined(&output.readers))];
        let both = both.iter().filter(|(_, names)| !names.is_empty());
        let both: Vec<_> = both.map(|(arrow, names)| format!("{arrow} {names}")).collect();
        row(pin, "out", &both.join("; "), &output.unit)
    });
    let blocks: usize = task.block_banks().map(|bank| bank.instances.len()).sum();
    let count = match instances.len() {
        1 => String::new(),
        some => format!("{} alike, {INSTANCE} is their number; ", counted(some, "instance")),
    };
    let name = &task.name;
    let caption =
        format!("{count}task {name}, number {position} of {blocks} in the order of execution");
    page.table(caption, &columns, read.chain(written));
    page.markup("</section>\n");
}
