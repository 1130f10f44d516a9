//! The engine against a naive reference that steps one instance after the other.
//!
//! The reference takes nothing from the plan but block types: it knows the graph from which the
//! configuration was written.

use isochrone_blocks::Cycle;
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_testing::graphs::{
    At, Entry, INPUTS, OBS, PERIODS_NS, configuration, entries, entry_choice,
};
use proptest::prelude::*;

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
