//! What may be done while another configuration is on its way.

use isochrone_control::desk::*;
use isochrone_engine::Flags;
use isochrone_model::*;

use crate::hand::{Hand, draft};
use crate::level::RAMPS;

#[test]
fn a_force_goes_on_with_its_end_and_its_flag() {
    let mut hand = Hand::new(RAMPS);
    hand.force([("ramp.0.value", 2.0.into())], Hold::Seconds(0.5));
    hand.set([("ramp.0.value", 30.0.into())]);
    hand.steps(3);
    assert_eq!(hand.value("ramp.0.delayedValue"), 2.0);
    hand.change(&RAMPS.replace("count = 3", "count = 4"));
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.value"), 2.0);
    assert!(hand.engines[0].output_flags(0).contains(Flags::FORCED));
    let forced: Vec<_> = hand.operator.forces().map(|f| (f.name, f.until_cycle)).collect();
    assert_eq!(forced, [("ramp.0.value".into(), Some(5))]);
    hand.steps(1);
    let mut ended = Vec::new();
    hand.engines[0].expire(5, |end| ended.push(end));
    let entry = hand.operator.expired(0, ended.remove(0), 5, 0);
    assert_eq!(entry.changes[0].name, "ramp.0.value");
    assert_eq!(entry.changes[0].after, Some(Value::Number(30.0)));
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.value"), 30.0);
}

#[test]
fn one_configuration_at_a_time_is_on_its_way_and_values_are_read_meanwhile() {
    let mut hand = Hand::new(RAMPS);
    hand.set([("ramp.0.value", 1.0.into())]);
    let refused = hand.operator.change(draft(RAMPS), RequestTerms::default()).unwrap_err();
    assert_eq!(refused.message, "transaction 1 is still to come; ask again when it has");
    hand.steps(1);
    let early = hand.operator.change(draft(RAMPS), RequestTerms::default()).unwrap();
    hand.change(RAMPS);
    hand.step(0);
    let (names, next) = (hand.get(["ramp.0.value"], 0, 9), hand.next.clone());
    assert!(names.is_ok(), "values are read all the time");
    assert!(hand.operator.change(draft(RAMPS), RequestTerms::default()).is_err());
    hand.step(1);
    assert!(
        hand.operator.send_change(early, &next).is_err(),
        "it knows nothing of the one between"
    );
    hand.set([("ramp.0.value", 2.0.into())]);
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.value"), 2.0);
}

#[test]
fn a_reading_tells_how_many_values_a_change_took_from_it() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(1);
    let names = ["ramp.*.delayedValue", "after.delayedValue"];
    let ask = |hand: &mut Hand| {
        let prepared = hand.get(names, 0, 9).map(|(prepared, _)| prepared);
        hand.send(prepared);
        hand.done.clear();
    };
    let read = |hand: &Hand| -> Vec<_> {
        let read = hand.done.iter().filter_map(|done| match done {
            OrderOutcome::Read(reading) => Some((reading.task, reading.values.len(), reading.lost)),
            _ => None,
        });
        read.collect()
    };
    ask(&mut hand);
    hand.change(&RAMPS.replace("count = 3", "count = 2"));
    hand.steps(1);
    assert_eq!(read(&hand), [(0, 0, 3), (1, 0, 1)], "they were asked for before the change");
    hand.change(RAMPS);
    hand.steps(1);
    hand.change(&RAMPS.replace("count = 3", "count = 2"));
    hand.step(0);
    ask(&mut hand);
    hand.step(0);
    hand.step(1);
    assert_eq!(read(&hand), [(0, 2, 1), (1, 1, 0)], "the slow task goes by the old configuration");
    ask(&mut hand);
    hand.steps(1);
    assert_eq!(read(&hand), [(0, 2, 0), (1, 1, 0)]);
}

#[test]
fn values_are_set_and_forced_in_tasks_that_have_changed_and_in_those_that_have_not() {
    let mut hand = Hand::new(RAMPS);
    hand.force([("ramp.0.delayedValue", 9.0.into())], Hold::UntilReleased);
    hand.force([("after.delayedValue", 8.0.into())], Hold::UntilReleased);
    hand.steps(1);
    let text = RAMPS.replace("count = 3", "count = 4").replace(
        "name = \"after\"",
        "name = \"new\"\ntype = \"LimRateOfChangeCI\"\ntask = \"slow\"\n\n[[block]]\nname = \"after\"",
    );
    hand.change(&text);
    hand.step(0);
    assert!(hand.operator.changing().is_some(), "the slow task goes by the old configuration");
    let known = hand.operator.signals().clone();
    let is_forced = |hand: &Hand, name: &str| hand.operator.is_forced(&known.find(name).unwrap());
    assert!(is_forced(&hand, "ramp.0.delayedValue") && is_forced(&hand, "after.delayedValue"));
    // An instance that only the new configuration has, and one of each task.
    hand.set([("ramp.3.setChangeRate", 20.0.into()), ("after.setChangeRate", 3.0.into())]);
    hand.release("*.*.*");
    hand.release("after.delayedValue");
    hand.step(0);
    assert!(!is_forced(&hand, "ramp.0.delayedValue") && is_forced(&hand, "after.delayedValue"));
    assert_eq!(hand.operator.forces().count(), 1);
    // The slow task comes to its orders and to the new engine in one cycle.
    hand.step(1);
    assert_eq!(hand.operator.forces().count(), 0);
    assert_eq!(hand.value("after.setChangeRate"), 3.0);
    assert_eq!(hand.value("ramp.3.setChangeRate"), 20.0);
    let entries = hand.entries();
    let of_slow: Vec<Action> =
        entries.iter().filter(|e| e.task == "slow").map(|entry| entry.action).skip(1).collect();
    assert_eq!(of_slow, [Action::Apply, Action::Set, Action::Release]);
    hand.steps(1);
    assert_ne!(hand.value("after.delayedValue"), 8.0, "nothing holds it");
}

