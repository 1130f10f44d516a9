//! Random requests and changes of the configuration on random nodes, against a naive reference.

mod graphs;
mod table;

use std::rc::Rc;

use graphs::{EntryChoice, INPUTS, PERIODS_NS, configuration_with, entries, entry_choice};
use isochrone_blocks::PinType;
use isochrone_engine::operate::{
    Done, Draft, Feeds, Hold, Inbox, Operator, Prepared, Refusals, Replacement, Replay, Request,
    Signals, Value,
};
use isochrone_engine::{Flags, Plan, Rules, Source, TaskEngine};
use proptest::prelude::*;
use table::{Kind, Operation, Reference, Row};

/// The first entries, whose pins are published, keep their names, types and tasks.
const PUBLISHED: usize = 2;

/// The node itself.
struct Hand {
    operator: Operator,
    engines: Vec<TaskEngine>,
    /// The names of each task's engine.
    signals: [Rc<Signals>; 2],
    inboxes: [Inbox; 2],
    next: [u64; 2],
    /// What the tasks were given, and what came of it.
    past: Vec<Past>,
    replacements: [Option<(Replacement, Rc<Signals>)>; 2],
    text: String,
    choices: Vec<EntryChoice>,
    /// Whether wires of the other task enter a task, in one of its configurations.
    is_entered: [bool; 2],
}

