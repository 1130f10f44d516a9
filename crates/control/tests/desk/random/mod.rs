//! Random requests and changes of the configuration on random nodes, against a naive reference.

mod action;
mod node;
mod request;
mod table;

use std::rc::Rc;

use action::action;
use isochrone_control::desk::{Feeds, Operator, Signals};
use isochrone_engine::orders::Inbox;
use isochrone_engine::{Flags, TaskEngine};
use isochrone_model::Value;
use isochrone_testing::graphs::{configuration_with, entries, entry_choice};
use node::{Hand, is_entered, plan};
use proptest::prelude::*;
use request::{ask, read};
use table::{Kind, Reference, Row};

/// The first entries, whose pins are published, keep their names, types and tasks.
const PUBLISHED: usize = 2;

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
            let mut forced: Vec<String> = hand.operator.forces().map(|force| force.name).filter(|name| reference.task_of(name) == task).collect();
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
        let plan = node::plan(&saved)?;
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
