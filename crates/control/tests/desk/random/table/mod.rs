//! A naive reference of a node that is operated: a table of names and values, stepped one instance
//! after the other.
//!
//! It knows nothing of slots, banks, boxes or versions: it has what each signal was given, what it
//! shows, and what is forced, by name.

mod change;
mod rows;

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use change::Change;
use isochrone_blocks::Cycle;
pub(crate) use rows::{Kind, Row};
use rows::{instance_name, instances, name, rows, source};

use isochrone_testing::graphs::{Entry, INPUTS, OBS, PERIODS_NS};

pub(crate) type Values = HashMap<String, f64>;

/// What is done at one step of a task.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    Set(Vec<(String, f64)>),
    Undo(Vec<(String, f64)>),
    Force(Vec<(String, f64)>, Option<u64>),
    Release(String),
}

pub(crate) struct Reference {
    /// The entries that each task goes by: its own, and those of the other that it reads.
    entries: [Rc<Vec<Entry>>; 2],
    change: Option<Change>,
    rows: [Vec<Row>; 2],
    /// What inputs and parameters were given.
    pub(crate) given: Values,
    /// What every signal shows.
    pub(crate) now: Values,
    /// What each task's last finished cycle has left, and what was touched by a force then.
    finished: [Values; 2],
    touched: [HashSet<String>; 2],
    /// What a task reads of the other one, where that is not what it has finished last.
    frozen: [Option<Values>; 2],
    pub(crate) forces: HashMap<String, (f64, Option<u64>)>,
    states: HashMap<String, Vec<u64>>,
    /// For each parameter the transactions that set it, and what was there before.
    pub(crate) history: HashMap<String, Vec<(u64, f64)>>,
    /// Transactions that set what is something else since.
    pub(crate) lost: HashSet<u64>,
    pub(crate) waiting: [Vec<(Option<u64>, u64, Operation)>; 2],
}

impl Reference {
    pub(crate) fn new(entries: Rc<Vec<Entry>>) -> Self {
        let mut reference = Self {
            rows: [rows(&entries, 0), rows(&entries, 1)],
            entries: [entries.clone(), entries],
            change: None,
            given: Values::new(),
            now: Values::new(),
            finished: Default::default(),
            touched: Default::default(),
            frozen: [None, None],
            forces: HashMap::new(),
            states: HashMap::new(),
            history: HashMap::new(),
            lost: HashSet::new(),
            waiting: Default::default(),
        };
        for task in 0..2 {
            for row in &reference.rows[task] {
                reference.now.insert(row.name.clone(), row.initial);
                reference.given.insert(row.name.clone(), row.initial);
            }
            for (index, _, name) in instances(&reference.entries[task], task) {
                let words = reference.entries[task][index].block_type.state_words;
                reference.states.insert(name, vec![0; words]);
            }
        }
        reference.finished = [reference.now.clone(), reference.now.clone()];
        reference
    }

    pub(crate) fn rows(&self, task: usize) -> &[Row] {
        &self.rows[task]
    }

    pub(crate) fn task_of(&self, name: &str) -> usize {
        usize::from(self.rows[1].iter().any(|row| row.name == name))
    }

    /// The signals of a task that are forced, or about to be.
    pub(crate) fn forced_or_about_to_be(&self, task: usize) -> Vec<String> {
        let in_place = self.forces.keys().filter(|name| self.task_of(name) == task);
        let waiting = self.waiting[task].iter().flat_map(|(_, _, operation)| match operation {
            Operation::Force(values, _) => &values[..],
            Operation::Set(_) | Operation::Undo(_) | Operation::Release(_) => &[],
        });
        let names = in_place.chain(waiting.map(|(name, _)| name));
        names.cloned().collect::<std::collections::BTreeSet<_>>().into_iter().collect()
    }

    /// Whether a transaction can be taken back: nothing has changed its values since, or will.
    pub(crate) fn undo(&self, transaction: u64) -> Option<Vec<(String, f64)>> {
        if self.lost.contains(&transaction) {
            return None;
        }
        let is_of = |(_, history): &(&String, &Vec<(u64, f64)>)| {
            history.last().is_some_and(|(number, _)| *number == transaction)
        };
        let on_top = self.history.iter().filter(is_of);
        let values: Vec<(String, f64)> =
            on_top.map(|(name, history)| (name.clone(), history.last().unwrap().1)).collect();
        let everywhere = self.history.values().flatten().filter(|(n, _)| *n == transaction).count();
        let is_moving = |name: &String| {
            self.waiting.iter().flatten().any(|(_, _, operation)| match operation {
                Operation::Set(values) | Operation::Undo(values) => {
                    values.iter().any(|(moving, _)| moving == name)
                }
                Operation::Force(..) | Operation::Release(_) => false,
            })
        };
        let is_whole = values.len() == everywhere && !values.is_empty();
        (is_whole && !values.iter().any(|(name, _)| is_moving(name))).then_some(values)
    }

