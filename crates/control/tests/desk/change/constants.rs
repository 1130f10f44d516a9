//! Constants, limits and sets: what a change replaces, and what an undo still finds.

use isochrone_control::desk::*;
use isochrone_model::*;

use super::refused;
use crate::hand::{Hand, UNIX_NS};
use crate::level::RAMPS;

#[test]
fn a_constant_that_differs_between_the_files_replaces_what_was_set_and_no_other_does() {
    let mut hand = Hand::new(RAMPS);
    hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    hand.set([("ramp.1.value", 12.0.into())]);
    hand.steps(1);
    hand.entries();
    let summary = hand.change(&RAMPS.replace(
        "setChangeRate = 10.0 }\n\n[[block]]\nname = \"guard\"",
        "setChangeRate = 40.0 }\n\n[[block]]\nname = \"guard\"",
    ));
    assert_eq!(summary.changed, ["ramp.*.setChangeRate"]);
    hand.step(0);
    let entries = hand.entries();
    let [entry] = &entries[..] else { panic!("{entries:?}") };
    assert_eq!((entry.action, entry.cycle, entry.unix_ns), (Action::Apply, 1, UNIX_NS));
    let changes: Vec<_> =
        entry.changes.iter().map(|c| (c.name.as_str(), c.before, c.after)).collect();
    let now = Some(Value::Number(40.0));
    assert_eq!(
        changes,
        [
            ("ramp.0.setChangeRate", Value::Number(20.0), now),
            ("ramp.1.setChangeRate", Value::Number(10.0), now),
            ("ramp.2.setChangeRate", Value::Number(10.0), now),
        ]
    );
    assert!(entry.configuration.as_ref().unwrap().contains("setChangeRate = 40.0"));
    let applied = entry.applied.as_ref().unwrap();
    let counts =
        [&summary.added, &summary.removed, &summary.changed].map(|names| names.len() as u64);
    assert_eq!([applied.added, applied.removed, applied.changed], counts);
    assert_eq!(applied.limits, summary.limits);
    hand.step(1);
    assert_eq!((hand.value("ramp.0.delayedValue"), hand.value("ramp.1.value")), (6.0, 12.0));
}

#[test]
fn what_a_change_has_overtaken_cannot_be_taken_back_and_the_rest_can() {
    let mut hand = Hand::new(RAMPS);
    let rate = hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    let value = hand.set([("ramp.1.value", 12.0.into())]);
    let gone = hand.set([("ramp.2.value", 12.0.into())]);
    hand.steps(1);
    let text = RAMPS.replace("count = 3", "count = 2").replacen("Rate = 10.0", "Rate = 40.0", 1);
    hand.change(&text);
    hand.steps(1);
    let undo =
        |hand: &Hand, number| hand.operator.undo(number, RequestTerms::default(), &hand.next);
    let refused = undo(&hand, rate).unwrap_err();
    let was_changed = "\"ramp.0.setChangeRate\" was changed since transaction 1; ";
    assert!(refused.findings.len() == 1 && refused.message.starts_with(was_changed), "{refused}");
    let refused = undo(&hand, gone).unwrap_err();
    let is_gone = "\"ramp.2.value\", which transaction 3 set, is gone since; ";
    assert!(refused.findings.len() == 1 && refused.message.starts_with(is_gone), "{refused}");
    assert_eq!(refused.code, Code::Conflict);
    let journal: Vec<Entry> = hand.operator.journal(0).collect();
    let named = journal.iter().flat_map(|entry| &entry.changes).map(|change| change.name.as_str());
    assert!(named.clone().any(|name| name == "ramp.2.value"), "{journal:?}");
    hand.send(undo(&hand, value));
    hand.steps(1);
    assert_eq!(hand.value("ramp.1.value"), 25.0);
}

#[test]
fn a_value_that_a_change_has_put_out_of_bounds_does_not_come_back_by_an_undo() {
    let mut hand = Hand::new(RAMPS);
    hand.set([("ramp.0.setChangeRate", 40.0.into())]);
    hand.steps(1);
    let second = hand.set([("ramp.0.setChangeRate", 10.0.into())]);
    hand.steps(1);
    hand.change(&RAMPS.replace("[0.0, 50.0]", "[0.0, 20.0]"));
    hand.steps(1);
    let undo = hand.operator.undo(second, RequestTerms::default(), &hand.next);
    let refused = undo.unwrap_err();
    assert_eq!(refused.code, Code::WrongValue);
    assert!(refused.to_string().contains("40.0 is outside the limits"), "{refused}");
}

#[test]
fn a_change_of_the_configuration_cannot_be_undone_and_that_is_the_reason_given() {
    let mut hand = Hand::new(RAMPS);
    hand.change(&RAMPS.replace("count = 3", "count = 4"));
    hand.steps(1);
    let refused = hand.operator.undo(1, RequestTerms::default(), &hand.next).unwrap_err();
    let no_set = "transaction 1 is an apply, which cannot be undone; \
                  apply the configuration from before it to go back";
    assert_eq!(refused.message, no_set);
}

#[test]
fn limits_that_differ_are_told() {
    let mut hand = Hand::new(RAMPS);
    let text =
        RAMPS.replace("[0.0, 50.0]", "[0.0, 20.0]\n\"after.setChangeRate\" = [-1.0, 1000.0]");
    let summary = hand.change(&text);
    assert_eq!(
        summary.limits,
        [
            "ramp.*.setChangeRate: 0.0 to 50.0 -> 0.0 to 20.0",
            "after.setChangeRate: none -> -1.0 to 1000.0"
        ]
    );
    hand.steps(1);
    let summary = hand.change(RAMPS);
    assert_eq!(
        summary.limits,
        [
            "after.setChangeRate: -1.0 to 1000.0 -> none",
            "ramp.*.setChangeRate: 0.0 to 20.0 -> 0.0 to 50.0"
        ]
    );
}

#[test]
fn a_value_that_stays_must_lie_within_the_new_limits() {
    let mut hand = Hand::new(RAMPS);
    hand.set([("ramp.0.setChangeRate", 40.0.into())]);
    hand.steps(1);
    let findings = refused(&hand, &RAMPS.replace("[0.0, 50.0]", "[0.0, 30.0]"));
    assert_eq!(findings, ["40.0 is outside the limits of \"ramp.0.setChangeRate\", 0.0 to 30.0"]);
}
