//! A naive reference of a node that is operated: a table of names and values, stepped one instance
//! after the other.
//!
//! It knows nothing of slots, banks, boxes or versions: it has what each signal was given, what it
//! shows, and what is forced, by name.

#![allow(unreachable_pub, reason = "each test binary uses another part")]

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use isochrone_blocks::{Cycle, PinType};

use crate::graphs::{At, Entry, INPUTS, OBS, PERIODS_NS};

pub type Values = HashMap<String, f64>;

/// What is done at one step of a task.
#[derive(Clone, Debug)]
pub enum Operation {
    Set(Vec<(String, f64)>),
    Undo(Vec<(String, f64)>),
    Force(Vec<(String, f64)>, Option<u64>),
    Release(String),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Input,
    Parameter,
    Wired,
    Output,
}

/// A signal: its name, kind, type, and what it shows at first.
#[derive(Clone, Debug)]
pub struct Row {
    pub name: String,
    pub kind: Kind,
    pub pin_type: PinType,
    pub initial: f64,
}

/// Other entries for a node, which each task has from a cycle on.
struct Change {
    entries: Rc<Vec<Entry>>,
    at: [u64; 2],
    is_done: [bool; 2],
}

pub struct Reference {
    /// The entries that each task goes by: its own, and those of the other that it reads.
    entries: [Rc<Vec<Entry>>; 2],
    change: Option<Change>,
    rows: [Vec<Row>; 2],
    /// What inputs and parameters were given.
    pub given: Values,
    /// What every signal shows.
    pub now: Values,
    /// What each task's last finished cycle has left, and what was touched by a force then.
    finished: [Values; 2],
    touched: [HashSet<String>; 2],
    /// What a task reads of the other one, where that is not what it has finished last.
    frozen: [Option<Values>; 2],
    pub forces: HashMap<String, (f64, Option<u64>)>,
    states: HashMap<String, Vec<u64>>,
    /// For each parameter the transactions that set it, and what was there before.
    pub history: HashMap<String, Vec<(u64, f64)>>,
    /// Transactions that set what is something else since.
    pub lost: HashSet<u64>,
    pub waiting: [Vec<(Option<u64>, u64, Operation)>; 2],
}

fn instance_name(entries: &[Entry], entry: usize, instance: usize) -> String {
    match entries[entry].count {
        1 => format!("e{entry}"),
        _ => format!("e{entry}.{instance}"),
    }
}

fn name(entries: &[Entry], entry: usize, instance: usize, pin: &str) -> String {
    format!("{}.{pin}", instance_name(entries, entry, instance))
}

/// The instances of a task: entry, number, name.
fn instances(entries: &[Entry], task: usize) -> Vec<(usize, usize, String)> {
    let of_task = entries.iter().enumerate().filter(|(_, entry)| entry.task == task);
    let instances = of_task.flat_map(|(index, entry)| {
        (0..entry.count).map(move |i| (index, i, instance_name(entries, index, i)))
    });
    instances.collect()
}

