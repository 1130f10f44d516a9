//! Another configuration for a node that runs.

mod hand;

use hand::{Hand, UNIX_NS, draft};
use isochrone_engine::Flags;
use isochrone_engine::operate::*;

const NODE: &str = r#"
[node]
name = "level"
control = "force"

[[protect]]
names = ["guard.*"]

[limits]
"ramp.*.setChangeRate" = [0.0, 50.0]

[[task]]
name = "fast"
period = "100ms"

[[task]]
name = "slow"
period = "1s"

[[input]]
name = "raw"
service = "plant/raw"
task = "fast"
default = 3.0

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 3
in = { value = 25.0, setChangeRate = 10.0 }

[[block]]
name = "guard"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "raw", setChangeRate = 10.0 }

[[block]]
name = "after"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.0.delayedValue", setChangeRate = 1000.0 }

[[output]]
service = "plant/ramp"
task = "fast"
signals = ["ramp.0.delayedValue"]

[[output]]
service = "plant/after"
task = "slow"
signals = ["after.delayedValue"]
"#;

fn refused(hand: &Hand, text: &str) -> Vec<String> {
    let refusals = hand.operator.change(draft(text), Request::default()).unwrap_err();
    refusals.findings().iter().map(ToString::to_string).collect()
}

#[test]
fn a_kept_block_goes_on_where_it_was_and_a_new_one_starts_from_rest() {
    let mut hand = Hand::new(NODE);
    hand.steps(5);
    assert_eq!(hand.value("ramp.0.delayedValue"), 5.0);
    let fresh = NODE.replace(
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
    let mut hand = Hand::new(NODE);
    hand.steps(5);
    let summary = hand.change(&NODE.replace("count = 3", "count = 5"));
    assert_eq!(summary.added, ["ramp.3 to ramp.4"]);
    assert_eq!(summary.kept, ["after", "guard", "ramp.0 to ramp.2"]);
    hand.steps(1);
    assert_eq!((hand.value("ramp.2.delayedValue"), hand.value("ramp.4.delayedValue")), (6.0, 1.0));
    let summary = hand.change(&NODE.replace("count = 3", "count = 2"));
    assert_eq!(summary.removed, ["ramp.2 to ramp.4"]);
    hand.steps(1);
    assert_eq!(hand.value("ramp.1.delayedValue"), 7.0);
    assert!(hand.operator.signals().find("ramp.2.delayedValue").is_err());
}

#[test]
fn a_block_of_another_type_or_task_starts_from_rest_under_its_old_name() {
    let mut hand = Hand::new(NODE);
    hand.steps(5);
    let moved = NODE.replace("task = \"slow\"\nin = { value", "task = \"fast\"\nin = { value");
    let summary = hand.change(&moved);
    assert_eq!((summary.added, summary.removed), (vec!["after".into()], vec!["after".into()]));
    hand.steps(1);
    assert_eq!(hand.value("after.delayedValue"), 6.0, "at 1000 a second it is where its value is");
}

#[test]
fn a_constant_that_differs_between_the_files_replaces_what_was_set_and_no_other_does() {
    let mut hand = Hand::new(NODE);
    hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    hand.set([("ramp.1.value", 12.0.into())]);
    hand.steps(1);
    hand.entries();
    let summary = hand.change(&NODE.replace(
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
    let applied = entry.configuration.as_ref().unwrap();
    assert!(applied.text.contains("setChangeRate = 40.0"));
    assert_eq!(applied.summary, summary);
    hand.step(1);
    assert_eq!((hand.value("ramp.0.delayedValue"), hand.value("ramp.1.value")), (6.0, 12.0));
}

#[test]
fn what_a_change_has_overtaken_cannot_be_taken_back_and_the_rest_can() {
    let mut hand = Hand::new(NODE);
    let rate = hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    let value = hand.set([("ramp.1.value", 12.0.into())]);
    let gone = hand.set([("ramp.2.value", 12.0.into())]);
    hand.steps(1);
    let text = NODE.replace("count = 3", "count = 2").replacen("Rate = 10.0", "Rate = 40.0", 1);
    hand.change(&text);
    hand.steps(1);
    let undo = |hand: &Hand, number| hand.operator.undo(number, Request::default(), &hand.next);
    let refused = undo(&hand, rate).unwrap_err();
    assert!(matches!(refused.findings()[..], [Refusal::Conflict { .. }]), "{refused}");
    let refused = undo(&hand, gone).unwrap_err();
    assert!(matches!(refused.findings()[..], [Refusal::Gone { .. }]), "{refused}");
    assert_eq!(refused.kind(), RefusalKind::Conflict);
    let journal: Vec<Entry> = hand.operator.journal(0).collect();
    let named = journal.iter().flat_map(|entry| &entry.changes).map(|change| change.name.as_str());
    assert!(named.clone().any(|name| name == "ramp.2.value"), "{journal:?}");
    hand.send(undo(&hand, value));
    hand.steps(1);
    assert_eq!(hand.value("ramp.1.value"), 25.0);
}

#[test]
fn a_value_that_a_change_has_put_out_of_bounds_does_not_come_back_by_an_undo() {
    let mut hand = Hand::new(NODE);
    hand.set([("ramp.0.setChangeRate", 40.0.into())]);
    hand.steps(1);
    let second = hand.set([("ramp.0.setChangeRate", 10.0.into())]);
    hand.steps(1);
    hand.change(&NODE.replace("[0.0, 50.0]", "[0.0, 20.0]"));
    hand.steps(1);
    let undo = hand.operator.undo(second, Request::default(), &hand.next);
    let refused = undo.unwrap_err();
    assert_eq!(refused.kind(), RefusalKind::WrongValue);
    assert!(refused.to_string().contains("40.0 is outside the limits"), "{refused}");
}

#[test]
fn a_change_of_the_configuration_cannot_be_undone_and_that_is_the_reason_given() {
    let mut hand = Hand::new(NODE);
    hand.change(&NODE.replace("count = 3", "count = 4"));
    hand.steps(1);
    let refused = hand.operator.undo(1, Request::default(), &hand.next).unwrap_err();
    assert!(
        matches!(refused.findings()[..], [Refusal::NoSet { transaction: 1, action: "apply" }]),
        "{refused}"
    );
}

#[test]
fn a_force_goes_on_with_its_end_and_its_flag() {
    let mut hand = Hand::new(NODE);
    hand.force([("ramp.0.value", 2.0.into())], Hold::Seconds(0.5));
    hand.set([("ramp.0.value", 30.0.into())]);
    hand.steps(3);
    assert_eq!(hand.value("ramp.0.delayedValue"), 2.0);
    hand.change(&NODE.replace("count = 3", "count = 4"));
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.value"), 2.0);
    assert!(hand.engines[0].output_flags(0).contains(Flags::FORCED));
    let forced: Vec<_> = hand.operator.forces().map(|f| (f.name.clone(), f.until)).collect();
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
fn a_forced_signal_must_be_in_the_new_configuration() {
    let mut hand = Hand::new(NODE);
    hand.force([("ramp.2.delayedValue", 2.0.into())], Hold::UntilReleased);
    hand.steps(1);
    let text = NODE.replace("count = 3", "count = 2");
    assert_eq!(
        refused(&hand, &text),
        ["\"ramp.2.delayedValue\" is forced, and the new configuration does not keep its block"]
    );
    let refusals = hand.operator.change(draft(&text), Request::default()).unwrap_err();
    assert_eq!(refusals.kind(), RefusalKind::CannotChange);
}

#[test]
fn each_thing_that_cannot_be_changed_online_is_named() {
    let hand = Hand::new(NODE);
    let rows = [
        ("name = \"level\"", "name = \"other\"", "node \"level\"", "its name would be \"other\""),
        ("\"force\"", "\"set\"", "node \"level\"", "its control is \"force\" and would be \"set\""),
        ("[\"guard.*\"]", "[\"ramp.*.*\"]", "node \"level\"", "its [[protect]] would change"),
        ("\"100ms\"", "\"50ms\"", "task \"fast\"", "its period is 100ms and would be 50ms"),
        (
            "\"1s\"\n",
            "\"1s\"\nphase = \"1ms\"\n",
            "task \"slow\"",
            "its phase is 0ns and would be 1ms",
        ),
        ("\"1s\"\n", "\"1s\"\npriority = 7\n", "task \"slow\"", "its priority would change"),
        (
            "\"100ms\"\n",
            "\"100ms\"\nfollow = { service = \"plant/raw\", within = \"9ms\" }\n",
            "task \"fast\"",
            "its follow would change",
        ),
        ("\"plant/raw\"", "\"plant/x\"", "input \"raw\"", "its service would change"),
        ("default = 3.0", "default = 4.0", "input \"raw\"", "its default would change"),
        (
            "default = 3.0",
            "max_age = \"20ms\"\ndefault = 3.0",
            "input \"raw\"",
            "its max_age would change",
        ),
        (
            "[\"ramp.0.delayedValue\"]",
            "[\"ramp.1.delayedValue\"]",
            "output \"plant/ramp\"",
            "its signals would change",
        ),
        ("\"plant/after\"", "\"plant/b\"", "output \"plant/after\"", "it would be gone"),
    ];
    for (from, to, what, difference) in rows {
        assert!(NODE.contains(from), "{from}");
        let findings = refused(&hand, &NODE.replace(from, to));
        let expected = format!("{what} cannot be changed while the node runs: {difference}");
        assert!(findings.contains(&expected), "{expected}: {findings:?}");
    }
    let both = NODE.replace("\"100ms\"", "\"50ms\"").replace("\"plant/after\"", "\"plant/b\"");
    assert_eq!(refused(&hand, &both).len(), 3, "all of them are named");
    let new = refused(&hand, &format!("{NODE}\n[[task]]\nname = \"third\"\nperiod = \"1s\"\n"));
    assert_eq!(new, ["task \"third\" cannot be changed while the node runs: it would be new"]);
}

#[test]
fn what_is_protected_stays_as_it_is() {
    let hand = Hand::new(NODE);
    let protected = |text: &str| {
        let refusals = hand.operator.change(draft(text), Request::default()).unwrap_err();
        assert_eq!(refusals.kind(), RefusalKind::Forbidden);
        refusals.findings()[0].name().to_owned()
    };
    let raw = "value = \"raw\", setChangeRate = 10.0";
    assert_eq!(
        protected(&NODE.replace(raw, "value = \"raw\", setChangeRate = 9.0")),
        "guard.setChangeRate"
    );
    assert_eq!(protected(&NODE.replace(raw, "value = 1.0, setChangeRate = 10.0")), "guard.value");
}

#[test]
fn only_a_node_that_may_be_forced_can_be_changed() {
    let hand = Hand::new(&NODE.replace("control = \"force\"", "control = \"set\""));
    let text = NODE.replace("control = \"force\"", "control = \"set\"");
    let refusals = hand.operator.change(draft(&text), Request::default()).unwrap_err();
    assert_eq!(refusals.kind(), RefusalKind::Forbidden);
    assert!(refusals.to_string().contains("changing the configuration"), "{refusals}");
}

#[test]
fn limits_that_differ_are_told() {
    let mut hand = Hand::new(NODE);
    let text = NODE.replace("[0.0, 50.0]", "[0.0, 20.0]\n\"after.setChangeRate\" = [-1.0, 1000.0]");
    let summary = hand.change(&text);
    assert_eq!(
        summary.limits,
        [
            "ramp.*.setChangeRate: 0.0 to 50.0 -> 0.0 to 20.0",
            "after.setChangeRate: none -> -1.0 to 1000.0"
        ]
    );
    hand.steps(1);
    let summary = hand.change(NODE);
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
    let mut hand = Hand::new(NODE);
    hand.set([("ramp.0.setChangeRate", 40.0.into())]);
    hand.steps(1);
    let findings = refused(&hand, &NODE.replace("[0.0, 50.0]", "[0.0, 30.0]"));
    assert_eq!(findings, ["40.0 is outside the limits of \"ramp.0.setChangeRate\", 0.0 to 30.0"]);
}

#[test]
fn one_configuration_at_a_time_is_on_its_way_and_values_are_read_meanwhile() {
    let mut hand = Hand::new(NODE);
    hand.set([("ramp.0.value", 1.0.into())]);
    let refusals = hand.operator.change(draft(NODE), Request::default()).unwrap_err();
    assert!(matches!(refusals.findings()[..], [Refusal::Waiting { .. }]), "{refusals}");
    hand.steps(1);
    let early = hand.operator.change(draft(NODE), Request::default()).unwrap();
    hand.change(NODE);
    hand.step(0);
    let (names, next) = (hand.operator.get(["ramp.0.value"], 0, 9), hand.next.clone());
    assert!(names.is_ok(), "values are read all the time");
    assert!(hand.operator.change(draft(NODE), Request::default()).is_err());
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
fn values_are_set_and_forced_in_tasks_that_have_changed_and_in_those_that_have_not() {
    let mut hand = Hand::new(NODE);
    hand.force([("ramp.0.delayedValue", 9.0.into())], Hold::UntilReleased);
    hand.force([("after.delayedValue", 8.0.into())], Hold::UntilReleased);
    hand.steps(1);
    let text = NODE.replace("count = 3", "count = 4").replace(
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
        entries.iter().filter(|e| e.task == 1).map(|entry| entry.action).skip(1).collect();
    assert_eq!(of_slow, [Action::Apply, Action::Set, Action::Release]);
    hand.steps(1);
    assert_ne!(hand.value("after.delayedValue"), 8.0, "nothing holds it");
}

#[test]
fn a_force_that_comes_before_its_task_changes_goes_on_with_its_end_and_its_flag() {
    let mut hand = Hand::new(NODE);
    hand.steps(1);
    let text = NODE.replace("count = 3", "count = 4");
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
fn what_is_on_its_way_out_or_is_given_a_value_by_the_change_waits_for_it() {
    let mut hand = Hand::new(NODE);
    let set = hand.set([("ramp.0.setChangeRate", 20.0.into())]);
    hand.steps(1);
    let text = NODE.replace("count = 3", "count = 2").replacen("Rate = 10.0", "Rate = 40.0", 1);
    hand.change(&text.replace("[0.0, 50.0]", "[0.0, 45.0]\n\"ramp.*.value\" = [0.0, 30.0]"));
    let refused = |hand: &Hand, name: &str, value: f64| {
        let values = [(name, value.into())];
        hand.operator.set(values, Request::default(), &hand.next).unwrap_err()
    };
    for name in ["ramp.2.value", "ramp.0.setChangeRate"] {
        let refused = refused(&hand, name, 1.0);
        assert!(matches!(refused.findings()[..], [Refusal::Changing { .. }]), "{refused}");
        assert_eq!(refused.kind(), RefusalKind::Busy);
    }
    let values = [("ramp.2.value", 1.0.into())];
    let forced = hand.operator.force(values, Hold::UntilReleased, Request::default(), &hand.next);
    assert_eq!(forced.unwrap_err().kind(), RefusalKind::Busy);
    let undone = hand.operator.undo(set, Request::default(), &hand.next);
    assert_eq!(undone.unwrap_err().kind(), RefusalKind::Busy);
    // The value would be outside of the limits that come.
    assert_eq!(refused(&hand, "ramp.0.value", 31.0).kind(), RefusalKind::WrongValue);
    hand.set([("ramp.0.value", 29.0.into())]);
    hand.steps(1);
    assert_eq!(hand.value("ramp.0.value"), 29.0);
    assert_eq!(refused(&hand, "ramp.2.value", 1.0).kind(), RefusalKind::UnknownName);
}

#[test]
fn a_task_that_changes_first_finds_the_last_value_of_the_other_and_gives_its_own() {
    let mut hand = Hand::new(NODE);
    hand.steps(5);
    let text = NODE.replace("setChangeRate = 1000.0", "setChangeRate = 500.0");
    hand.change(&text);
    // The slow one is first: the other has not handed anything over.
    hand.step(1);
    assert_eq!(hand.value("after.value"), 5.0);
    hand.step(0);
    hand.step(1);
    assert_eq!(hand.value("after.value"), 6.0);
    hand.change(NODE);
    // The fast one has its new engine; the slow one reads what it has handed over.
    let mut handed = hand.replacements[0].take().unwrap();
    hand.engines[0].hand_over(&mut handed);
    hand.step(1);
    assert_eq!(hand.value("after.value"), 6.0);
    assert!(hand.engines[1].output_flags(0).is_empty(), "{:?}", hand.engines[1].output_flags(0));
}

#[test]
fn what_an_input_is_worth_and_the_errors_of_blocks_go_on() {
    let text =
        NODE.replace("value = 25.0, setChangeRate = 10.0", "value = \"raw\", setChangeRate = 10.0");
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
