//! What an operator may do to a running node, and what comes of it.

mod hand;

use hand::{Hand, plan};
use isochrone_engine::operate::*;
use isochrone_engine::{Flags, Plan, Rules, Source, TaskEngine};

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
type = "INT"
service = "plant/raw"
task = "fast"
default = 3

[[block]]
name = "scale"
type = "ScaleLinear"
task = "fast"
in = { x = "raw", x1 = 0.0, y1 = 0.0, x2 = 10.0, y2 = 10.0, yMin = -100.0, yMax = 100.0 }

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 2
in = { value = "scale.y", setChangeRate = 10.0 }

[[block]]
name = "guard"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = 1.0, setChangeRate = 10.0 }

[[block]]
name = "after"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.0.delayedValue", setChangeRate = 10.0 }

[[block]]
name = "free"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 25.0, setChangeRate = 10.0 }

[[output]]
service = "plant/ramp"
task = "fast"
signals = ["ramp.0.delayedValue"]

[[output]]
service = "plant/guard"
task = "fast"
signals = ["guard.delayedValue"]

[[output]]
service = "plant/after"
task = "slow"
signals = ["after.delayedValue"]
"#;

fn refusals(result: Result<Prepared, Refusals>) -> Vec<Refusal> {
    result.unwrap_err().findings().to_vec()
}

fn messages(result: Result<Prepared, Refusals>) -> Vec<String> {
    refusals(result).iter().map(|r| format!("{r}; {}", r.help())).collect()
}

#[test]
fn every_name_of_a_node_is_found_with_its_role() {
    let hand = Hand::new(NODE);
    let signals = hand.operator.signals();
    let rows = [
        ("raw", Role::Input),
        ("raw.ok", Role::Ok),
        ("raw.age", Role::Age),
        ("scale.x", Role::Wired),
        ("scale.x1", Role::Parameter),
        ("scale.y", Role::Output),
        ("ramp.1.setChangeRate", Role::Parameter),
        ("ramp.1.value", Role::Wired),
        ("after.value", Role::Wired),
        ("free.value", Role::Parameter),
    ];
    for (name, role) in rows {
        let signal = signals.find(name).unwrap();
        assert_eq!((signal.name.as_str(), signal.role), (name, role));
        assert_eq!(signals.at(signal.task, signal.slot).unwrap(), signal);
    }
}

#[test]
fn a_name_that_is_not_there_is_answered_with_the_one_that_was_meant() {
    let hand = Hand::new(NODE);
    let rows = [
        ("rmp.0.value", "did you mean \"ramp.0.value\"?"),
        ("ramp.0.valu", "did you mean \"ramp.0.value\"?"),
        ("ramp.2.value", "the instances of ramp are ramp.0 to ramp.1"),
        ("ramp.value", "the instances of ramp are ramp.0 to ramp.1"),
        ("ramp.00.value", "the instances of ramp are ramp.0 to ramp.1"),
        ("scale.0.x", "scale is a single block: \"scale.x\""),
        ("raw.oky", "did you mean \"raw.ok\"?"),
        ("rw", "did you mean \"raw\"?"),
        ("", "there is: raw, "),
        ("zzz.zzz.zzz.zzz", "there is: raw, "),
    ];
    for (name, help) in rows {
        let refusal = hand.operator.signals().find(name).unwrap_err();
        assert!(refusal.help().contains(help), "{name}: {}", refusal.help());
    }
}

#[test]
fn a_pattern_stands_for_all_names_that_match_and_pages_of_them_follow_each_other() {
    let hand = Hand::new(NODE);
    let signals = hand.operator.signals();
    let names = |pattern: &str| -> Vec<String> {
        signals.matching(&Pattern::new(pattern)).page(0, 99).map(|s| s.name).collect()
    };
    assert_eq!(names("r*"), ["raw"]);
    assert_eq!(names("raw.*"), ["raw.ok", "raw.age"]);
    assert_eq!(names("ramp.*.value"), ["ramp.0.value", "ramp.1.value"]);
    assert_eq!(names("*.1.set*"), ["ramp.1.setChangeRate"]);
    assert!(names("ramp.*").is_empty());
    let all = signals.matching(&Pattern::new("*.*.*"));
    let pages = (0..all.total()).step_by(3).flat_map(|offset| all.page(offset, 3));
    assert!(pages.map(|s| s.name).eq(all.page(0, all.total()).map(|s| s.name)));
}