/// The signals of a task.
fn rows(entries: &[Entry], task: usize) -> Vec<Row> {
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
fn source(entries: &[Entry], task: usize, reader: usize, at: At) -> Option<(String, usize, bool)> {
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

impl Reference {
    pub fn new(entries: Rc<Vec<Entry>>) -> Self {
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

    pub fn rows(&self, task: usize) -> &[Row] {
        &self.rows[task]
    }

    pub fn task_of(&self, name: &str) -> usize {
        usize::from(self.rows[1].iter().any(|row| row.name == name))
    }

    /// Whether other entries may take the place of these.
    pub fn may_change(&self, new: &[Entry]) -> bool {
        self.waiting.iter().all(Vec::is_empty)
            && self.forces.keys().all(|name| self.is_kept(name, new))
    }

    /// Whether a signal is one of an instance of the same name, type and task.
    fn is_kept(&self, name: &str, new: &[Entry]) -> bool {
        let task = self.task_of(name);
        let Some((instance, _)) = name.rsplit_once('.') else { return true };
        let block_type = |entries: &[Entry]| {
            let mut all = instances(entries, task).into_iter();
            all.find(|(.., known)| known == instance).map(|(e, ..)| entries[e].block_type.name)
        };
        block_type(&self.entries[task]).is_some_and(|known| block_type(new) == Some(known))
    }

    /// Whether a signal is one of the same kind, whichever entries its task goes by when a request comes
    /// to it; `is_set`: and those on their way do not say what it is.
    pub fn stays(&self, name: &str, is_set: bool) -> bool {
        let task = self.task_of(name);
        let Some(change) = self.change.as_ref().filter(|change| !change.is_done[task]) else {
            return true;
        };
        let row = |rows: &[Row]| rows.iter().find(|row| row.name == name).cloned();
        let rows = row(&self.rows[task]).zip(row(&rows(&change.entries, task)));
        self.is_kept(name, &change.entries)
            && rows.is_some_and(|(old, new)| {
                let is_left = old.initial.to_bits() == new.initial.to_bits();
                old.kind == new.kind && (is_left || !is_set)
            })
    }

    /// Whether a task goes by the entries that are on their way to the other one.
    pub fn is_ahead(&self, task: usize) -> bool {
        self.change.as_ref().is_some_and(|change| change.is_done[task])
    }

    pub fn change(&mut self, entries: Rc<Vec<Entry>>, at: [u64; 2]) {
        self.change = Some(Change { entries, at, is_done: [false; 2] });
    }

    /// Hands a task over to its new entries, if it is to have them at a cycle.
    pub fn hand_over(&mut self, task: usize, cycle: u64) {
        let Some(mut change) = self.change.take() else { return };
        if cycle >= change.at[task] && !change.is_done[task] {
            change.is_done[task] = true;
            let other = 1 - task;
            let has_other = change.is_done[other];
            // What the other one reads until it changes is what this one has left; then it is what is
            // handed over.
            let left = (!has_other).then(|| self.finished[task].clone());
            let known = (!has_other).then(|| self.seen_after(task, &change.entries));
            self.enter(task, change.entries.clone());
            self.frozen[task] = known;
            self.frozen[other] = left;
        }
        self.change = Some(change).filter(|change| change.is_done != [true; 2]);
    }

    /// What a task with new entries knows of the other one, which has the old ones still.
    fn seen_after(&self, task: usize, new: &[Entry]) -> Values {
        let other = 1 - task;
        let mut seen: Values =
            rows(new, other).into_iter().map(|row| (row.name, row.initial)).collect();
        let entries = &self.entries[task];
        for (entry, instance, _) in instances(entries, task) {
            for at in &entries[entry].pins {
                if let Some((name, from, _)) = source(entries, task, instance, *at)
                    && from == other
                    && self.is_kept(&name, new)
                {
                    let value = self.seen(task, other, &name);
                    seen.insert(name, value);
                }
            }
        }
        seen
    }

    /// What a task reads of a value that is not of its own cycle.
    fn seen(&self, task: usize, from: usize, name: &str) -> f64 {
        let frozen = self.frozen[task].as_ref().filter(|_| from != task);
        frozen.unwrap_or(&self.finished[from])[name]
    }

    fn enter(&mut self, task: usize, entries: Rc<Vec<Entry>>) {
        let before: HashMap<String, Row> =
            self.rows[task].iter().map(|row| (row.name.clone(), row.clone())).collect();
        let after = rows(&entries, task);
        let kept: HashSet<String> = after
            .iter()
            .filter(|row| before.contains_key(&row.name) && self.is_kept(&row.name, &entries))
            .map(|row| row.name.clone())
            .collect();
        for gone in before.keys().filter(|name| !kept.contains(*name)) {
            self.given.remove(gone);
            self.now.remove(gone);
            self.lose(gone);
        }
        for row in &after {
            let known = before.get(&row.name).filter(|_| kept.contains(&row.name));
            if known.is_none() {
                self.now.insert(row.name.clone(), row.initial);
            }
            let is_given = known.is_some_and(|known| match (known.kind, row.kind) {
                (Kind::Parameter, Kind::Parameter) => {
                    known.initial.to_bits() == row.initial.to_bits()
                }
                (known, now) => known == now && now != Kind::Wired,
            });
            if !is_given {
                self.given.insert(row.name.clone(), row.initial);
                self.lose(&row.name);
            }
            // What no cycle computes shows what it was given.
            let is_forced = self.forces.contains_key(&row.name);
            if row.kind == Kind::Parameter && !is_forced {
                self.now.insert(row.name.clone(), self.given[&row.name]);
            }
        }
        let mut states = HashMap::new();
        for (index, _, name) in instances(&entries, task) {
            let words = entries[index].block_type.state_words;
            let known = self.states.get(&name).filter(|_| {
                kept.contains(&format!("{name}.{}", entries[index].block_type.outputs[0].name))
            });
            states.insert(name, known.cloned().unwrap_or_else(|| vec![0; words]));
        }
        let own: HashSet<String> =
            instances(&self.entries[task], task).into_iter().map(|(.., name)| name).collect();
        self.states.retain(|name, _| !own.contains(name));
        self.states.extend(states);
        (self.rows[task], self.entries[task]) = (after, entries);
        self.finished[task] = self.now.clone();
    }

    /// Forgets what was set.
    fn lose(&mut self, name: &str) {
        let history = self.history.remove(name).into_iter().flatten();
        self.lost.extend(history.map(|(number, _)| number));
    }

    /// Whether a transaction can be taken back: nothing has changed its values since, or will.
    pub fn undo(&self, transaction: u64) -> Option<Vec<(String, f64)>> {
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
            Operation::Release(name) => drop(self.forces.remove(&name)),
        }
    }

    fn show(&mut self, name: &str, value: f64) -> f64 {
        let shown = self.forces.get(name).map_or(value, |(forced, _)| *forced);
        self.now.insert(name.to_owned(), shown);
        shown
    }

    pub fn step(&mut self, task: usize, cycle: u64) {
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
    pub fn frame_is_touched(&self, task: usize, published: usize) -> bool {
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
