//! Random requests on random nodes against a naive reference: a table of names and values, stepped one
//! instance after the other.
//!
//! The reference knows nothing of slots, banks, boxes or versions: it has what each signal was given,
//! what it shows, and what is forced, by name.

mod graphs;

use std::collections::{HashMap, HashSet};

use graphs::{At, Entry, INPUTS, OBS, PERIODS_NS, configuration, entries, entry_choice};
use isochrone_blocks::{Cycle, PinType};
use isochrone_engine::operate::{
    Feeds, Hold, Inbox, Operator, Prepared, Refusals, Replay, Request, Value,
};
use isochrone_engine::{Flags, Plan, Rules, Source, TaskEngine};
use proptest::prelude::*;

type Values = HashMap<String, f64>;

/// What is done at one step of a task.
#[derive(Clone, Debug)]
enum Operation {
    Set(Vec<(String, f64)>),
    Undo(Vec<(String, f64)>),
    Force(Vec<(String, f64)>, Option<u64>),
    Release(String),
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Input,
    Parameter,
    Wired,
    Output,
}

struct Reference<'a> {
    entries: &'a [Entry],
    /// Every signal: task, kind, type.
    signals: Vec<(String, usize, Kind, PinType)>,
    /// What inputs and parameters were given.
    given: Values,
    /// What every signal shows.
    now: Values,
    /// What each task's last finished cycle has left, and what was touched by a force then.
    finished: [Values; 2],
    touched: [HashSet<String>; 2],
    forces: HashMap<String, (f64, Option<u64>)>,
    states: HashMap<(usize, usize), Vec<u64>>,
    /// For each parameter the transactions that set it, and what was there before.
    history: HashMap<String, Vec<(u64, f64)>>,
    waiting: [Vec<(Option<u64>, u64, Operation)>; 2],
}

fn name(entries: &[Entry], entry: usize, instance: usize, pin: &str) -> String {
    match entries[entry].count {
        1 => format!("e{entry}.{pin}"),
        _ => format!("e{entry}.{instance}.{pin}"),
    }
}

impl<'a> Reference<'a> {
    fn new(entries: &'a [Entry]) -> Self {
        let (mut signals, mut given, mut now) = (vec![], Values::new(), Values::new());
        for (input, pin_type, task, default) in INPUTS {
            signals.push((input.to_owned(), task, Kind::Input, pin_type));
            given.insert(input.to_owned(), default);
            now.insert(input.to_owned(), default);
        }
        let mut states = HashMap::new();
        for (index, entry) in entries.iter().enumerate() {
            for instance in 0..entry.count {
                states.insert((index, instance), vec![0; entry.block_type.state_words]);
                for (pin, at) in entry.block_type.inputs.iter().zip(&entry.pins) {
                    let name = name(entries, index, instance, pin.name);
                    let (kind, value) = match at {
                        At::Default => (Kind::Parameter, pin.default.slot().unwrap()),
                        At::Constant(value) => (Kind::Parameter, *value),
                        At::Input(_) | At::Wire { .. } => (Kind::Wired, 0.0),
                    };
                    signals.push((name.clone(), entry.task, kind, pin.pin_type));
                    given.insert(name.clone(), value);
                    now.insert(name, value);
                }
                for pin in entry.block_type.outputs {
                    let name = name(entries, index, instance, pin.name);
                    signals.push((name.clone(), entry.task, Kind::Output, pin.pin_type));
                    now.insert(name, 0.0);
                }
            }
        }
        let (finished, history) = ([now.clone(), now.clone()], HashMap::new());
        let (forces, waiting, touched) = (HashMap::new(), Default::default(), Default::default());
        Self { entries, signals, given, now, finished, touched, forces, states, history, waiting }
    }

    fn task_of(&self, name: &str) -> usize {
        self.signals.iter().find(|(known, ..)| known == name).unwrap().1
    }

