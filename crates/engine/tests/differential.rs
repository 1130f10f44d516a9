//! The engine against a naive reference that steps one instance after the other.
//!
//! The reference takes nothing from the plan but block types: it knows the graph from which the
//! configuration was written.

use std::fmt::Write as _;

use isochrone_blocks::{BlockType, CATALOGUE, Cycle, PinType};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use proptest::prelude::*;

const PERIODS_NS: [u64; 2] = [1_000_000, 10_000_000];
const OBS: &[(i16, u64)] = &[(35, PERIODS_NS[0])];
/// Name, type, task and default of the node's inputs.
const INPUTS: [(&str, PinType, usize, f64); 6] = [
    ("l0", PinType::Lreal, 0, 2.5),
    ("l1", PinType::Lreal, 1, 0.0),
    ("i0", PinType::Int, 0, 3.0),
    ("i1", PinType::Int, 1, -4.0),
    ("b0", PinType::Bool, 0, 0.0),
    ("t1", PinType::Time, 1, 5.0),
];

/// What stands at an input pin.
#[derive(Clone, Copy, Debug)]
enum At {
    Default,
    Constant(f64),
    Input(usize),
    /// A pin of an instance of an entry, or of the one with the reader's number.
    Wire {
        entry: usize,
        instance: Option<usize>,
        pin: usize,
        previous: bool,
    },
}

#[derive(Debug)]
struct Entry {
    block_type: BlockType,
    count: usize,
    task: usize,
    pins: Vec<At>,
    /// Place in the file; the entries are in an order in which they can step.
    place: u16,
}

/// A choice for a pin: what, which, which instance, of the cycle before.
type PinChoice = (u8, u16, u8, u8);
type EntryChoice = (usize, usize, usize, [PinChoice; 14], u16);

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
fn entries(choices: Vec<EntryChoice>) -> Vec<Entry> {
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
        let pins = block_type.inputs.iter().zip(&choice.3).map(|pin| at(reader, pin)).collect();
        Entry { block_type, count, task, pins, place: choice.4 }
    };
    choices.iter().enumerate().map(entry).collect()
}

