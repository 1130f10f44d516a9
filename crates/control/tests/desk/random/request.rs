//! Requests to the node, and the same to the reference.

use std::rc::Rc;

use isochrone_blocks::PinType;
use isochrone_control::desk::{Draft, RequestTerms, Selection, Signals};
use isochrone_engine::orders::Replacement;
use isochrone_model::{Hold, Value};
use proptest::prelude::*;

use crate::random::PUBLISHED;
use crate::random::action::{Action, chosen, edited};
use crate::random::node::{Hand, is_entered, plan};
use crate::random::table::{Kind, Operation, Reference};
use isochrone_testing::graphs::{INPUTS, PERIODS_NS, configuration_with, entries};

/// Asks for something, of the node and of the reference.
pub(crate) fn ask(
    hand: &mut Hand,
    reference: &mut Reference,
    action: &Action,
) -> Result<(), TestCaseError> {
    let task = action.task;
    let at = action.ahead.map(|ahead| hand.next[task] + ahead);
    let request = RequestTerms { at: at.map(Into::into), ..RequestTerms::default() };
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
            let forced = reference.forced_or_about_to_be(task);
            let which = usize::from(action.choices[0].0);
            let Some(name) = forced.get(which % forced.len().max(1)).cloned() else {
                return Ok(());
            };
            let number =
                hand.send(hand.operator.release([name.as_str()], Vec::new(), request, &hand.next));
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
            let prepared = hand.operator.undo(number, RequestTerms::default(), &hand.next);
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
    let prepared = hand.operator.change(Draft::new(&plan).unwrap(), RequestTerms::default());
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
pub(crate) fn read(hand: &mut Hand, reference: &Reference, task: usize) {
    let names: Vec<String> = reference.rows(task).iter().map(|row| row.name.clone()).collect();
    let known = names.iter().map(String::as_str);
    let known =
        known.filter(|name| hand.operator.signals().find(name).is_ok_and(|s| s.task == task));
    let selection = Selection::of(hand.operator.signals(), known, 0, usize::MAX);
    let prepared = selection.map(|found| hand.operator.read(found.with_quality()));
    hand.send(prepared);
}