    /// Whether a transaction can be taken back: nothing has changed its values since, or will.
    fn undo(&self, transaction: u64) -> Option<Vec<(String, f64)>> {
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

    /// The signal that a pin is wired to, its task, and whether the wire is of this cycle.
    fn source(&self, task: usize, reader: usize, at: At) -> Option<(String, usize, bool)> {
        match at {
            At::Default | At::Constant(_) => None,
            At::Input(input) => {
                Some((INPUTS[input].0.to_owned(), INPUTS[input].2, INPUTS[input].2 == task))
            }
            At::Wire { entry, instance, pin, previous } => {
                let (from, of) = (self.entries[entry].task, self.entries[entry].block_type);
                let instance = instance.unwrap_or(reader);
                let name = name(self.entries, entry, instance, of.outputs[pin].name);
                Some((name, from, from == task && !previous))
            }
        }
    }

    fn step(&mut self, task: usize, cycle: u64) {
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
        let entries = self.entries;
        for (index, entry) in entries.iter().enumerate().filter(|(_, entry)| entry.task == task) {
            for instance in 0..entry.count {
                let mut slots = Vec::new();
                for (pin, at) in entry.block_type.inputs.iter().zip(&entry.pins) {
                    let name = name(entries, index, instance, pin.name);
                    let value = match self.source(task, instance, *at) {
                        None => self.given[&name],
                        Some((source, _, true)) => self.now[&source],
                        Some((source, from, false)) => self.finished[from][&source],
                    };
                    slots.push(self.show(&name, value));
                }
                slots.resize(entry.block_type.slots(), 0.0);
                let state = self.states.get_mut(&(index, instance)).unwrap();
                entry.block_type.step_bank(&mut slots, state, &context);
                let outputs = slots.split_off(entry.block_type.inputs.len());
                for (pin, value) in entry.block_type.outputs.iter().zip(outputs) {
                    self.show(&name(entries, index, instance, pin.name), value);
                }
            }
        }
        self.finished[task] = self.now.clone();
        self.touched[task] = self.touch(task);
    }

    /// What a force acts on, in this cycle or by the values of the cycle before.
    fn touch(&self, task: usize) -> HashSet<String> {
        let forced = self.forces.keys().filter(|name| self.task_of(name) == task);
        let mut touched: HashSet<String> = forced.cloned().collect();
        loop {
            let before = touched.len();
            for (index, entry) in self.entries.iter().enumerate().filter(|(_, e)| e.task == task) {
                for instance in 0..entry.count {
                    let mut pins = entry.block_type.inputs.iter().zip(&entry.pins);
                    let is_touched = pins.any(|(pin, at)| {
                        touched.contains(&name(self.entries, index, instance, pin.name))
                            || self.source(task, instance, *at).is_some_and(|(source, from, _)| {
                                let of = if from == task { &touched } else { &self.touched[from] };
                                of.contains(&source)
                            })
                    });
                    if is_touched {
                        let outputs = entry.block_type.outputs.iter();
                        touched.extend(
                            outputs.map(|pin| name(self.entries, index, instance, pin.name)),
                        );
                    }
                }
            }
            if touched.len() == before {
                return touched;
            }
        }
    }

    /// Whether the frame of a task, which has all its blocks' outputs, is touched.
    fn frame_is_touched(&self, task: usize) -> bool {
        let mut outputs =
            self.signals.iter().filter(|(_, of, kind, _)| *of == task && *kind == Kind::Output);
        outputs.any(|(name, ..)| self.touched[task].contains(name))
    }
}

/// The node itself.
struct Hand {
    operator: Operator,
    engines: Vec<TaskEngine>,
    inboxes: [Inbox; 2],
    next: [u64; 2],
    /// What the tasks were given, and what came of it.
    past: Vec<Past>,
}

/// A cycle of a task that ran.
struct Past {
    task: usize,
    cycle: u64,
    samples: Vec<(usize, f64)>,
    image: Vec<u64>,
    state: Vec<u64>,
}

fn bits(image: &[f64]) -> Vec<u64> {
    image.iter().map(|slot| slot.to_bits()).collect()
}

impl Hand {
    fn send(&mut self, prepared: Result<Prepared, Refusals>) -> u64 {
        let (number, orders) = self.operator.send(prepared.unwrap());
        orders.into_iter().for_each(|(task, order)| self.inboxes[task].take(order).unwrap());
        number
    }

    fn step(&mut self, task: usize) {
        let (engine, cycle) = (&mut self.engines[task], self.next[task]);
        let operator = &mut self.operator;
        engine.expire(cycle, |ended| drop(operator.expired(task, ended, cycle, 0)));
        self.inboxes[task].apply(engine, cycle, 0, |order| drop(operator.done(task, order, 0)));
        engine.step(cycle);
        if let Some(past) = self.past.last_mut() {
            (past.image, past.state) = (bits(engine.image()), engine.state().to_vec());
        }
    }

    /// Begins a cycle of a task.
    fn begin(&mut self, task: usize) {
        let (cycle, samples, image, state) = (self.next[task], vec![], vec![], vec![]);
        self.past.push(Past { task, cycle, samples, image, state });
    }

    /// Runs the cycles of the past again, with what the journal says was done.
    fn replay(&self, plan: &Plan) -> Result<(), TestCaseError> {
        let (replay, mut engines) = (Replay::new(plan), TaskEngine::build(plan).unwrap());
        let journal: Vec<_> = self.operator.journal(0).collect();
        for Past { task, cycle, samples, image, state } in &self.past {
            let engine = &mut engines[*task];
            for (input, sample) in samples {
                engine.set_input(*input, *sample, 1);
            }
            engine.expire(*cycle, drop);
            let is_due = |entry: &&isochrone_engine::operate::Entry| {
                (entry.task, entry.cycle) == (*task, *cycle)
            };
            for entry in journal.iter().filter(is_due) {
                prop_assert_eq!(replay.apply(entry, engine).unwrap(), [], "{:?}", entry);
            }
            engine.step(*cycle);
            prop_assert_eq!(&bits(engine.image()), image, "cycle {} of task {}", cycle, task);
            prop_assert_eq!(engine.state(), &state[..], "cycle {} of task {}", cycle, task);
        }
        Ok(())
    }