#[test]
fn a_request_is_answered_with_all_that_is_wrong_with_it() {
    let hand = Hand::new(NODE);
    let values: [(&str, Value); 13] = [
        ("free.value", 1.0.into()),
        ("free.value", 2.0.into()),
        ("fre.value", 1.0.into()),
        ("scale.x", 1.0.into()),
        ("scale.y", 1.0.into()),
        ("raw", 1.into()),
        ("raw.ok", true.into()),
        ("guard.value", 1.0.into()),
        ("ramp.1.setChangeRate", 51.0.into()),
        ("scale.x1", f64::NAN.into()),
        ("free.enDefaultOutValue", 1.into()),
        ("free.callOB", 1.5.into()),
        ("free.callOB", 40_000.into()),
    ];
    let found = messages(hand.operator.set(values, Request::default(), &[0, 0]));
    let expected = [
        "\"free.value\" is given twice",
        "there is no signal \"fre.value\"; did you mean \"free.value\"?",
        "\"scale.x\" is wired to \"raw\"",
        "\"scale.y\" is an output pin",
        "\"raw\" is an input, which is read from service \"plant/raw\"; publish",
        "\"raw.ok\" tells what the value of an input is worth",
        "\"guard.value\" is protected by [[protect]] \"guard.*\"",
        "51.0 is outside the limits of \"ramp.1.setChangeRate\", 0.0 to 50.0",
        "NaN is no LREAL",
        "1 is no BOOL, as \"free.enDefaultOutValue\" is; write true or false",
        "1.5 is no INT, as \"free.callOB\" is; write a whole number from -32768 to 32767",
        "\"free.callOB\" is given twice",
    ];
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found} is not {expected}");
    }
}

#[test]
fn ten_thousand_unknown_names_are_refused_one_by_one() {
    let hand = Hand::new(NODE);
    let names: Vec<String> = (0..10_000).map(|n| format!("nobody{n}.x")).collect();
    let values = names.iter().map(|name| (name.as_str(), Value::from(1.0)));
    assert_eq!(refusals(hand.operator.set(values, Request::default(), &[0, 0])).len(), 10_000);
}

#[test]
fn a_request_for_nothing_is_refused() {
    let hand = Hand::new(NODE);
    let none: [(&str, Value); 0] = [];
    assert_eq!(refusals(hand.operator.set(none, Request::default(), &[0, 0])), [Refusal::Empty]);
    assert_eq!(refusals(hand.operator.release([], Request::default(), &[0, 0])), [Refusal::Empty]);
}

#[test]
fn what_the_configuration_does_not_allow_is_refused_with_what_would() {
    for (control, may_set) in [("off", false), ("read", false), ("set", true)] {
        let hand = Hand::new(&NODE.replace("\"force\"", &format!("\"{control}\"")));
        let values = [("free.value", Value::from(1.0))];
        let set = hand.operator.set(values, Request::default(), &[0, 0]);
        assert_eq!(set.is_ok(), may_set, "{control}");
        let force = hand.operator.force(values, Hold::UntilReleased, Request::default(), &[0, 0]);
        assert_eq!(force.as_ref().unwrap_err().kind(), RefusalKind::Forbidden);
        let found = messages(force);
        let sentence = format!("[node] control = \"{control}\" does not allow forcing a signal");
        assert!(
            found[0].starts_with(&sentence) && found[0].contains("control = \"force\""),
            "{found:?}"
        );
    }
}

#[test]
fn all_values_of_a_task_are_set_before_one_cycle_which_is_told_with_what_was_there_before() {
    let mut hand = Hand::new(NODE);
    hand.step(0);
    let number = hand.set([("scale.y1", 5.0.into()), ("ramp.0.setChangeRate", 20.0.into())]);
    assert_eq!(hand.value("scale.y1"), 0.0);
    hand.step(0);
    let [entry] = &hand.entries()[..] else { panic!() };
    assert_eq!((entry.transaction, entry.task, entry.cycle), (number, 0, 1));
    let mut before: Vec<_> = entry.changes.iter().map(|c| (c.name.as_str(), c.before)).collect();
    before.sort_by_key(|(name, _)| *name);
    assert_eq!(
        before,
        [("ramp.0.setChangeRate", Value::Number(10.0)), ("scale.y1", Value::Number(0.0))]
    );
    assert_eq!(hand.value("scale.y1"), 5.0);
}

#[test]
fn values_of_several_tasks_are_set_before_a_cycle_of_each() {
    let mut hand = Hand::new(NODE);
    let number = hand.set([("scale.y1", 5.0.into()), ("free.value", 2.0.into())]);
    hand.step(1);
    hand.step(0);
    let entries = hand.entries();
    assert_eq!(
        entries.iter().map(|e| (e.transaction, e.task)).collect::<Vec<_>>(),
        [(number, 1), (number, 0)]
    );
}