fn is_entered(plan: &Plan) -> [bool; 2] {
    [0, 1].map(|task| plan.links.iter().any(|link| link.to == task))
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

fn plan(text: &str) -> Result<Plan, TestCaseError> {
    let plan = Plan::new(Source::new("random.toml", text), &Rules::default());
    plan.map_err(|findings| TestCaseError::fail(format!("{findings:?}\n{text}")))
}

impl Hand {
    fn send(&mut self, prepared: Result<Prepared, Refusals>) -> u64 {
        let (number, orders) = self.operator.send(prepared.unwrap());
        orders.into_iter().for_each(|(task, order)| self.inboxes[task].take(order).unwrap());
        number
    }

    /// Begins a cycle of a task: puts a new engine in its place whose cycle has come.
    fn begin(&mut self, task: usize) {
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
    fn step(&mut self, task: usize) -> Vec<(String, Value)> {
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
            if let Done::Read(reading) = operator.done(task, order, 0) {
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
    fn replay(&self, plan: &Plan, has_changed: bool) -> Result<(), TestCaseError> {
        let (mut replay, mut engines) = (Replay::new(plan), TaskEngine::build(plan).unwrap());
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

    fn shown(&self, task: usize, name: &str) -> f64 {
        let signal = self.signals[task].find(name).unwrap();
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
    edits: Vec<Edit>,
}

/// An edit of the configuration: where, how, and what is put there.
type Edit = (u16, u8, EntryChoice);

/// A node's entries after edits.
fn edited(old: &[EntryChoice], edits: &[Edit]) -> Vec<EntryChoice> {
    let mut choices = old.to_vec();
    for (place, how, new) in edits {
        let place = usize::from(*place) % choices.len();
        match how % 6 {
            0 if place >= PUBLISHED => choices[place] = *new,
            1 => choices[place].3 = new.3,
            2 => {
                let pin = usize::from(new.4) % new.3.len();
                choices[place].3[pin] = new.3[pin];
            }
            3 => choices.push(*new),
            4 if choices.len() > PUBLISHED => drop(choices.pop()),
            5 if place >= PUBLISHED => choices[place].1 = new.1,
            _ => {}
        }
    }
    // An entry that changes its task would have one name in both for a while.
    choices.iter_mut().zip(old).for_each(|(new, old)| new.2 = old.2);
    choices
}

fn action() -> impl Strategy<Value = Action> {
    let choices = prop::collection::vec(any::<(u16, u16)>(), 1..4);
    let cycles = prop::option::of(1u64..6);
    let ahead = prop_oneof![3 => Just(None), 1 => (0u64..5).prop_map(Some)];
    let skipped = prop_oneof![4 => Just(0u64), 1 => 0u64..4];
    let edits = prop::collection::vec((any::<u16>(), any::<u8>(), entry_choice()), 1..4);
    (0usize..2, any::<u8>(), choices, cycles, ahead, skipped, edits).prop_map(
        |(task, what, choices, cycles, ahead, skipped, edits)| Action {
            task,
            what,
            choices,
            cycles,
            ahead,
            skipped,
            edits,
        },
    )
}

/// The signals of a task and of some kinds that chance has chosen, each with a value.
fn chosen(reference: &Reference, action: &Action, kinds: &[Kind]) -> Vec<(String, PinType, f64)> {
    let rows = reference.rows(action.task).iter();
    let candidates: Vec<&Row> = rows.filter(|row| kinds.contains(&row.kind)).collect();
    let mut chosen: Vec<(String, PinType, f64)> = Vec::new();
    for (which, choice) in action.choices.iter().filter(|_| !candidates.is_empty()) {
        let Row { name, pin_type, .. } = candidates[usize::from(*which) % candidates.len()];
        if chosen.iter().all(|(known, ..)| known != name) {
            chosen.push((name.clone(), *pin_type, value(*pin_type, *choice)));
        }
    }
    chosen
}

/// Asks for something, of the node and of the reference.
fn ask(hand: &mut Hand, reference: &mut Reference, action: &Action) -> Result<(), TestCaseError> {
    let task = action.task;
    let at = action.ahead.map(|ahead| hand.next[task] + ahead);
    let request = Request { at, ..Request::default() };
    let typed = |chosen: &[(String, PinType, f64)]| -> Vec<(String, Value)> {
        chosen.iter().map(|(name, t, value)| (name.clone(), Value::of(*value, *t))).collect()
    };
    let plain = |chosen: Vec<(String, PinType, f64)>| -> Vec<(String, f64)> {
        chosen.into_iter().map(|(name, _, value)| (name, value)).collect()
    };
    let what = action.what % 8;
    match what {
        0 | 1 => {
            let values = chosen(reference, action, &[Kind::Parameter]);
            if values.is_empty() {
                return Ok(());
            }
            let typed = typed(&values);
            let pairs = typed.iter().map(|(name, value)| (name.as_str(), *value));
            let prepared = hand.operator.set(pairs, request, &hand.next);
            let may_set = values.iter().all(|(name, ..)| reference.stays(name, true));
            prop_assert_eq!(prepared.is_ok(), may_set, "{:?}", prepared);
            if !may_set {
                return Ok(());
            }
            let number = hand.send(prepared);
            reference.waiting[task].push((at, number, Operation::Set(plain(values))));
        }
        2 => {
            let kinds = [Kind::Input, Kind::Parameter, Kind::Wired, Kind::Output];
            let values = chosen(reference, action, &kinds);
            let typed = typed(&values);
            let pairs = typed.iter().map(|(name, value)| (name.as_str(), *value));
            let seconds = |cycles: u64| Hold::Seconds((cycles * PERIODS_NS[task]) as f64 / 1e9);
            let hold = action.cycles.map_or(Hold::UntilReleased, seconds);
            let prepared = hand.operator.force(pairs, hold, request, &hand.next);
            let may_force = values.iter().all(|(name, ..)| reference.stays(name, false));
            prop_assert_eq!(prepared.is_ok(), may_force, "{:?}", prepared);
            if !may_force {
                return Ok(());
            }
            let number = hand.send(prepared);
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
            numbers.extend(&reference.lost);
            numbers.sort_unstable();
            let which = usize::from(action.choices[0].0);
            let Some(number) = numbers.get(which % numbers.len().max(1)).copied() else {
                return Ok(());
            };
            // The reference hands over in the slack, and the operator hears of it after that.
            if [0, 1].iter().any(|of| hand.replacements[*of].is_some() && reference.is_ahead(*of)) {
                return Ok(());
            }
            let prepared = hand.operator.undo(number, Request::default(), &hand.next);
            let stay = |values: &Vec<(String, f64)>| {
                values.iter().all(|(name, _)| reference.stays(name, true))
            };
            let values = reference.undo(number).filter(stay);
            prop_assert_eq!(prepared.is_ok(), values.is_some(), "undo {}: {:?}", number, prepared);
            if let Some(values) = values {
                let of = reference.task_of(&values[0].0);
                let new = hand.send(prepared);
                reference.waiting[of].push((None, new, Operation::Undo(values)));
            }
        }
        5 => change(hand, reference, action)?,
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

/// Asks for another configuration, of the node and of the reference.
fn change(
    hand: &mut Hand,
    reference: &mut Reference,
    action: &Action,
) -> Result<(), TestCaseError> {
    let choices = edited(&hand.choices, &action.edits);
    let entries = Rc::new(entries(choices.clone()));
    let text = configuration_with(&entries, PUBLISHED);
    let plan = plan(&text)?;
    let prepared = hand.operator.change(Draft::new(&plan).unwrap(), Request::default());
    let may_change = hand.operator.changing().is_none() && reference.may_change(&entries);
    prop_assert_eq!(prepared.is_ok(), may_change, "{:?}\n{}\n{}", prepared, hand.text, text);
    let Ok(mut prepared) = prepared else { return Ok(()) };
    if action.cycles.is_some() {
        prepared.replacements_mut().for_each(Replacement::rehearse);
    }
    let at = [0, 1].map(|task| hand.next[task] + action.ahead.unwrap_or(1 - task as u64 % 2));
    let (_, replacements) = hand.operator.send_change(prepared, &at).unwrap();
    let signals = Rc::new(Signals::of(&plan));
    for (task, replacement) in replacements.into_iter().enumerate() {
        hand.replacements[task] = Some((replacement, signals.clone()));
    }
    reference.change(entries, at);
    (hand.text, hand.choices) = (text, choices);
    hand.is_entered = [0, 1].map(|task| hand.is_entered[task] || is_entered(&plan)[task]);
    Ok(())
}

/// Asks for all values of a task whose names are known.
fn read(hand: &mut Hand, reference: &Reference, task: usize) {
    let names: Vec<String> = reference.rows(task).iter().map(|row| row.name.clone()).collect();
    let known = names.iter().map(String::as_str);
    let known =
        known.filter(|name| hand.operator.signals().find(name).is_ok_and(|s| s.task == task));
    let prepared = hand.operator.get(known, 0, usize::MAX).map(|(prepared, _)| prepared);
    hand.send(prepared);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]
    #[test]
    fn a_node_that_is_operated_shows_what_a_table_of_names_and_values_shows(
        choices in prop::collection::vec(entry_choice(), PUBLISHED..8),
        actions in prop::collection::vec(action(), 1..60),
    ) {
        let entries = Rc::new(entries(choices.clone()));
        let text = configuration_with(&entries, PUBLISHED);
        let plan = plan(&text)?;
        let signals = Rc::new(Signals::of(&plan));
        let mut hand = Hand {
            operator: Operator::new(&plan, Feeds::Program),
            engines: TaskEngine::build(&plan).unwrap(),
            signals: [signals.clone(), signals],
            inboxes: [Inbox::new(99), Inbox::new(99)],
            next: [0; 2],
            past: vec![],
            replacements: [None, None],
            text,
            choices,
            is_entered: is_entered(&plan),
        };
        let mut reference = Reference::new(entries);
        let mut has_changed = false;
        for action in actions {
            let task = action.task;
            hand.begin(task);
            reference.hand_over(task, hand.next[task]);
            ask(&mut hand, &mut reference, &action)?;
            read(&mut hand, &reference, task);
            let values = hand.step(task);
            reference.step(task, hand.next[task]);
            for Row { name, .. } in reference.rows(task) {
                let (shown, expected) = (hand.shown(task, name), reference.now[name]);
                prop_assert_eq!(shown.to_bits(), expected.to_bits(), "{}: {} not {} in cycle {}\n{:?}\n{}",
                    name, shown, expected, hand.next[task], action, hand.text);
            }
            for (name, value) in values {
                let Row { pin_type, .. } = reference.rows(task).iter().find(|row| row.name == name).unwrap();
                let expected = Value::of(reference.now[&name], *pin_type);
                prop_assert_eq!(format!("{}", value), format!("{expected}"), "{}", name);
            }
            let mut forced: Vec<String> = hand.operator.forces().filter(|f| f.task == task && f.since.is_some()).map(|f| f.name.clone()).collect();
            let mut expected: Vec<String> = reference.forces.keys().filter(|name| reference.task_of(name) == task).cloned().collect();
            forced.sort();
            expected.sort();
            prop_assert_eq!(forced, expected);
            has_changed |= hand.operator.changing().is_some();
            if !has_changed {
                let is_flagged = hand.engines[task].output_flags(0).contains(Flags::FORCED);
                prop_assert_eq!(is_flagged, reference.frame_is_touched(task, PUBLISHED), "{:?}\n{}", action, hand.text);
            }
            // What the cycle left is handed over in its slack, before the other task steps.
            reference.hand_over(task, hand.next[task] + 1);
            hand.next[task] += 1 + action.skipped;
        }
        hand.replay(&plan, has_changed)?;
        if hand.operator.changing().is_some() {
            return Ok(());
        }
        let saved = hand.operator.save(&hand.text).unwrap();
        let plan = self::plan(&saved)?;
        let engines = TaskEngine::build(&plan).unwrap();
        let rows = (0..2).flat_map(|task| reference.rows(task));
        for Row { name, .. } in rows.filter(|row| row.kind == Kind::Parameter) {
            let signal = hand.operator.signals().find(name).unwrap();
            let constant = engines[signal.task].image()[signal.slot];
            let given = reference.given[name];
            prop_assert_eq!(constant.to_bits(), given.to_bits(), "{}\n{}", name, saved);
        }
    }
}