    fn shown(&self, name: &str) -> f64 {
        let signal = self.operator.signals().find(name).unwrap();
        self.engines[signal.task].image()[signal.slot]
    }
}

/// A value that a type has, by chance.
fn value(pin_type: PinType, choice: u16) -> f64 {
    let pick = |values: &[f64]| values[usize::from(choice) % values.len()];
    match pin_type {
        PinType::Lreal => pick(&[0.0, 1.0, -2.5, 10.0, 250.0, 1e6, f64::INFINITY]),
        PinType::Bool => pick(&[0.0, 1.0]),
        PinType::Int => pick(&[0.0, 1.0, -3.0, 35.0, 30_000.0]),
        PinType::Time => pick(&[0.0, 1.0, 50.0, -3.0]),
        PinType::Word => pick(&[0.0, 1.0, 32_769.0]),
    }
}

/// What is asked for before a step of a task: what, which signals and values, how long, when; and how
/// many cycles are skipped.
#[derive(Clone, Debug)]
struct Action {
    task: usize,
    what: u8,
    choices: Vec<(u16, u16)>,
    cycles: Option<u64>,
    ahead: Option<u64>,
    skipped: u64,
}

fn action() -> impl Strategy<Value = Action> {
    let choices = prop::collection::vec(any::<(u16, u16)>(), 1..4);
    let cycles = prop::option::of(1u64..6);
    let ahead = prop_oneof![3 => Just(None), 1 => (0u64..5).prop_map(Some)];
    let skipped = prop_oneof![4 => Just(0u64), 1 => 0u64..4];
    (0usize..2, any::<u8>(), choices, cycles, ahead, skipped).prop_map(
        |(task, what, choices, cycles, ahead, skipped)| Action {
            task,
            what,
            choices,
            cycles,
            ahead,
            skipped,
        },
    )
}

/// The signals of a task and of some kinds that chance has chosen, each with a value.
fn chosen(
    reference: &Reference<'_>,
    action: &Action,
    kinds: &[Kind],
) -> Vec<(String, PinType, f64)> {
    let of_kind = |(_, task, kind, _): &&(String, usize, Kind, PinType)| {
        *task == action.task && kinds.contains(kind)
    };
    let candidates: Vec<_> = reference.signals.iter().filter(of_kind).collect();
    let mut chosen: Vec<(String, PinType, f64)> = Vec::new();
    for (which, choice) in action.choices.iter().filter(|_| !candidates.is_empty()) {
        let (name, _, _, pin_type) = candidates[usize::from(*which) % candidates.len()];
        if chosen.iter().all(|(known, ..)| known != name) {
            chosen.push((name.clone(), *pin_type, value(*pin_type, *choice)));
        }
    }
    chosen
}

/// Asks for something, of the node and of the reference.
fn ask(
    hand: &mut Hand,
    reference: &mut Reference<'_>,
    action: &Action,
) -> Result<(), TestCaseError> {
    let task = action.task;
    let at = action.ahead.map(|ahead| hand.next[task] + ahead);
    let request = Request { at, ..Request::default() };
    let typed = |chosen: &[(String, PinType, f64)]| -> Vec<(String, Value)> {
        chosen.iter().map(|(name, t, value)| (name.clone(), Value::of(*value, *t))).collect()
    };
    let plain = |chosen: Vec<(String, PinType, f64)>| -> Vec<(String, f64)> {
        chosen.into_iter().map(|(name, _, value)| (name, value)).collect()
    };
    match action.what % 6 {
        0 | 1 => {
            let values = chosen(reference, action, &[Kind::Parameter]);
            if values.is_empty() {
                return Ok(());
            }
            let typed = typed(&values);
            let pairs = typed.iter().map(|(name, value)| (name.as_str(), *value));
            let number = hand.send(hand.operator.set(pairs, request, &hand.next));
            reference.waiting[task].push((at, number, Operation::Set(plain(values))));
        }
        2 => {
            let kinds = [Kind::Input, Kind::Parameter, Kind::Wired, Kind::Output];
            let values = chosen(reference, action, &kinds);
            let typed = typed(&values);
            let pairs = typed.iter().map(|(name, value)| (name.as_str(), *value));
            let seconds = |cycles: u64| Hold::Seconds((cycles * PERIODS_NS[task]) as f64 / 1e9);
            let hold = action.cycles.map_or(Hold::UntilReleased, seconds);
            let number = hand.send(hand.operator.force(pairs, hold, request, &hand.next));
            let operation = Operation::Force(plain(values), action.cycles);
            reference.waiting[task].push((at, number, operation));
        }
        3 => {
            let mut forced: Vec<&String> =
                reference.forces.keys().filter(|name| reference.task_of(name) == task).collect();
            forced.sort();
            let which = usize::from(action.choices[0].0);
            let Some(name) = forced.get(which % forced.len().max(1)).copied().cloned() else {
                return Ok(());
            };
            let number = hand.send(hand.operator.release([name.as_str()], request, &hand.next));
            reference.waiting[task].push((at, number, Operation::Release(name)));
        }
        4 => {
            let mut numbers: Vec<u64> =
                reference.history.values().flatten().map(|(number, _)| *number).collect();
            numbers.sort_unstable();
            let which = usize::from(action.choices[0].0);
            let Some(number) = numbers.get(which % numbers.len().max(1)).copied() else {
                return Ok(());
            };
            let prepared = hand.operator.undo(number, Request::default(), &hand.next);
            let values = reference.undo(number);
            prop_assert_eq!(prepared.is_ok(), values.is_some(), "undo {}: {:?}", number, prepared);
            if let Some(values) = values {
                let of = reference.task_of(&values[0].0);
                let new = hand.send(prepared);
                reference.waiting[of].push((None, new, Operation::Undo(values)));
            }
        }
        _ => {
            for (name, pin_type, sample) in chosen(reference, action, &[Kind::Input]) {
                let own = INPUTS.iter().filter(|(_, _, of, _)| *of == task);
                let input = own.clone().position(|(known, ..)| *known == name).unwrap();
                prop_assert!(pin_type.holds(sample));
                prop_assert!(hand.engines[task].set_input(input, sample, 1));
                hand.past.last_mut().unwrap().samples.push((input, sample));
                reference.given.insert(name, sample);
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(80))]
    #[test]
    fn a_node_that_is_operated_shows_what_a_table_of_names_and_values_shows(
        choices in prop::collection::vec(entry_choice(), 1..8),
        actions in prop::collection::vec(action(), 1..60),
    ) {
        let entries = entries(choices);
        let text = configuration(&entries);
        let plan = Plan::new(Source::new("random.toml", text.as_str()), &Rules::default());
        prop_assert!(plan.is_ok(), "{:?}\n{text}", plan.unwrap_err());
        let plan = plan.unwrap();
        let mut hand = Hand {
            operator: Operator::new(&plan, Feeds::Program),
            engines: TaskEngine::build(&plan).unwrap(),
            inboxes: [Inbox::new(99), Inbox::new(99)],
            next: [0; 2],
            past: vec![],
        };
        let mut reference = Reference::new(&entries);
        for action in actions {
            let task = action.task;
            hand.begin(task);
            ask(&mut hand, &mut reference, &action)?;
            hand.step(task);
            reference.step(task, hand.next[task]);
            for (name, ..) in reference.signals.iter().filter(|(_, of, ..)| *of == task) {
                let (shown, expected) = (hand.shown(name), reference.now[name]);
                prop_assert_eq!(shown.to_bits(), expected.to_bits(), "{}: {} not {} in cycle {}\n{:?}\n{}",
                    name, shown, expected, hand.next[task], action, text);
            }
            let mut forced: Vec<String> = hand.operator.forces().filter(|f| f.task == task && f.since.is_some()).map(|f| f.name.clone()).collect();
            let mut expected: Vec<String> = reference.forces.keys().filter(|name| reference.task_of(name) == task).cloned().collect();
            forced.sort();
            expected.sort();
            prop_assert_eq!(forced, expected);
            let is_flagged = hand.engines[task].output_flags(0).contains(Flags::FORCED);
            prop_assert_eq!(is_flagged, reference.frame_is_touched(task), "{:?}\n{}", action, text);
            hand.next[task] += 1 + action.skipped;
        }
        hand.replay(&plan)?;
        let saved = hand.operator.save(&text).unwrap();
        let plan = Plan::new(Source::new("saved.toml", saved.as_str()), &Rules::default());
        prop_assert!(plan.is_ok(), "{:?}\n{saved}", plan.unwrap_err());
        let engines = TaskEngine::build(&plan.unwrap()).unwrap();
        for (name, ..) in reference.signals.iter().filter(|signal| signal.2 == Kind::Parameter) {
            let signal = hand.operator.signals().find(name).unwrap();
            let constant = engines[signal.task].image()[signal.slot];
            let given = reference.given[name];
            prop_assert_eq!(constant.to_bits(), given.to_bits(), "{}\n{}", name, saved);
        }
    }
}