#[test]
fn a_set_waits_for_the_cycle_that_it_names_and_takes_the_next_if_that_is_missed() {
    let mut hand = Hand::new(NODE);
    for (at, runs, applied) in [(3, [1, 2, 3].as_slice(), 3), (9, &[7, 8, 11], 11)] {
        let request = Request { at: Some(at), ..Request::default() };
        let prepared = hand.operator.set([("free.value", (at as f64).into())], request, &[0, 0]);
        hand.send(prepared);
        for cycle in runs {
            assert_ne!(hand.value("free.value"), at as f64, "{cycle}");
            hand.next[1] = *cycle;
            hand.step(1);
        }
        assert_eq!(hand.value("free.value"), at as f64);
        assert_eq!(hand.entries()[0].cycle, applied);
    }
}

#[test]
fn a_set_that_comes_when_its_cycle_has_begun_changes_nothing() {
    let mut hand = Hand::new(NODE);
    let request = Request { at: Some(4), ..Request::default() };
    let prepared = hand.operator.set([("free.value", 1.0.into())], request, &[0, 0]);
    hand.next[1] = 4;
    hand.step(1);
    let number = hand.send(prepared);
    hand.step(1);
    assert_eq!(hand.done, [Done::TooLate { transaction: number }]);
    assert_eq!(hand.value("free.value"), 25.0);
}

#[test]
fn a_cycle_that_nothing_can_wait_for_is_refused() {
    let hand = Hand::new(NODE);
    let next = [500, 50];
    let why = |values: &[(&str, Value)], at| {
        let request = Request { at: Some(at), ..Request::default() };
        let refused = hand.operator.set(values.iter().copied(), request, &next);
        let [Refusal::At { why, .. }] = refusals(refused)[..] else { panic!() };
        why
    };
    let fast = ("scale.y1", Value::from(1.0));
    let slow = ("free.value", Value::from(1.0));
    assert_eq!(why(&[fast], 499), AtRefusal::TooLate);
    assert_eq!(why(&[fast], 601), AtRefusal::TooFar);
    assert_eq!(why(&[fast], u64::MAX), AtRefusal::TooFar);
    assert_eq!(why(&[fast, slow], 510), AtRefusal::SeveralTasks);
    let request = Request { at: Some(600), ..Request::default() };
    assert!(hand.operator.set([fast], request, &next).is_ok());
}

#[test]
fn a_value_that_a_block_refuses_from_then_on_is_warned_of_and_set() {
    let mut hand = Hand::new(NODE);
    let values = [("free.setChangeRate", Value::from(-1.0))];
    let prepared = hand.operator.set(values, Request::default(), &hand.next).unwrap();
    let [warning] = &prepared.warnings[..] else { panic!("{:?}", prepared.warnings) };
    assert!(warning.to_string().starts_with("block \"free\" will report 16#"), "{warning}");
    hand.send(Ok(prepared));
    hand.step(1);
    assert_eq!(hand.engines[1].block_errors(), 1);
    let good =
        hand.operator.set([("free.setChangeRate", 1.0.into())], Request::default(), &hand.next);
    assert!(good.unwrap().warnings.is_empty());
}

#[test]
fn an_output_that_is_forced_is_seen_by_wires_frames_and_other_tasks_and_flagged() {
    let mut hand = Hand::new(NODE);
    hand.force([("ramp.0.delayedValue", 7.0.into())], Hold::UntilReleased);
    hand.step(0);
    hand.step(1);
    assert_eq!(hand.value("after.value"), 7.0);
    let mut frame = [0.0];
    hand.engines[0].read_output(0, &mut frame);
    assert_eq!(frame, [7.0]);
    let forced = |hand: &Hand, task: usize, output| {
        hand.engines[task].output_flags(output).contains(Flags::FORCED)
    };
    assert!(forced(&hand, 0, 0) && forced(&hand, 1, 0));
    assert!(!forced(&hand, 0, 1), "the guard has nothing to do with it");
    hand.release("ramp.0.delayedValue");
    hand.step(0);
    hand.step(1);
    assert!(!forced(&hand, 0, 0) && !forced(&hand, 1, 0));
    assert_ne!(hand.value("ramp.0.delayedValue"), 7.0);
}

