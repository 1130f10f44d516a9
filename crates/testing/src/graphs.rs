//! Random nodes of two tasks, and their configurations.

use std::fmt::Write as _;

use isochrone_blocks::{BlockType, CATALOGUE, PinType};
use proptest::prelude::*;

/// Periods of the tasks `t0` and `t1`.
pub const PERIODS_NS: [u64; 2] = [1_000_000, 10_000_000];
/// OB numbers and periods of the tasks that have one.
pub const OBS: &[(i16, u64)] = &[(35, PERIODS_NS[0])];
/// Name, type, task and default of the node's inputs.
pub const INPUTS: [(&str, PinType, usize, f64); 6] = [
    ("l0", PinType::Lreal, 0, 2.5),
    ("l1", PinType::Lreal, 1, 0.0),
    ("i0", PinType::Int, 0, 3.0),
    ("i1", PinType::Int, 1, -4.0),
    ("b0", PinType::Bool, 0, 0.0),
    ("t1", PinType::Time, 1, 5.0),
];

/// What stands at an input pin.
#[derive(Clone, Copy, Debug)]
pub enum At {
    /// Nothing: the pin has its default.
    Default,
    /// A constant.
    Constant(f64),
    /// An input, by its index in [`INPUTS`].
    Input(usize),
    /// A pin of an instance of an entry, or of the one with the reader's number.
    Wire {
        /// Index of the entry.
        entry: usize,
        /// The instance; `None`: that with the reader's number.
        instance: Option<usize>,
        /// Index of the output pin.
        pin: usize,
        /// Whether it is the value of the cycle before.
        previous: bool,
    },
}

/// Instances of a block type.
#[derive(Debug)]
pub struct Entry {
    /// Their type.
    pub block_type: BlockType,
    /// How many.
    pub count: usize,
    /// Index of their task.
    pub task: usize,
    /// What stands at each input pin.
    pub pins: Vec<At>,
    /// Place in the file; the entries are in an order in which they can step.
    place: u16,
}

/// A choice for a pin: what, which, which instance, of the cycle before.
pub type PinChoice = (u8, u16, u8, u8);
/// A choice for an entry: type, count, task, pins, place in the file.
pub type EntryChoice = (usize, usize, usize, [PinChoice; 32], u16);

/// Pins that decide whether a block works at all.
fn is_parameter(name: &str) -> bool {
    ["Rate", "Lim", "yMin", "yMax", "callOB", "enDefault", "track", "manOp", "reset"]
        .iter()
        .any(|part| name.contains(part))
}

/// A constant with which blocks mostly, but not always, work.
fn constant(pin_type: PinType, choice: u16, name: &str) -> f64 {
    let pick = |values: &[f64]| values[usize::from(choice) % values.len()];
    match (pin_type, name) {
        (PinType::Int, "callOB") => pick(&[35.0, 35.0, 35.0, 36.0, 7.0]),
        (PinType::Bool, _) => pick(&[0.0, 0.0, 0.0, 1.0]),
        (PinType::Int | PinType::Time, _) => pick(&[0.0, 1.0, 2.0, 7.0, -3.0, 30_000.0]),
        (_, "setHighLim" | "yMax") => pick(&[50.0, 1e6, f64::INFINITY, f64::INFINITY, -60.0]),
        (_, "setLowLim" | "yMin") => {
            pick(&[-50.0, -1e6, f64::NEG_INFINITY, f64::NEG_INFINITY, 60.0])
        }
        (_, name) if name.contains("Rate") => pick(&[250.0, 1e3, 1e4, f64::INFINITY, 0.0, -1.0]),
        _ => pick(&[0.0, 1.0, 10.0, 250.0, -2.5, -0.5, 1e3, 1e6, 1e300, f64::INFINITY]),
    }
}

