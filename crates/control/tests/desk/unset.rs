//! Pins that can be without a value: what sets them back, and what becomes of that.

use isochrone_control::desk::*;
use isochrone_engine::TaskEngine;
use isochrone_model::*;

use crate::hand::{Hand, plan};

const NODE: &str = r#"
[node]
name = "level"

[limits]
"ramp.*.callOB" = [1, 40]

[[task]]
name = "fast"
period = "100ms"
ob = 35

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
count = 2
in.setChangeRate = 10.0
in.callOB = 35      # counts with the period of "fast"

[[block]]
name = "free"
type = "LimRateOfChangeCI"
in.setChangeRate = 10.0

[[block]]
name = "beat"
type = "SawTooth"
"#;

fn unset() -> Value {
    Value::from(f64::NAN)
}

/// Sets pins of a node that has just started.
fn after_setting<'n>(values: impl IntoIterator<Item = (&'n str, Value)>) -> Hand {
    let mut hand = Hand::new(NODE);
    for value in values {
        hand.set([value]);
        hand.step(0);
    }
    hand
}

#[test]
fn a_pin_that_can_be_without_a_value_is_set_back_whatever_its_limits_are() {
    let given = after_setting([("free.callOB", 35.into())]);
    assert_eq!(given.value("free.callOB"), 35.0);
    assert!(given.operator.has_changed());
    let back = after_setting([
        ("free.callOB", 35.into()),
        ("free.callOB", unset()),
        ("ramp.0.callOB", unset()),
    ]);
    assert!(back.value("free.callOB").is_nan() && back.value("ramp.0.callOB").is_nan());
}

#[test]
fn a_task_without_a_number_is_given_by_its_period_and_saved_by_its_name() {
    let slow = "[[task]]\nname = \"slow\"\nperiod = \"300ms\"\n\n[[block]]\nname = \"ramp\"";
    let node = NODE
        .replace("type = \"LimRateOfChangeCI\"", "type = \"LimRateOfChangeCI\"\ntask = \"fast\"")
        .replace("type = \"SawTooth\"", "type = \"SawTooth\"\ntask = \"fast\"")
        .replace("[[block]]\nname = \"ramp\"", slow);
    let period = |period_ns| Value::Task { period_ns };
    let mut hand = Hand::new(&node);
    // It is no number, so limits of numbers do not bound it.
    hand.set([("ramp.0.callOB", period(300_000_000)), ("free.callOB", period(300_000_000))]);
    hand.step(0);
    let saved = hand.operator.save(&node).unwrap();
    let again = Hand::new(&saved);
    for pin in ["ramp.0.callOB", "free.callOB"] {
        assert_eq!(again.value(pin), hand.value(pin), "{pin} of {saved}");
    }
    assert!(saved.contains("callOB = \"slow\""), "{saved}");
    for (name, period_ns) in [("free.callOB", 7), ("beat.numberSteps", 300_000_000)] {
        let refused =
            hand.operator.set([(name, period(period_ns))], RequestTerms::default(), &hand.next);
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains("is no INT"), "{name}: {refused}");
    }
}

#[test]
fn what_was_set_back_to_what_is_configured_is_no_change() {
    let hand = after_setting([("free.callOB", 35.into()), ("free.callOB", unset())]);
    assert!(!hand.operator.has_changed());
    assert_eq!(hand.operator.save(NODE).unwrap(), NODE);
}

#[test]
fn no_other_pin_takes_nan() {
    let hand = Hand::new(NODE);
    for name in
        ["free.setChangeRate", "free.enDefaultOutValue", "beat.timeRange", "beat.incrementRange"]
    {
        let refused = hand.operator.set([(name, unset())], RequestTerms::default(), &hand.next);
        let refused = refused.unwrap_err().to_string();
        assert!(refused.contains("NaN"), "{name}: {refused}");
    }
}

#[test]
fn a_pin_set_back_is_saved_so_that_the_file_gives_it_no_value() {
    let hand = after_setting([("ramp.0.callOB", unset()), ("free.callOB", 35.into())]);
    let saved = hand.operator.save(NODE).unwrap();
    assert!(saved.contains("in.callOB = 35      # counts"), "the others keep theirs: {saved}");
    let again = Hand::new(&saved);
    for pin in ["ramp.0.callOB", "ramp.1.callOB", "free.callOB"] {
        let bits = |hand: &Hand| hand.value(pin).to_bits();
        assert_eq!(bits(&again), bits(&hand), "{pin} of {saved}");
    }
    let both = after_setting([("ramp.0.callOB", unset()), ("ramp.1.callOB", unset())]);
    let again = Hand::new(&both.operator.save(NODE).unwrap());
    assert!(again.value("ramp.0.callOB").is_nan() && again.value("ramp.1.callOB").is_nan());
}

#[test]
fn what_the_journal_tells_of_a_pin_set_back_is_done_again() {
    let hand = after_setting([("free.callOB", 35.into()), ("free.callOB", unset())]);
    let plan = plan(NODE);
    let mut replay = Replay::new(&plan);
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let slot = hand.operator.signals().find("free.callOB").unwrap().slot;
    let mut values = Vec::new();
    for cycle in 0..2 {
        for entry in hand.operator.journal(0).filter(|entry| entry.cycle == cycle) {
            assert_eq!(replay.apply(&entry, &mut engine).unwrap(), []);
        }
        engine.step(cycle);
        values.push(engine.image()[slot]);
    }
    assert!(values[0] == 35.0 && values[1].is_nan(), "{values:?}");
}