#[test]
fn each_of_many_forces_flags_what_is_computed_from_it_and_nothing_else() {
    let mut text = r#"
        [node]
        name = "n"
        control = "force"
        [[task]]
        name = "t"
        period = "100ms"
        [[block]]
        name = "ramp"
        type = "LimRateOfChangeCI"
        count = 200
        in = { value = 25.0, setChangeRate = 10.0 }
    "#
    .to_owned();
    for ramp in 0..200 {
        text += &format!(
            "[[output]]\nservice = \"n/{ramp}\"\nsignals = [\"ramp.{ramp}.delayedValue\"]\n"
        );
    }
    let mut hand = Hand::new(&text);
    let names: Vec<String> = (0..200).map(|ramp| format!("ramp.{ramp}.value")).collect();
    let of = |wanted: fn(usize) -> bool| {
        let names = names.iter().enumerate().filter(move |(ramp, _)| wanted(*ramp));
        names.map(|(_, name)| name.as_str())
    };
    let values = of(|ramp| ramp % 3 == 0).map(|name| (name, 1.0.into()));
    let hold = Hold::UntilReleased;
    hand.send(hand.operator.force(values, hold, Request::default(), &hand.next));
    hand.step(0);
    let flagged = |hand: &Hand| -> Vec<usize> {
        let is_flagged = |ramp: &usize| hand.engines[0].output_flags(*ramp).contains(Flags::FORCED);
        (0..200).filter(is_flagged).collect()
    };
    let forced: Vec<usize> = (0..200).filter(|ramp| ramp % 3 == 0).collect();
    assert_eq!(flagged(&hand), forced);
    let names = of(|ramp| ramp % 3 == 0 && ramp != 198);
    hand.send(hand.operator.release(names, Request::default(), &hand.next));
    hand.step(0);
    assert_eq!(flagged(&hand), [198]);
}

#[test]
fn a_set_that_its_block_does_not_read_now_is_warned_of() {
    let text = NODE.replace(
        "[[block]]\nname = \"free\"",
        "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\ntask = \"slow\"\n\
         in = { timeRange = \"100ms\" }\n[[block]]\nname = \"free\"",
    );
    let mut hand = Hand::new(&text);
    hand.force([("free.value", 1.0.into())], Hold::UntilReleased);
    hand.step(1);
    let values = [("free.value", 9.0.into()), ("saw.timeRange", Value::from(2000))];
    let prepared = hand.operator.set(values, Request::default(), &hand.next).unwrap();
    let told: Vec<String> = prepared.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "\"free.value\" is forced: its block reads the new value after the release",
            "\"saw.timeRange\" is read only in the block's first call and while \"saw.reset\" is \
             TRUE",
        ]
    );
    let values = [("saw.reset", true.into()), ("saw.timeRange", Value::from(2000))];
    let prepared = hand.operator.set(values, Request::default(), &hand.next).unwrap();
    assert_eq!(prepared.warnings, [], "it is reset with it");
    let hold = Hold::Seconds(1.0);
    let values = [("free.value", 2.0.into())];
    let prepared = hand.operator.force(values, hold, Request::default(), &hand.next).unwrap();
    let told: Vec<String> = prepared.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        ["\"free.value\" was forced already: the new force, with its end, replaces that one"]
    );
}

#[test]
fn a_wired_pin_that_is_forced_is_read_by_its_block_and_follows_its_wire_again_afterwards() {
    let mut hand = Hand::new(NODE);
    hand.force([("scale.x", 50.0.into())], Hold::UntilReleased);
    hand.step(0);
    assert_eq!((hand.value("scale.x"), hand.value("scale.y")), (50.0, 50.0));
    hand.release("scale.x");
    hand.step(0);
    assert_eq!((hand.value("scale.x"), hand.value("scale.y")), (3.0, 3.0));
}

#[test]
fn a_parameter_that_was_set_while_it_was_forced_has_that_value_afterwards() {
    let mut hand = Hand::new(NODE);
    hand.force([("free.value", 1.0.into())], Hold::UntilReleased);
    hand.step(1);
    hand.set([("free.value", 9.0.into())]);
    hand.step(1);
    assert_eq!(hand.value("free.value"), 1.0);
    let before = hand.entries().last().unwrap().changes[0].before;
    assert_eq!(before, Value::Number(25.0), "what it had before, not what it was forced to");
    hand.release("free.value");
    hand.step(1);
    assert_eq!(hand.value("free.value"), 9.0);
}

