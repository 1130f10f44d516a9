//! Sets that are taken back.

use isochrone_engine::operate::*;

use crate::operate::hand::Hand;
use crate::operate::level::{NODE, refusals};

#[test]
fn a_set_is_taken_back_whole_and_only_while_nothing_else_has_changed_it() {
    let mut hand = Hand::new(NODE);
    let undo = |hand: &Hand, number| hand.operator.undo(number, Request::default(), &hand.next);
    let first = hand.set([("free.value", 1.0.into()), ("free.setChangeRate", 2.0.into())]);
    assert!(
        matches!(refusals(undo(&hand, first))[..], [Refusal::Waiting { .. }]),
        "it is on its way"
    );
    hand.step(1);
    let second = hand.set([("free.value", 3.0.into())]);
    assert_eq!(
        undo(&hand, first).unwrap_err().kind(),
        RefusalKind::Conflict,
        "the second is on its way"
    );
    hand.step(1);
    assert_eq!(undo(&hand, first).unwrap_err().kind(), RefusalKind::Conflict);
    let prepared = undo(&hand, second);
    let third = hand.send(prepared);
    hand.step(1);
    assert_eq!(hand.value("free.value"), 1.0);
    let prepared = undo(&hand, first);
    hand.send(prepared);
    hand.step(1);
    assert_eq!((hand.value("free.value"), hand.value("free.setChangeRate")), (25.0, 10.0));
    assert_eq!(undo(&hand, third).unwrap_err().kind(), RefusalKind::Conflict);
    assert_eq!(undo(&hand, 99).unwrap_err().kind(), RefusalKind::UnknownName);
    let last = hand.entries().pop().unwrap();
    assert_eq!(last.action, Action::Undo { of: first });
}

#[test]
fn a_set_of_which_the_journal_has_dropped_a_part_is_not_taken_back_by_half() {
    let mut hand = Hand::new(NODE);
    let both = hand.set([("ramp.0.setChangeRate", 1.0.into()), ("free.value", 1.0.into())]);
    hand.step(0);
    hand.step(1);
    for other in 0..9_999 {
        hand.set([("scale.x1", f64::from(other).into())]);
        hand.step(0);
    }
    let known = |entry: &Entry| entry.transaction == both;
    assert_eq!(hand.operator.journal(0).filter(known).count(), 1, "one part is dropped");
    let refused = refusals(hand.operator.undo(both, Request::default(), &hand.next));
    assert_eq!(refused, [Refusal::UnknownTransaction { transaction: both }]);
}

#[test]
fn a_refused_undo_gives_the_reason_that_is_true() {
    let mut hand = Hand::new(NODE);
    let undo = |hand: &Hand, number| hand.operator.undo(number, Request::default(), &hand.next);
    let first = hand.set([("free.value", 1.0.into()), ("free.setChangeRate", 2.0.into())]);
    hand.step(1);
    let at = Request { at: Some(3), ..Request::default() };
    let prepared = hand.operator.set([("free.value", 3.0.into())], at, &hand.next);
    let later = hand.send(prepared);
    let name = "free.value".to_owned();
    assert_eq!(refusals(undo(&hand, first)), [Refusal::Moving { name, by: later }]);
    assert_eq!(refusals(undo(&hand, later)), [Refusal::Waiting { transaction: later }]);
    (1..4).for_each(|_| hand.step(1));
    let prepared = undo(&hand, later);
    let of_later = hand.send(prepared);
    hand.step(1);
    let taken_back = format!("transaction {later} is already undone, by transaction {of_later}");
    let refused = refusals(undo(&hand, later));
    assert_eq!(refused, [Refusal::TakenBack { transaction: later, by: of_later }]);
    assert_eq!(refused[0].to_string(), taken_back);
    let prepared = undo(&hand, of_later);
    hand.send(prepared);
    hand.step(1);
    assert!(undo(&hand, later).is_ok(), "its undo was undone");
    let force = hand.force([("free.value", 1.0.into())], Hold::UntilReleased);
    hand.step(1);
    let refused = refusals(undo(&hand, force));
    assert_eq!(refused, [Refusal::NoSet { transaction: force, action: "force" }]);
}

#[test]
fn an_undo_can_be_taken_back_too() {
    let mut hand = Hand::new(NODE);
    let mut number = hand.set([("free.value", 1.0.into())]);
    hand.step(1);
    for expected in [25.0, 1.0, 25.0] {
        let prepared = hand.operator.undo(number, Request::default(), &hand.next);
        number = hand.send(prepared);
        hand.step(1);
        assert_eq!(hand.value("free.value"), expected);
    }
}

#[test]
fn a_pin_that_nothing_was_given_means_the_calling_task_and_does_again_after_an_undo() {
    let mut hand = Hand::new(NODE);
    let set = hand.set([("ramp.0.callOB", 35.into())]);
    hand.step(0);
    let Some(Done::Applied(entry)) = hand.done.pop() else { panic!("it was applied") };
    assert_eq!(entry.changes[0].before, Value::CallingTask);
    let undo = hand.operator.undo(set, Request::default(), &hand.next);
    hand.send(undo);
    hand.step(0);
    assert!(hand.value("ramp.0.callOB").is_nan());
}
