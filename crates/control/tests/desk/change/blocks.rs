//! Blocks that stay, come, go and move to another task.

use crate::hand::Hand;
use crate::level::RAMPS;

#[test]
fn a_kept_block_goes_on_where_it_was_and_a_new_one_starts_from_rest() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(5);
    assert_eq!(hand.value("ramp.0.delayedValue"), 5.0);
    let fresh = RAMPS.replace(
        "[[block]]\nname = \"guard\"",
        "[[block]]\nname = \"fresh\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
         in = { value = 25.0, setChangeRate = 10.0 }\n[[block]]\nname = \"guard\"",
    );
    let summary = hand.change(&fresh);
    assert_eq!(summary.added, ["fresh"]);
    assert_eq!(summary.kept, ["after", "guard", "ramp"]);
    assert!(summary.removed.is_empty() && summary.changed.is_empty(), "{summary:?}");
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.delayedValue"), 6.0);
    assert_eq!(hand.value("fresh.delayedValue"), 1.0);
}

#[test]
fn instances_come_and_go_with_the_count() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(5);
    let summary = hand.change(&RAMPS.replace("count = 3", "count = 5"));
    assert_eq!(summary.added, ["ramp.3 to ramp.4"]);
    assert_eq!(summary.kept, ["after", "guard", "ramp.0 to ramp.2"]);
    hand.steps(1);
    assert_eq!((hand.value("ramp.2.delayedValue"), hand.value("ramp.4.delayedValue")), (6.0, 1.0));
    let summary = hand.change(&RAMPS.replace("count = 3", "count = 2"));
    assert_eq!(summary.removed, ["ramp.2 to ramp.4"]);
    hand.steps(1);
    assert_eq!(hand.value("ramp.1.delayedValue"), 7.0);
    assert!(hand.operator.signals().find("ramp.2.delayedValue").is_err());
}

#[test]
fn a_block_of_another_type_or_task_starts_from_rest_under_its_old_name() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(5);
    let moved = RAMPS.replace("task = \"slow\"\nin = { value", "task = \"fast\"\nin = { value");
    let summary = hand.change(&moved);
    assert_eq!((summary.added, summary.removed), (vec!["after".into()], vec!["after".into()]));
    hand.steps(1);
    assert_eq!(hand.value("after.delayedValue"), 6.0, "at 1000 a second it is where its value is");
}

#[test]
fn a_task_that_changes_first_finds_the_last_value_of_the_other_and_gives_its_own() {
    let mut hand = Hand::new(RAMPS);
    hand.steps(5);
    let text = RAMPS.replace("setChangeRate = 1000.0", "setChangeRate = 500.0");
    hand.change(&text);
    // The slow one is first: the other has not handed anything over.
    hand.step(1);
    assert_eq!(hand.value("after.value"), 5.0);
    hand.step(0);
    hand.step(1);
    assert_eq!(hand.value("after.value"), 6.0);
    hand.change(RAMPS);
    // The fast one has its new engine; the slow one reads what it has handed over.
    let mut handed = hand.replacements[0].take().unwrap();
    hand.engines[0].hand_over(&mut handed);
    hand.step(1);
    assert_eq!(hand.value("after.value"), 6.0);
    assert!(hand.engines[1].output_flags(0).is_empty(), "{:?}", hand.engines[1].output_flags(0));
}

#[test]
fn what_an_input_is_worth_and_the_errors_of_blocks_go_on() {
    let text = RAMPS
        .replace("value = 25.0, setChangeRate = 10.0", "value = \"raw\", setChangeRate = 10.0");
    let mut hand = Hand::new(&text);
    assert!(hand.engines[0].set_input(0, 8.0, 77));
    hand.set([("ramp.1.callOB", 36.0.into())]);
    hand.steps(2);
    let errors = hand.engines[0].block_errors();
    assert!(errors > 0, "there is no OB of this number");
    hand.change(&text.replace("count = 3", "count = 4"));
    hand.steps(1);
    assert_eq!(hand.engines[0].output_source_ns(0), 77);
    assert_eq!(hand.engines[1].output_source_ns(0), 77);
    assert_eq!((hand.value("raw"), hand.value("raw.ok")), (8.0, 1.0));
    assert!(hand.engines[0].block_errors() > errors);
}