#[test]
fn an_input_that_is_forced_has_its_newest_sample_afterwards_and_is_good_all_the_while() {
    let mut hand = Hand::new(NODE);
    hand.force([("raw", 8.into())], Hold::UntilReleased);
    hand.step(0);
    hand.engines[0].set_input(0, 5.0, 1);
    hand.step(0);
    assert_eq!((hand.value("raw"), hand.value("scale.y")), (8.0, 8.0));
    hand.release("raw");
    hand.step(0);
    assert_eq!((hand.value("raw"), hand.value("scale.y")), (5.0, 5.0));
}

#[test]
fn a_force_ends_exactly_at_its_cycle_or_with_the_next_that_runs() {
    for (runs, ended) in [([5, 6, 7, 8, 9], 8), ([5, 6, 7, 12, 13], 12)] {
        let mut hand = Hand::new(NODE);
        hand.force([("free.value", 1.0.into())], Hold::Seconds(3.0));
        for cycle in runs {
            hand.next[1] = cycle;
            hand.step(1);
            assert_eq!(hand.value("free.value") == 1.0, cycle < ended, "{cycle}");
        }
        let entries = hand.entries();
        let actions: Vec<_> = entries.iter().map(|e| (e.action, e.cycle)).collect();
        assert_eq!(actions, [(Action::Force { until: Some(8) }, 5), (Action::Expiry, ended)]);
        assert_eq!(entries[1].changes[0].after, Some(Value::Number(25.0)));
        assert_eq!(hand.operator.forces().count(), 0);
    }
}

#[test]
fn a_signal_that_is_forced_again_has_the_new_value_and_the_new_end() {
    let mut hand = Hand::new(NODE);
    hand.force([("free.value", 1.0.into())], Hold::Seconds(2.0));
    hand.step(1);
    hand.force([("free.value", 2.0.into())], Hold::Seconds(3.0));
    for expected in [2.0, 2.0, 2.0, 25.0] {
        hand.step(1);
        assert_eq!(hand.value("free.value"), expected);
    }
}

#[test]
fn the_age_of_an_input_cannot_be_forced_but_whether_it_is_good_can() {
    let mut hand = Hand::new(NODE);
    let force = |hand: &Hand, name: &str, value| {
        hand.operator.force([(name, value)], Hold::UntilReleased, Request::default(), &hand.next)
    };
    assert!(matches!(refusals(force(&hand, "raw.age", 1.0.into()))[..], [Refusal::Age { .. }]));
    let prepared = force(&hand, "raw.ok", true.into());
    hand.send(prepared);
    hand.step(0);
    assert_eq!(hand.value("raw.ok"), 1.0);
}

#[test]
fn only_what_is_forced_can_be_released_by_name_or_by_pattern() {
    let mut hand = Hand::new(NODE);
    let release = |hand: &Hand, name: &str| {
        messages(hand.operator.release([name], Request::default(), &hand.next)).remove(0)
    };
    assert!(release(&hand, "free.value").starts_with("\"free.value\" is not forced"));
    assert!(release(&hand, "rmp.*.value").contains("did you mean \"ramp.*.value\"?"));
    hand.force([("ramp.0.value", 1.0.into()), ("ramp.1.value", 2.0.into())], Hold::UntilReleased);
    hand.step(0);
    assert_eq!(hand.operator.forces().count(), 2);
    hand.release("ramp.*.value");
    hand.step(0);
    assert_eq!(hand.operator.forces().count(), 0);
    // What a pattern stands for may have come to its end before it is asked for.
    for all in ["ramp.*.value", "*", "*.*", "*.*.*", "*.*.*.*"] {
        let prepared = hand.operator.release([all], Request::default(), &hand.next).unwrap();
        assert_eq!(prepared.tasks().count(), 0);
    }
    hand.force([("ramp.0.value", 1.0.into())], Hold::UntilReleased);
    hand.step(0);
    let names = ["*", "*.*", "*.*.*"];
    let prepared = hand.operator.release(names, Request::default(), &hand.next);
    hand.send(prepared);
    hand.step(0);
    assert_eq!(hand.operator.forces().count(), 0);
    assert_eq!((hand.value("ramp.0.value"), hand.value("ramp.1.value")), (3.0, 3.0));
}

