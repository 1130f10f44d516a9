//! The signals of entries, by name.

use isochrone_blocks::PinType;

use isochrone_testing::graphs::{At, Entry, INPUTS};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Input,
    Parameter,
    Wired,
    Output,
}

/// A signal: its name, kind, type, and what it shows at first.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) pin_type: PinType,
    pub(crate) initial: f64,
}

pub(super) fn instance_name(entries: &[Entry], entry: usize, instance: usize) -> String {
    match entries[entry].count {
        1 => format!("e{entry}"),
        _ => format!("e{entry}.{instance}"),
    }
}

pub(super) fn name(entries: &[Entry], entry: usize, instance: usize, pin: &str) -> String {
    format!("{}.{pin}", instance_name(entries, entry, instance))
}

/// The instances of a task: entry, number, name.
pub(super) fn instances(entries: &[Entry], task: usize) -> Vec<(usize, usize, String)> {
    let of_task = entries.iter().enumerate().filter(|(_, entry)| entry.task == task);
    let instances = of_task.flat_map(|(index, entry)| {
        (0..entry.count).map(move |i| (index, i, instance_name(entries, index, i)))
    });
    instances.collect()
}

/// The signals of a task.
pub(super) fn rows(entries: &[Entry], task: usize) -> Vec<Row> {
    let inputs = INPUTS.iter().filter(|input| input.2 == task);
    let mut rows: Vec<Row> = inputs
        .map(|(name, pin_type, _, initial)| Row {
            name: (*name).to_owned(),
            kind: Kind::Input,
            pin_type: *pin_type,
            initial: *initial,
        })
        .collect();
    for (index, instance, _) in instances(entries, task) {
        let entry = &entries[index];
        for (pin, at) in entry.block_type.inputs.iter().zip(&entry.pins) {
            let (kind, initial) = match at {
                At::Default => (Kind::Parameter, pin.default.slot().unwrap()),
                At::Constant(value) => (Kind::Parameter, *value),
                At::Input(_) | At::Wire { .. } => (Kind::Wired, 0.0),
            };
            let name = name(entries, index, instance, pin.name);
            rows.push(Row { name, kind, pin_type: pin.pin_type, initial });
        }
        for pin in entry.block_type.outputs {
            let name = name(entries, index, instance, pin.name);
            let (kind, pin_type) = (Kind::Output, pin.pin_type);
            rows.push(Row { name, kind, pin_type, initial: 0.0 });
        }
    }
    rows
}

/// The signal that a pin is wired to, its task, and whether the wire is of this cycle.
pub(super) fn source(
    entries: &[Entry],
    task: usize,
    reader: usize,
    at: At,
) -> Option<(String, usize, bool)> {
    match at {
        At::Default | At::Constant(_) => None,
        At::Input(input) => {
            Some((INPUTS[input].0.to_owned(), INPUTS[input].2, INPUTS[input].2 == task))
        }
        At::Wire { entry, instance, pin, previous } => {
            let (from, of) = (entries[entry].task, entries[entry].block_type);
            let instance = instance.unwrap_or(reader);
            let name = name(entries, entry, instance, of.outputs[pin].name);
            Some((name, from, from == task && !previous))
        }
    }
}