/// Makes a graph without loops of what chance has chosen.
pub fn entries(choices: Vec<EntryChoice>) -> Vec<Entry> {
    let shapes: Vec<(BlockType, usize, usize)> = choices
        .iter()
        .map(|(block_type, count, task, ..)| (CATALOGUE[*block_type], *count, *task))
        .collect();
    let at = |reader: usize, (pin, choice): (&isochrone_blocks::Pin, &PinChoice)| {
        let (_, count, task) = shapes[reader];
        let (what, which, instance, previous) = *choice;
        let pick = |len: usize| usize::from(which) % len;
        let constant = match pin.default.slot() {
            Some(_) if which % 5 == 0 => At::Default,
            _ => At::Constant(constant(pin.pin_type, which, pin.name)),
        };
        let previous = previous < 64;
        match what % 4 {
            2.. if is_parameter(pin.name) && what < 192 => constant,
            0 => constant,
            1 => {
                let fits = |input: &usize| INPUTS[*input].1.feeds(pin.pin_type);
                let inputs: Vec<usize> = (0..INPUTS.len()).filter(fits).collect();
                if inputs.is_empty() { constant } else { At::Input(inputs[pick(inputs.len())]) }
            }
            _ => {
                let mut pins = Vec::new();
                for (entry, (block_type, _, producer)) in shapes.iter().enumerate() {
                    if previous || entry < reader || *producer != task {
                        let outputs = block_type.outputs.iter().enumerate();
                        let fits =
                            outputs.filter(|(_, output)| output.pin_type.feeds(pin.pin_type));
                        pins.extend(fits.map(|(output, _)| (entry, output)));
                    }
                }
                if pins.is_empty() {
                    return constant;
                }
                let (entry, pin) = pins[pick(pins.len())];
                let producers = shapes[entry].1;
                let instance = match instance {
                    0..128 if producers >= count => None,
                    instance => Some(usize::from(instance) % producers),
                };
                At::Wire { entry, instance, pin, previous }
            }
        }
    };
    let entry = |(reader, choice): (usize, &EntryChoice)| {
        let (block_type, count, task) = shapes[reader];
        assert!(block_type.inputs.len() <= choice.3.len(), "a choice for each pin");
        let pins = block_type.inputs.iter().zip(&choice.3).map(|pin| at(reader, pin)).collect();
        Entry { block_type, count, task, pins, place: choice.4 }
    };
    choices.iter().enumerate().map(entry).collect()
}

/// The graph as a configuration. Task t publishes every pin of its instances as output t.
pub fn configuration(entries: &[Entry]) -> String {
    configuration_with(entries, entries.len())
}

/// As [`configuration`], where pins of the first entries only are published.
pub fn configuration_with(entries: &[Entry], published: usize) -> String {
    let mut text = String::from("[node]\nname = \"n\"\ncontrol = \"force\"\n");
    for (task, period_ns) in PERIODS_NS.iter().enumerate() {
        let ob = if task == 0 { "ob = 35\n" } else { "" };
        write!(text, "[[task]]\nname = \"t{task}\"\nperiod = \"{period_ns}ns\"\n{ob}").unwrap();
    }
    for (name, pin_type, task, default) in INPUTS {
        write!(text, "[[input]]\nname = \"{name}\"\ntype = \"{pin_type}\"\ntask = \"t{task}\"\ndefault = {default:?}\n").unwrap();
    }
    let mut places: Vec<usize> = (0..entries.len()).collect();
    places.sort_by_key(|entry| entries[*entry].place);
    for index in places {
        let entry = &entries[index];
        let (block_type, count, task) = (entry.block_type, entry.count, entry.task);
        write!(text, "[[block]]\nname = \"e{index}\"\ntype = \"{}\"\ncount = {count}\ntask = \"t{task}\"\n[block.in]\n", block_type.name).unwrap();
        for (pin, at) in block_type.inputs.iter().zip(&entry.pins) {
            match at {
                At::Default => continue,
                At::Constant(value) if pin.pin_type == PinType::Lreal => {
                    writeln!(text, "{} = {value:?}", pin.name)
                }
                At::Constant(value) if pin.pin_type == PinType::Bool => {
                    writeln!(text, "{} = {}", pin.name, *value != 0.0)
                }
                At::Constant(value) => writeln!(text, "{} = {value}", pin.name),
                At::Input(input) => writeln!(text, "{} = \"{}\"", pin.name, INPUTS[*input].0),
                At::Wire { entry, instance, pin: output, previous } => {
                    let output = entries[*entry].block_type.outputs[*output].name;
                    let instance =
                        instance.map_or("{i}".to_string(), |instance| instance.to_string());
                    let previous = if *previous { "@prev" } else { "" };
                    writeln!(text, "{} = \"e{entry}.{instance}.{output}{previous}\"", pin.name)
                }
            }
            .unwrap();
        }
    }
    for task in 0..PERIODS_NS.len() {
        let mut signals = vec![];
        let of_task = entries.iter().enumerate().take(published);
        for (index, entry) in of_task.filter(|(_, entry)| entry.task == task) {
            for instance in 0..entry.count {
                signals.extend(
                    entry
                        .block_type
                        .outputs
                        .iter()
                        .map(|pin| format!("e{index}.{instance}.{}", pin.name)),
                );
            }
        }
        if !signals.is_empty() {
            write!(
                text,
                "[[output]]\nservice = \"s{task}\"\ntask = \"t{task}\"\nsignals = {signals:?}\n"
            )
            .unwrap();
        }
    }
    text
}

/// Any entry.
pub fn entry_choice() -> impl Strategy<Value = EntryChoice> {
    let pin = any::<PinChoice>();
    (
        0..CATALOGUE.len(),
        // From eight on, instances may be stepped as one.
        prop_oneof![6 => 1usize..5, 1 => 8usize..14],
        prop::sample::select(&[0, 0, 0, 1]),
        prop::array::uniform32(pin),
        any::<u16>(),
    )
}