#[test]
fn a_force_that_comes_before_its_task_changes_goes_on_with_its_end_and_its_flag() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(1);
    let text = RAMPS.replace("count = 3", "count = 4");
    hand.change(&text);
    let replacement = hand.replacements[0].take();
    hand.force([("ramp.0.delayedValue", 9.0.into())], Hold::Seconds(0.3));
    hand.step(0);
    assert_eq!(hand.value("ramp.0.delayedValue"), 9.0);
    hand.replacements[0] = replacement;
    hand.step(0);
    hand.step(1);
    assert!(hand.operator.changing().is_none());
    assert_eq!(hand.value("ramp.0.delayedValue"), 9.0);
    assert!(hand.engines[0].output_flags(0).contains(Flags::FORCED));
    hand.step(0);
    assert_eq!(hand.value("ramp.0.delayedValue"), 9.0);
    hand.step(0);
    assert_ne!(hand.value("ramp.0.delayedValue"), 9.0, "its 300 ms are over");
    assert!(hand.engines[0].output_flags(0).is_empty());
    assert_eq!(hand.operator.forces().count(), 0);
}

#[test]
fn a_release_of_nothing_does_not_hold_up_a_change_that_was_prepared() {
    let mut hand = Hand::new(RAMPS);
    let more = draft(&RAMPS.replace("count = 3", "count = 4"));
    let change = hand.operator.change(more, RequestTerms::default()).unwrap();
    hand.release("ramp.*.value");
    assert!(hand.operator.send_change(change, &hand.next).is_ok());
}

#[test]
fn a_force_that_comes_too_late_after_a_change_is_forgotten() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(1);
    // Its slots come before those of `ramp`.
    hand.change(&RAMPS.replace(
        "[[block]]\nname = \"ramp\"",
        "[[block]]\nname = \"fresh\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
         in = { value = 25.0, setChangeRate = 10.0 }\n[[block]]\nname = \"ramp\"",
    ));
    let request = RequestTerms { at: Some(1.into()), ..RequestTerms::default() };
    let values = [("ramp.0.delayedValue", 9.0)];
    let prepared = hand.operator.force(values, Hold::UntilReleased, request, &hand.next).unwrap();
    let (transaction, orders) = hand.operator.send(prepared);
    hand.steps(1);
    assert!(hand.operator.changing().is_none());
    for (task, order) in orders {
        hand.inboxes[task].take(order).unwrap();
    }
    hand.step(0);
    assert!(hand.done.contains(&OrderOutcome::TooLate { transaction }), "{:?}", hand.done);
    assert_eq!(hand.operator.forces().count(), 0);
}

#[test]
fn what_is_on_its_way_out_or_is_given_a_value_by_the_change_waits_for_it() {
    let mut hand = Hand::new(RAMPS);
    let set = hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    hand.steps(1);
    let text = RAMPS.replace("count = 3", "count = 2").replacen("Rate = 10.0", "Rate = 40.0", 1);
    hand.change(&text.replace("[0.0, 50.0]", "[0.0, 45.0]\n\"ramp.*.value\" = [0.0, 30.0]"));
    let refused = |hand: &Hand, name: &str, value: f64| {
        let values = [(name, value)];
        hand.operator.set(values, RequestTerms::default(), &hand.next).unwrap_err()
    };
    for name in ["ramp.2.value", "ramp.0.setChangeRate"] {
        let refused = refused(&hand, name, 1.0);
        assert!(refused.message.contains("changes the configuration at this moment"), "{refused}");
        assert_eq!((refused.code, refused.findings.len()), (Code::Busy, 1));
    }
    let values = [("ramp.2.value", 1.0)];
    let forced =
        hand.operator.force(values, Hold::UntilReleased, RequestTerms::default(), &hand.next);
    assert_eq!(forced.unwrap_err().code, Code::Busy);
    let undone = hand.operator.undo(set, RequestTerms::default(), &hand.next);
    assert_eq!(undone.unwrap_err().code, Code::Busy);
    // The value would be outside of the limits that come.
    assert_eq!(refused(&hand, "ramp.0.value", 31.0).code, Code::WrongValue);
    hand.set([("ramp.0.value", 29.0.into())]);
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.value"), 29.0);
    assert_eq!(refused(&hand, "ramp.2.value", 1.0).code, Code::UnknownName);
}
