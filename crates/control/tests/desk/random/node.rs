//! The node itself.

use std::rc::Rc;

use isochrone_control::desk::{Operator, OrderOutcome, PreparedRequest, Replay, Signals};
use isochrone_engine::orders::{Inbox, Replacement};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_model::{Entry, Refusal, Value};
use proptest::prelude::*;

use isochrone_testing::graphs::EntryChoice;

/// A node whose cycles are stepped by hand.
pub(crate) struct Hand {
    pub(crate) operator: Operator,
    pub(crate) engines: Vec<TaskEngine>,
    /// The names of each task's engine.
    pub(crate) signals: [Rc<Signals>; 2],
    pub(crate) inboxes: [Inbox; 2],
    pub(crate) next: [u64; 2],
    /// What the tasks were given, and what came of it.
    pub(crate) past: Vec<Past>,
    pub(crate) replacements: [Option<(Replacement, Rc<Signals>)>; 2],
    pub(crate) text: String,
    pub(crate) choices: Vec<EntryChoice>,
    /// Whether wires of the other task enter a task, in one of its configurations.
    pub(crate) is_entered: [bool; 2],
}

pub(crate) fn is_entered(plan: &Plan) -> [bool; 2] {
    [0, 1].map(|task| plan.links.iter().any(|link| link.to == task))
}

/// A cycle of a task that ran.
pub(crate) struct Past {
    pub(crate) task: usize,
    pub(crate) cycle: u64,
    pub(crate) samples: Vec<(usize, f64)>,
    pub(crate) image: Vec<u64>,
    pub(crate) state: Vec<u64>,
}

fn bits(image: &[f64]) -> Vec<u64> {
    image.iter().map(|slot| slot.to_bits()).collect()
}

pub(crate) fn plan(text: &str) -> Result<Plan, TestCaseError> {
    let plan = Plan::new(Source::new("random.toml", text), &Rules::default());
    plan.map_err(|findings| TestCaseError::fail(format!("{findings:?}\n{text}")))
}

impl Hand {
    pub(crate) fn send(&mut self, prepared: Result<PreparedRequest, Refusal>) -> u64 {
        let (number, orders) = self.operator.send(prepared.unwrap());
        orders.into_iter().for_each(|(task, order)| self.inboxes[task].take(order).unwrap());
        number
    }

    /// Begins a cycle of a task: puts a new engine in its place whose cycle has come.
    pub(crate) fn begin(&mut self, task: usize) {
        let (cycle, samples, image, state) = (self.next[task], vec![], vec![], vec![]);
        self.past.push(Past { task, cycle, samples, image, state });
        let is_due = |(due, _): &mut (Replacement, _)| cycle >= due.at();
        if let Some((mut due, signals)) = self.replacements[task].take_if(is_due) {
            self.engines[task].replace(&mut due, cycle);
            self.operator.replaced(task, due, 0);
            self.signals[task] = signals;
        }
    }

    /// Steps a task; returns the values that were asked for.
    pub(crate) fn step(&mut self, task: usize) -> Vec<(String, Value)> {
        let (engine, cycle) = (&mut self.engines[task], self.next[task]);
        let operator = &mut self.operator;
        engine.expire(cycle, |ended| drop(operator.expired(task, ended, cycle, 0)));
        self.inboxes[task].apply(engine, cycle, 0, |order| drop(operator.done(task, order, 0)));
        engine.step(cycle);
        if let Some(past) = self.past.last_mut() {
            (past.image, past.state) = (bits(engine.image()), engine.state().to_vec());
        }
        let mut values = Vec::new();
        self.inboxes[task].read(engine, cycle, |order| {
            if let OrderOutcome::Read(reading) = operator.done(task, order, 0) {
                values.extend(reading.values);
            }
        });
        if let Some((next, _)) =
            self.replacements[task].as_mut().filter(|(n, _)| cycle + 1 >= n.at())
        {
            engine.hand_over(next);
        }
        values
    }

    /// Runs the cycles of the past again, with what the journal says was done.
    pub(crate) fn replay(&self, plan: &Plan, has_changed: bool) -> Result<(), TestCaseError> {
        let (mut replay, mut engines) = (Replay::new(plan), TaskEngine::build(plan).unwrap());
        let journal: Vec<_> = self.operator.journal(0).collect();
        for Past { task, cycle, samples, image, state } in &self.past {
            let engine = &mut engines[*task];
            for (input, sample) in samples {
                engine.set_input(*input, *sample, 1);
            }
            engine.expire(*cycle, drop);
            let name = self.operator.signals().task_name(*task);
            let is_due = |entry: &&Entry| (&*entry.task, entry.cycle) == (name, *cycle);
            // When a task that changes gives the other one its values is not in the journal.
            let is_exact = !has_changed || !self.is_entered[*task];
            for entry in journal.iter().filter(is_due) {
                let differences = replay.apply(entry, engine).unwrap();
                prop_assert!(!is_exact || differences.is_empty(), "{:?}: {:?}", entry, differences);
            }
            engine.step(*cycle);
            if !is_exact {
                continue;
            }
            prop_assert_eq!(&bits(engine.image()), image, "cycle {} of task {}", cycle, task);
            prop_assert_eq!(engine.state(), &state[..], "cycle {} of task {}", cycle, task);
        }
        Ok(())
    }

    pub(crate) fn shown(&self, task: usize, name: &str) -> f64 {
        let signal = self.signals[task].find(name).unwrap();
        self.engines[signal.task].image()[signal.slot]
    }
}