#[test]
fn a_task_has_room_for_so_many_forces_and_no_more() {
    let count = MAX_FORCES + 1;
    let text = format!(
        "[node]\nname = \"n\"\ncontrol = \"force\"\n[[task]]\nname = \"t\"\nperiod = \"1s\"\n\
         [[block]]\nname = \"b\"\ntype = \"LimRateOfChangeCI\"\ncount = {count}\n\
         in = {{ value = 1.0, setChangeRate = 1.0 }}\n"
    );
    let mut hand = Hand::new(&text);
    let names: Vec<String> = (0..count).map(|n| format!("b.{n}.value")).collect();
    let force = |hand: &Hand, names: &[String]| {
        let values = names.iter().map(|name| (name.as_str(), Value::from(2.0)));
        hand.operator.force(values, Hold::Seconds(2.0), Request::default(), &hand.next)
    };
    assert_eq!(force(&hand, &names).unwrap_err().kind(), RefusalKind::Busy);
    let all = force(&hand, &names[1..]);
    hand.send(all);
    hand.step(0);
    assert!(names[1..].iter().all(|name| hand.value(name) == 2.0));
    assert_eq!(force(&hand, &names[..1]).unwrap_err().kind(), RefusalKind::Busy);
    hand.step(0);
    hand.step(0);
    assert!(names.iter().all(|name| hand.value(name) == 1.0));
    let one = force(&hand, &names[..1]);
    hand.send(one);
    hand.step(0);
    assert_eq!(hand.value("b.0.value"), 2.0);
}