    fn apply(&mut self, number: u64, operation: Operation, cycle: u64) {
        match operation {
            Operation::Set(values) => {
                for (name, value) in values {
                    let before = self.given.insert(name.clone(), value).unwrap();
                    self.history.entry(name).or_default().push((number, before));
                }
            }
            Operation::Undo(values) => {
                for (name, before) in values {
                    self.history.get_mut(&name).unwrap().pop();
                    self.given.insert(name, before);
                }
            }
            Operation::Force(values, cycles) => {
                let until = cycles.map(|cycles| cycle + cycles);
                self.forces.extend(values.into_iter().map(|(name, value)| (name, (value, until))));
            }
            Operation::Release(name) => {
                self.forces.remove(&name);
                let task = self.task_of(&name);
                // Those that wait were asked for before.
                for (_, _, operation) in &mut self.waiting[task] {
                    if let Operation::Force(values, _) = operation {
                        values.retain(|(forced, _)| *forced != name);
                    }
                }
                self.waiting[task].retain(|(_, _, operation)| {
                    !matches!(operation, Operation::Force(values, _) if values.is_empty())
                });
            }
        }
    }

    fn show(&mut self, name: &str, value: f64) -> f64 {
        let shown = self.forces.get(name).map_or(value, |(forced, _)| *forced);
        self.now.insert(name.to_owned(), shown);
        shown
    }

    pub(crate) fn step(&mut self, task: usize, cycle: u64) {
        let tasks: HashMap<String, usize> =
            self.forces.keys().map(|name| (name.clone(), self.task_of(name))).collect();
        self.forces.retain(|name, (_, until)| {
            tasks[name] != task || until.is_none_or(|until| cycle < until)
        });
        let waiting = std::mem::take(&mut self.waiting[task]);
        for (at, number, operation) in waiting {
            if at.is_none_or(|at| at <= cycle) {
                self.apply(number, operation, cycle);
            } else {
                self.waiting[task].push((at, number, operation));
            }
        }
        for (input, ..) in INPUTS.iter().filter(|input| input.2 == task) {
            self.show(input, self.given[*input]);
        }
        let context = Cycle::new(cycle, PERIODS_NS[task], OBS);
        let entries = self.entries[task].clone();
        for (index, entry) in entries.iter().enumerate().filter(|(_, entry)| entry.task == task) {
            for instance in 0..entry.count {
                let mut slots = Vec::new();
                for (pin, at) in entry.block_type.inputs.iter().zip(&entry.pins) {
                    let name = name(&entries, index, instance, pin.name);
                    let value = match source(&entries, task, instance, *at) {
                        None => self.given[&name],
                        Some((source, _, true)) => self.now[&source],
                        Some((source, from, false)) => self.seen(task, from, &source),
                    };
                    slots.push(self.show(&name, value));
                }
                slots.resize(entry.block_type.slots(), 0.0);
                let state = self.states.get_mut(&instance_name(&entries, index, instance)).unwrap();
                entry.block_type.step_bank(&mut slots, state, &context);
                let outputs = slots.split_off(entry.block_type.inputs.len());
                for (pin, value) in entry.block_type.outputs.iter().zip(outputs) {
                    self.show(&name(&entries, index, instance, pin.name), value);
                }
            }
        }
        self.finished[task] = self.now.clone();
        self.touched[task] = self.touch(task);
    }

    /// What a force acts on, in this cycle or by the values of the cycle before.
    fn touch(&self, task: usize) -> HashSet<String> {
        let entries = &self.entries[task];
        let forced = self.forces.keys().filter(|name| self.task_of(name) == task);
        let mut touched: HashSet<String> = forced.cloned().collect();
        loop {
            let before = touched.len();
            for (index, entry) in entries.iter().enumerate().filter(|(_, e)| e.task == task) {
                for instance in 0..entry.count {
                    let mut pins = entry.block_type.inputs.iter().zip(&entry.pins);
                    let is_touched = pins.any(|(pin, at)| {
                        touched.contains(&name(entries, index, instance, pin.name))
                            || source(entries, task, instance, *at).is_some_and(
                                |(source, from, _)| {
                                    let of =
                                        if from == task { &touched } else { &self.touched[from] };
                                    of.contains(&source)
                                },
                            )
                    });
                    if is_touched {
                        let outputs = entry.block_type.outputs.iter();
                        touched.extend(outputs.map(|pin| name(entries, index, instance, pin.name)));
                    }
                }
            }
            if touched.len() == before {
                return touched;
            }
        }
    }

    /// Whether the frame of a task, which has the outputs of the first entries' blocks, is touched.
    pub(crate) fn frame_is_touched(&self, task: usize, published: usize) -> bool {
        let entries = &self.entries[task];
        instances(entries, task).into_iter().filter(|(entry, ..)| *entry < published).any(
            |(entry, instance, _)| {
                let mut pins = entries[entry].block_type.outputs.iter();
                pins.any(|pin| {
                    self.touched[task].contains(&name(entries, entry, instance, pin.name))
                })
            },
        )
    }
}
