//! Sets that are taken back.

use isochrone_control::desk::*;
use isochrone_model::*;

use crate::hand::Hand;
use crate::level::{NODE, messages};

#[test]
fn a_set_is_taken_back_whole_and_only_while_nothing_else_has_changed_it() {
    let mut hand = Hand::new(NODE);
    let undo =
        |hand: &Hand, number| hand.operator.undo(number, RequestTerms::default(), &hand.next);
    let first = hand.set([("free.value", 1.0.into()), ("free.setChangeRate", 2.0.into())]);
    let still_to_come =
        |number| [format!("transaction {number} is still to come; ask again when it has")];
    assert_eq!(messages(undo(&hand, first)), still_to_come(first));
    hand.step(1);
    let second = hand.set([("free.value", 3.0.into())]);
    assert_eq!(undo(&hand, first).unwrap_err().code, Code::Conflict, "the second is on its way");
    hand.step(1);
    assert_eq!(undo(&hand, first).unwrap_err().code, Code::Conflict);
    let prepared = undo(&hand, second);
    let third = hand.send(prepared);
    hand.step(1);
    assert_eq!(hand.value("free.value"), 1.0);
    let prepared = undo(&hand, first);
    hand.send(prepared);
    hand.step(1);
    assert_eq!((hand.value("free.value"), hand.value("free.setChangeRate")), (25.0, 10.0));
    assert_eq!(undo(&hand, third).unwrap_err().code, Code::Conflict);
    assert_eq!(undo(&hand, 99).unwrap_err().code, Code::UnknownName);
    let last = hand.entries().pop().unwrap();
    assert_eq!((last.action, last.undone), (Action::Undo, Some(first)));
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
    let refused = messages(hand.operator.undo(both, RequestTerms::default(), &hand.next));
    let unknown = format!("there is no transaction {both} that set values and that is still known");
    assert!(refused.len() == 1 && refused[0].starts_with(&unknown), "{refused:?}");
}

#[test]
fn a_refused_undo_gives_the_reason_that_is_true() {
    let mut hand = Hand::new(NODE);
    let undo =
        |hand: &Hand, number| hand.operator.undo(number, RequestTerms::default(), &hand.next);
    let first = hand.set([("free.value", 1.0.into()), ("free.setChangeRate", 2.0.into())]);
    hand.step(1);
    let at = RequestTerms { at: Some(3.into()), ..RequestTerms::default() };
    let prepared = hand.operator.set([("free.value", 3.0)], at, &hand.next);
    let later = hand.send(prepared);
    let moving = format!(
        "transaction {later} is about to change \"free.value\"; undo {later} first, once it has been applied"
    );
    assert_eq!(messages(undo(&hand, first)), [moving]);
    let waiting = format!("transaction {later} is still to come; ask again when it has");
    assert_eq!(messages(undo(&hand, later)), [waiting]);
    (1..4).for_each(|_| hand.step(1));
    let prepared = undo(&hand, later);
    let of_later = hand.send(prepared);
    hand.step(1);
    let taken_back = format!(
        "transaction {later} is already undone, by transaction {of_later}; undo {of_later} to have its values \
         again"
    );
    assert_eq!(messages(undo(&hand, later)), [taken_back]);
    let prepared = undo(&hand, of_later);
    hand.send(prepared);
    hand.step(1);
    assert!(undo(&hand, later).is_ok(), "its undo was undone");
    let force = hand.force([("free.value", 1.0.into())], Hold::UntilReleased);
    hand.step(1);
    let no_set =
        format!("transaction {force} is a force, which cannot be undone; release what it forces");
    assert_eq!(messages(undo(&hand, force)), [no_set]);
}

#[test]
fn an_undo_can_be_taken_back_too() {
    let mut hand = Hand::new(NODE);
    let mut number = hand.set([("free.value", 1.0.into())]);
    hand.step(1);
    for expected in [25.0, 1.0, 25.0] {
        let prepared = hand.operator.undo(number, RequestTerms::default(), &hand.next);
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
    let Some(OrderOutcome::Applied(entry)) = hand.done.pop() else { panic!("it was applied") };
    assert_eq!(entry.changes[0].before, Value::CallingTask);
    let undo = hand.operator.undo(set, RequestTerms::default(), &hand.next);
    hand.send(undo);
    hand.step(0);
    assert!(hand.value("ramp.0.callOB").is_nan());
}
