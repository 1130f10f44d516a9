//! What was done and what waits, told by the journal, and done again from it.

use isochrone_control::desk::*;
use isochrone_engine::TaskEngine;
use isochrone_model::*;

use crate::hand::{Hand, plan};
use crate::level::{NODE, messages};

#[test]
fn what_waits_for_its_cycle_is_told_until_it_has_come() {
    let mut hand = Hand::new(NODE);
    let by = AskedBy { comment: Some("later".into()), ..AskedBy::default() };
    let request = RequestTerms { at: Some(2.into()), by, ..RequestTerms::default() };
    let values = [("free.value", 3.0), ("free.setChangeRate", 2.0)];
    let prepared = hand.operator.set(values, request.clone(), &hand.next);
    let set = hand.send(prepared);
    let hold = Hold::Seconds(2.0);
    let prepared = hand.operator.force([("free.value", 9.0)], hold, request, &hand.next);
    let force = hand.send(prepared);
    let told = |hand: &Hand| -> Vec<_> {
        let pending = hand.operator.pending();
        pending.map(|one| (one.transaction, one.action, one.task, one.cycle, one.names)).collect()
    };
    let name = |name: &str| name.to_owned();
    assert_eq!(
        told(&hand),
        [
            (
                set,
                Action::Set,
                name("slow"),
                2,
                vec![name("free.setChangeRate"), name("free.value")]
            ),
            (force, Action::Force, name("slow"), 2, vec![name("free.value")]),
        ]
    );
    (0..3).for_each(|_| hand.step(1));
    assert_eq!(told(&hand), []);
}

#[test]
fn what_names_no_cycle_waits_with_its_new_values_for_the_next_of_each_task() {
    let mut hand = Hand::new(NODE);
    hand.steps(2);
    hand.set([("free.value", 3.0.into())]);
    hand.force([("free.setChangeRate", 4.0.into())], Hold::UntilReleased);
    let told = |hand: &Hand| -> Vec<_> {
        let pending = hand.operator.pending();
        pending.map(|one| (one.action, one.cycle, one.names, one.values.0)).collect()
    };
    let names = |name: &str| vec![name.to_owned()];
    assert_eq!(
        told(&hand),
        [
            (Action::Set, 2, names("free.value"), vec![("free.value".into(), 3.0.into())]),
            (
                Action::Force,
                2,
                names("free.setChangeRate"),
                vec![("free.setChangeRate".into(), 4.0.into())],
            ),
        ]
    );
    hand.step(1);
    assert_eq!(told(&hand), []);
    hand.release("free.setChangeRate");
    assert_eq!(told(&hand), [(Action::Release, 3, names("free.setChangeRate"), vec![])]);
    hand.step(1);
    assert_eq!(told(&hand), []);
}

#[test]
fn the_journal_tells_what_was_done_in_order_by_whom_and_why() {
    let mut hand = Hand::new(NODE);
    let by =
        AskedBy { client: Some("anna".into()), process: Some(7), comment: Some("test".into()) };
    let request = RequestTerms { at: None, by: by.clone(), is_remote: true };
    let prepared = hand.operator.set([("free.value", 1.0)], request, &hand.next);
    hand.send(prepared);
    hand.force([("free.value", 2.0.into())], Hold::Seconds(1.0));
    hand.step(1);
    hand.step(1);
    let entries: Vec<Entry> = hand.operator.journal(0).collect();
    let actions: Vec<_> =
        entries.iter().map(|e| (e.sequence, e.action.as_str(), e.cycle)).collect();
    assert_eq!(actions, [(1, "set", 0), (2, "force", 0), (3, "expiry", 1)]);
    assert_eq!(entries[0].by, by);
    assert_eq!(hand.operator.journal(3).count(), 1);
}

fn bits(image: &[f64]) -> Vec<u64> {
    image.iter().map(|slot| slot.to_bits()).collect()
}