/// The graph as a configuration. Task t publishes every pin of its instances as output t.
fn configuration(entries: &[Entry]) -> String {
    let mut text = String::from("[node]\nname = \"n\"\n");
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
        for (index, entry) in entries.iter().enumerate().filter(|(_, entry)| entry.task == task) {
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

/// Values of the node's inputs, and of every instance's outputs by entry.
#[derive(Clone)]
struct Values {
    inputs: [f64; INPUTS.len()],
    outputs: Vec<Vec<Vec<f64>>>,
}

struct Reference<'a> {
    entries: &'a [Entry],
    now: Values,
    /// What each task's last finished cycle has left.
    finished: [Values; 2],
    states: Vec<Vec<Vec<u64>>>,
    errors: [u64; 2],
}

impl<'a> Reference<'a> {
    fn new(entries: &'a [Entry]) -> Self {
        let outputs = |entry: &Entry| vec![vec![0.0; entry.block_type.outputs.len()]; entry.count];
        let states = |entry: &Entry| vec![vec![0; entry.block_type.state_words]; entry.count];
        let now = Values {
            inputs: INPUTS.map(|(.., default)| default),
            outputs: entries.iter().map(outputs).collect(),
        };
        let finished = [now.clone(), now.clone()];
        Self {
            entries,
            now,
            finished,
            states: entries.iter().map(states).collect(),
            errors: [0; 2],
        }
    }

    fn read(&self, task: usize, reader: usize, at: At, default: Option<f64>) -> f64 {
        match at {
            At::Default => default.unwrap(),
            At::Constant(value) => value,
            At::Input(input) if INPUTS[input].2 == task => self.now.inputs[input],
            At::Input(input) => self.finished[INPUTS[input].2].inputs[input],
            At::Wire { entry, instance, pin, previous } => {
                let producer = self.entries[entry].task;
                let same_cycle = producer == task && !previous;
                let values = if same_cycle { &self.now } else { &self.finished[producer] };
                values.outputs[entry][instance.unwrap_or(reader)][pin]
            }
        }
    }

    fn step(&mut self, task: usize, cycle: u64) {
        let cycle = Cycle::new(cycle, PERIODS_NS[task], OBS);
        for (index, entry) in
            self.entries.iter().enumerate().filter(|(_, entry)| entry.task == task)
        {
            for instance in 0..entry.count {
                let pins = entry.block_type.inputs.iter().zip(&entry.pins);
                let mut slots: Vec<f64> = pins
                    .map(|(pin, at)| self.read(task, instance, *at, pin.default.slot()))
                    .collect();
                slots.resize(entry.block_type.slots(), 0.0);
                let state = &mut self.states[index][instance];
                self.errors[task] += entry.block_type.step_bank(&mut slots, state, &cycle);
                self.now.outputs[index][instance] = slots.split_off(entry.block_type.inputs.len());
            }
        }
        // What the other task has computed since is not this task's to finish.
        self.finished[task] = self.now.clone();
    }

    fn frame(&self, task: usize) -> Vec<f64> {
        let own =
            self.entries.iter().zip(&self.now.outputs).filter(|(entry, _)| entry.task == task);
        own.flat_map(|(_, outputs)| outputs.concat()).collect()
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn entry_choice() -> impl Strategy<Value = EntryChoice> {
    let pin = any::<PinChoice>();
    (
        0..CATALOGUE.len(),
        1usize..5,
        prop::sample::select(&[0, 0, 0, 1]),
        prop::array::uniform14(pin),
        any::<u16>(),
    )
}

/// A step of a task: which, how many cycles it skips, and a sample for one of the inputs.
fn action() -> impl Strategy<Value = (usize, u64, usize, f64)> {
    let sample = prop_oneof![
        8 => (-20i8..20).prop_map(f64::from),
        2 => -50.0..50.0,
        1 => prop::sample::select(&[f64::NAN, f64::INFINITY, 1e308, 40_000.0]),
    ];
    (0usize..2, prop_oneof![4 => Just(0u64), 1 => 0u64..9], 0..INPUTS.len(), sample)
}

proptest! {
    #[test]
    fn the_engine_steps_every_graph_as_if_instance_by_instance(
        choices in prop::collection::vec(entry_choice(), 1..12),
        actions in prop::collection::vec(action(), 1..40),
    ) {
        let entries = entries(choices);
        let text = configuration(&entries);
        let source = Source { name: "random.toml".into(), text: text.as_str().into() };
        let plan = Plan::new(source, &Rules::default());
        prop_assert!(plan.is_ok(), "{:?}\n{text}", plan.unwrap_err());
        let mut engines = TaskEngine::build(&plan.unwrap()).unwrap();
        let mut reference = Reference::new(&entries);
        let mut cycles = [0; 2];
        for (task, skipped, input, sample) in actions {
            let (_, pin_type, reader, _) = INPUTS[input];
            let own = INPUTS[..input].iter().filter(|(_, _, task, _)| *task == reader).count();
            let taken = engines[reader].set_input(own, sample, 1);
            prop_assert_eq!(taken, pin_type.holds(sample));
            if taken {
                reference.now.inputs[input] = sample;
            }
            engines[task].step(cycles[task]);
            reference.step(task, cycles[task]);
            cycles[task] += 1 + skipped;
            let expected = reference.frame(task);
            let mut frame = vec![f64::NAN; expected.len()];
            engines[task].read_output(0, &mut frame);
            prop_assert_eq!(bits(&frame), bits(&expected), "{:?} not {:?}\n{}", frame, expected, text);
            prop_assert_eq!(engines[task].block_errors(), reference.errors[task]);
        }
    }
}