#[test]
fn a_force_must_last_some_time() {
    let hand = Hand::new(NODE);
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e30] {
        let values = [("free.value", Value::from(1.0))];
        let hold = Hold::Seconds(seconds);
        let refused = hand.operator.force(values, hold, Request::default(), &hand.next);
        assert!(matches!(refusals(refused)[..], [Refusal::Duration { .. }]), "{seconds}");
    }
}

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
fn what_waits_for_its_cycle_is_told_until_it_has_come() {
    let mut hand = Hand::new(NODE);
    let request = Request { at: Some(2), comment: Some("later".into()), ..Request::default() };
    let values = [("free.value", 3.0.into()), ("free.setChangeRate", 2.0.into())];
    let prepared = hand.operator.set(values, request.clone(), &hand.next);
    let set = hand.send(prepared);
    let hold = Hold::Seconds(2.0);
    let prepared = hand.operator.force([("free.value", 9.0.into())], hold, request, &hand.next);
    let force = hand.send(prepared);
    let told = |hand: &Hand| -> Vec<_> {
        let pending = hand.operator.pending();
        pending.map(|one| (one.transaction, one.action, one.task, one.cycle, one.names)).collect()
    };
    let name = |name: &str| name.to_owned();
    assert_eq!(
        told(&hand),
        [
            (set, "set", 1, 2, vec![name("free.setChangeRate"), name("free.value")]),
            (force, "force", 1, 2, vec![name("free.value")]),
        ]
    );
    (0..3).for_each(|_| hand.step(1));
    assert_eq!(told(&hand), []);
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
fn values_are_read_after_the_blocks_of_one_cycle_have_stepped() {
    let mut hand = Hand::new(NODE);
    let names = ["scale.y", "ramp.*.value", "free.value"];
    let (prepared, total) = hand.operator.get(names, 0, 99).unwrap();
    assert_eq!(total, 4);
    hand.send(Ok(prepared));
    hand.step(0);
    hand.step(1);
    let [Done::Read(fast), Done::Read(slow)] = &hand.done[..] else { panic!("{:?}", hand.done) };
    let value = |name: &str, value| (name.to_owned(), Value::Number(value));
    assert_eq!(
        fast.values,
        [value("scale.y", 3.0), value("ramp.0.value", 3.0), value("ramp.1.value", 3.0)]
    );
    assert_eq!((fast.cycle, &slow.values[..]), (0, &[value("free.value", 25.0)][..]));
    let (page, total) = hand.operator.get(names, 2, 1).unwrap();
    assert_eq!((page.tasks().collect::<Vec<_>>(), total), (vec![0], 4));
    let refused = hand.operator.get(["scale.yy", "nobody.*"], 0, 99).unwrap_err();
    assert_eq!(refused.findings().len(), 2);
}

#[test]
fn a_signal_that_several_names_stand_for_is_read_once_where_it_stands_first() {
    let mut hand = Hand::new(NODE);
    let names = ["ramp.1.value", "ramp.*.value", "scale.y", "ramp.*.*", "scale.y"];
    let (_, total) = hand.operator.get(names, 0, 99).unwrap();
    let (_, pins) = hand.operator.get(["ramp.*.*"], 0, 99).unwrap();
    assert_eq!(total, pins + 1);
    let mut paged = Vec::new();
    for offset in 0..total {
        let (page, of) = hand.operator.get(names, offset, 1).unwrap();
        assert_eq!(of, total);
        hand.send(Ok(page));
        hand.step(0);
        let Some(Done::Read(read)) = hand.done.pop() else { panic!("{:?}", hand.done) };
        paged.extend(read.values.into_iter().map(|(name, _)| name));
    }
    assert_eq!(paged[..3], ["ramp.1.value", "ramp.0.value", "scale.y"]);
    let mut sorted = paged.clone();
    sorted.sort();
    sorted.dedup();
    assert_eq!(sorted.len(), total, "{paged:?}");
}

#[test]
fn a_misspelt_name_among_thousands_is_told_the_one_that_begins_alike() {
    let block = |n: u32| format!("[[block]]\nname = \"b{n}\"\ntype = \"SawTooth\"\n");
    let blocks: String = (0..5000).map(block).collect();
    let text = format!("[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1s\"\n{blocks}");
    let hand = Hand::new(&text);
    let help = |name| hand.operator.get([name], 0, 1).unwrap_err().findings()[0].help();
    assert!(help("b47777.value").starts_with("did you mean \"b477"), "{}", help("b47777.value"));
    assert!(help("x.value").starts_with("there are 5000: b0, b1, b10, "), "{}", help("x.value"));
}

#[test]
fn what_a_request_makes_a_large_node_look_for_is_bounded() {
    let text = NODE.replace("count = 2", "count = 1000000");
    let hand = Hand::new(&text);
    let (_, total) = hand.operator.get(["ramp.*1.value"], 0, 1).unwrap();
    assert_eq!(total, 100_000);
    let refused = hand.operator.get(["ramp.*1.value", "ramp.*2.value"], 0, 1).unwrap_err();
    let said = refused.to_string();
    assert!(said.contains("\"ramp.*2.value\" was not looked for"), "{said}");
    assert!(said.contains("divide the request"), "{said}");
    let (_, all) = hand.operator.get(["scale.*", "ramp.7.*", "ramp.*.value"], 0, 1).unwrap();
    assert!(all > 1_000_000);
    let unknown: Vec<String> = (0..4096).map(|n| format!("ramp.*{n}.valeu")).collect();
    let names = || unknown.iter().map(String::as_str);
    assert_eq!(hand.operator.get(names(), 0, 1).unwrap_err().findings().len(), 4096);
    let refused = hand.operator.release(names(), Request::default(), &hand.next).unwrap_err();
    assert_eq!(refused.findings().len(), 4096);
}

#[test]
fn the_journal_tells_what_was_done_in_order_by_whom_and_why() {
    let mut hand = Hand::new(NODE);
    let request = Request {
        client: Client::Other { name: Some("anna".into()), process: Some(7) },
        comment: Some("test".into()),
        at: None,
    };
    let prepared = hand.operator.set([("free.value", 1.0.into())], request, &hand.next);
    hand.send(prepared);
    hand.force([("free.value", 2.0.into())], Hold::Seconds(1.0));
    hand.step(1);
    hand.step(1);
    let entries: Vec<Entry> = hand.operator.journal(0).collect();
    let actions: Vec<_> =
        entries.iter().map(|e| (e.sequence, e.action.as_str(), e.cycle)).collect();
    assert_eq!(actions, [(1, "set", 0), (2, "force", 0), (3, "expiry", 1)]);
    assert_eq!(entries[0].client, Client::Other { name: Some("anna".into()), process: Some(7) });
    assert_eq!(entries[0].comment.as_deref(), Some("test"));
    assert_eq!(hand.operator.journal(3).count(), 1);
}

#[test]
fn the_running_values_are_saved_in_place_of_the_constants_and_all_else_stays() {
    let text = NODE.replace(
        "in = { value = 25.0, setChangeRate = 10.0 }",
        "[block.in]\nvalue = 25.0        # m\nsetChangeRate = 1e1 # m/s",
    );
    let mut hand = Hand::new(&text);
    assert_eq!(hand.operator.save(&text).unwrap(), text);
    hand.set([("free.value", 7.5.into()), ("free.enDefaultOutValue", true.into())]);
    let number = hand.set([("scale.y1", 1.0.into()), ("ramp.1.setChangeRate", 20.0.into())]);
    hand.set([("scale.yMin", (-7.0).into())]);
    hand.step(0);
    hand.step(1);
    let saved = hand.operator.save(&text).unwrap();
    for line in ["value = 7.5         # m", "setChangeRate = 1e1 # m/s", "enDefaultOutValue = true"]
    {
        assert!(saved.contains(line), "{saved}");
    }
    let ramp = "in = { value = \"scale.y\", setChangeRate = 10.0, 1 = { setChangeRate = 20.0 } }";
    assert!(saved.contains(ramp), "{saved}");
    assert!(
        saved.contains("y1 = 1.0, x2 = 10.0, y2 = 10.0, yMin = -7.0, yMax = 100.0 }"),
        "{saved}"
    );
    let again = Hand::new(&saved);
    assert_eq!((again.value("free.value"), again.value("ramp.1.setChangeRate")), (7.5, 20.0));
    assert_eq!(again.value("ramp.0.setChangeRate"), 10.0);
    let prepared = hand.operator.undo(number, Request::default(), &hand.next);
    hand.send(prepared);
    hand.step(0);
    assert!(!hand.operator.save(&text).unwrap().contains("setChangeRate = 20.0"));
}

#[test]
fn running_values_are_not_saved_into_a_configuration_of_another_node() {
    let mut hand = Hand::new(NODE);
    hand.set([("free.value", 7.5.into())]);
    hand.step(1);
    let other = NODE.replace("\"free\"", "\"other\"");
    assert_eq!(hand.operator.save(&other), Err(SaveError::Other { name: "free.value".into() }));
    assert!(matches!(hand.operator.save("= 1"), Err(SaveError::Syntax { .. })));
}

#[test]
fn instances_of_a_large_count_are_found_by_name_and_by_place() {
    let text = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1s\"\n\
        [[block]]\nname = \"b\"\ntype = \"SawTooth\"\ncount = 100000\n";
    let plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
    let signals = Signals::of(&plan);
    let last = signals.find("b.99999.timeRange").unwrap();
    assert_eq!(last.name, "b.99999.timeRange");
    let all = signals.matching(&Pattern::new("b.*.value"));
    assert_eq!(all.total(), 100_000);
    assert_eq!(all.page(99_999, 9).map(|s| s.name).collect::<Vec<_>>(), ["b.99999.value"]);
}

#[test]
fn a_pin_that_nothing_was_given_reads_nan_and_has_nothing_again_after_an_undo() {
    let mut hand = Hand::new(NODE);
    let set = hand.set([("ramp.0.callOB", 35.into())]);
    hand.step(0);
    let Some(Done::Applied(entry)) = hand.done.pop() else { panic!("it was applied") };
    assert!(matches!(entry.changes[0].before, Value::Number(before) if before.is_nan()));
    let undo = hand.operator.undo(set, Request::default(), &hand.next);
    hand.send(undo);
    hand.step(0);
    assert!(hand.value("ramp.0.callOB").is_nan());
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
        Change { name, before, after: Some(after) }
    };
    let entry = Entry {
        sequence: 1,
        transaction: 1,
        task: 0,
        cycle: 3,
        unix_ns: 0,
        action: Action::Set,
        changes: vec![
            change("rampp.0.setChangeRate", 1.0.into()),
            change("free.setChangeRate", 1.0.into()),
            change("guard.setChangeRate", true.into()),
        ],
        client: Client::Program,
        comment: None,
        configuration: None,
    };
    let refused = Replay::new(&plan).check(&entry).unwrap_err();
    let told: Vec<String> = refused.findings().iter().map(|finding| finding.help()).collect();
    assert_eq!(told.len(), 3, "{refused}");
    assert!(told[0].contains("ramp"), "{told:?}");
    assert_eq!(told[1..], ["it is a signal of task \"slow\"", "write a number"]);
}

#[test]
fn nothing_is_changed_while_the_journal_cannot_be_written() {
    let mut hand = Hand::new(NODE);
    hand.operator.continue_after(41);
    assert_eq!(hand.set([("ramp.0.setChangeRate", 20.0.into())]), 42);
    hand.operator.set_unwritten(Some("the journal j cannot be written (disk full)".into()));
    let set = [("ramp.0.setChangeRate", 30.0.into())];
    let refused = hand.operator.set(set, Request::default(), &hand.next).unwrap_err();
    assert_eq!(refused.kind(), RefusalKind::Forbidden);
    let told = "nothing can be changed while the journal j cannot be written (disk full)";
    assert_eq!(refused.findings()[0].to_string(), told);
    let force =
        hand.operator.force([("raw", 1.into())], Hold::UntilReleased, Request::default(), &[0, 0]);
    assert_eq!(refusals(force)[0].to_string(), told);
    assert!(hand.operator.get(["raw"], 0, 1).is_ok());
    hand.operator.set_unwritten(None);
    assert_eq!(hand.set(set), 43);
}