#[test]
fn what_the_journal_tells_can_be_done_again_and_what_was_different_is_told() {
    let mut hand = Hand::new(NODE);
    hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    hand.step(0);
    hand.force([("scale.y", 7.0.into()), ("raw", 4.into())], Hold::Seconds(0.2));
    hand.step(0);
    hand.release("raw");
    hand.step(0);
    hand.step(0);
    let plan = plan(NODE);
    let (mut replay, mut engine) =
        (Replay::new(&plan), TaskEngine::build(&plan).unwrap().remove(0));
    let mut differences = Vec::new();
    for cycle in 0..4 {
        engine.expire(cycle, drop);
        for entry in hand.operator.journal(0).filter(|entry| entry.cycle == cycle) {
            differences.extend(replay.apply(&entry, &mut engine).unwrap());
        }
        // The first cycle had another sample.
        engine.set_input(0, if cycle == 0 { 5.0 } else { 3.0 }, 1);
        engine.step(cycle);
    }
    let scaled = hand.operator.signals().find("scale.x").unwrap().slot;
    assert_eq!(bits(&engine.image()[scaled..]), bits(&hand.engines[0].image()[scaled..]));
    let told: Vec<String> = differences.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "\"raw\" was 3 before the change, and is 5 here",
            "\"scale.y\" was 3.0 before the change, and is 5.0 here"
        ]
    );
}

#[test]
fn an_entry_of_another_node_is_refused_with_all_that_does_not_fit() {
    let plan = plan(NODE);
    let change = |name: &str, after: Value| {
        let (name, before) = (name.to_owned(), Value::Number(0.0));
        Change { name, before, after: Some(after), value_type: None }
    };
    let entry = Entry {
        sequence: 1,
        transaction: 1,
        action: Action::Set,
        task: "fast".into(),
        cycle: 3,
        unix_ns: 0,
        until_cycle: None,
        undone: None,
        changes: vec![
            change("rampp.0.setChangeRate", 1.0.into()),
            change("free.setChangeRate", 1.0.into()),
            change("guard.setChangeRate", true.into()),
        ],
        left_out: 0,
        by: AskedBy::default(),
        configuration: None,
        applied: None,
    };
    let refused = Replay::new(&plan).check(&entry).unwrap_err();
    let told: Vec<String> =
        refused.findings.iter().map(|finding| finding.help.clone().unwrap()).collect();
    assert_eq!(told.len(), 3, "{refused}");
    assert!(told[0].contains("ramp"), "{told:?}");
    assert_eq!(told[1..], ["it is a signal of task \"slow\"", "write a number"]);
}

#[test]
fn nothing_is_changed_while_the_journal_cannot_be_written_but_a_force_can_be_released() {
    let mut hand = Hand::new(NODE);
    hand.operator.continue_after(40);
    assert_eq!(hand.force([("ramp.0.value", 9.0.into())], Hold::UntilReleased), 41);
    hand.steps(1);
    assert_eq!(hand.set([("ramp.0.setChangeRate", 20.0.into())]), 42);
    let unwritten = "the journal j cannot be written (disk full)";
    hand.operator.set_unwritten(Some(Unwritten::ForNow(unwritten.into())));
    let set = [("ramp.0.setChangeRate", 30.0.into())];
    let refused = hand.operator.set(set, RequestTerms::default(), &hand.next).unwrap_err();
    assert_eq!(refused.code, Code::Forbidden);
    let told = "nothing can be changed while the journal j cannot be written (disk full)";
    assert_eq!(refused.findings[0].message, told);
    let force =
        hand.operator.force([("raw", 1)], Hold::UntilReleased, RequestTerms::default(), &[0, 0]);
    assert!(messages(force)[0].starts_with(told));
    assert!(hand.get(["raw"], 0, 1).is_ok());
    assert_eq!(hand.release("ramp.*.value"), 43);
    hand.steps(1);
    assert_eq!(hand.operator.forces().count(), 0);
    hand.operator.set_unwritten(Some(Unwritten::ForGood(unwritten.into())));
    let refused = hand.operator.set(set, RequestTerms::default(), &hand.next).unwrap_err();
    assert!(
        refused.findings[0].help.as_ref().unwrap().starts_with("start the node again"),
        "{refused}"
    );
    hand.operator.set_unwritten(None);
    assert_eq!(hand.set(set), 44);
}
