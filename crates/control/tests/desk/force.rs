//! Signals that are forced: what sees them, how they end, and how they are released.

use isochrone_control::desk::*;
use isochrone_engine::Flags;
use isochrone_engine::orders::MAX_FORCES;
use isochrone_model::*;

use crate::hand::Hand;
use crate::level::{NODE, messages};

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
    let values = of(|ramp| ramp % 3 == 0).map(|name| (name, 1.0));
    let hold = Hold::UntilReleased;
    hand.send(hand.operator.force(values, hold, RequestTerms::default(), &hand.next));
    hand.step(0);
    let flagged = |hand: &Hand| -> Vec<usize> {
        let is_flagged = |ramp: &usize| hand.engines[0].output_flags(*ramp).contains(Flags::FORCED);
        (0..200).filter(is_flagged).collect()
    };
    let forced: Vec<usize> = (0..200).filter(|ramp| ramp % 3 == 0).collect();
    assert_eq!(flagged(&hand), forced);
    let names = of(|ramp| ramp % 3 == 0 && ramp != 198);
    hand.send(hand.prepare_release(names));
    hand.step(0);
    assert_eq!(flagged(&hand), [198]);
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
        assert_eq!(actions, [(Action::Force, 5), (Action::Expiry, ended)]);
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
    let force = |hand: &Hand, name: &str, value: Value| {
        hand.operator.force(
            [(name, value)],
            Hold::UntilReleased,
            RequestTerms::default(),
            &hand.next,
        )
    };
    let age = "\"raw.age\" is the age of an input, which cannot be forced; \
               force the input, or its \".ok\"";
    assert_eq!(messages(force(&hand, "raw.age", 1.0.into())), [age]);
    let prepared = force(&hand, "raw.ok", true.into());
    hand.send(prepared);
    hand.step(0);
    assert_eq!(hand.value("raw.ok"), 1.0);
}

#[test]
fn only_what_is_forced_can_be_released_by_name_or_by_pattern() {
    let mut hand = Hand::new(NODE);
    let release = |hand: &Hand, name: &str| messages(hand.prepare_release([name])).remove(0);
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
        let prepared = hand.prepare_release([all]).unwrap();
        assert_eq!(prepared.tasks().count(), 0);
    }
    hand.force([("ramp.0.value", 1.0.into())], Hold::UntilReleased);
    hand.step(0);
    let names = ["*", "*.*", "*.*.*"];
    let prepared = hand.prepare_release(names);
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
        hand.operator.force(values, Hold::Seconds(2.0), RequestTerms::default(), &hand.next)
    };
    assert_eq!(force(&hand, &names).unwrap_err().code, Code::Busy);
    let all = force(&hand, &names[1..]);
    hand.send(all);
    hand.step(0);
    assert!(names[1..].iter().all(|name| hand.value(name) == 2.0));
    assert_eq!(force(&hand, &names[..1]).unwrap_err().code, Code::Busy);
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
        let refused = hand.operator.force(values, hold, RequestTerms::default(), &hand.next);
        let message = format!("a force cannot last {seconds:?} s; ");
        assert!(messages(refused)[0].starts_with(&message), "{seconds}");
    }
}

#[test]
fn a_release_ends_forces_that_are_still_to_come_and_is_in_the_journal() {
    let mut hand = Hand::new(NODE);
    let force = |hand: &mut Hand, values: &[(&str, f64)], at: u64| {
        let request = RequestTerms { at: Some(at.into()), ..RequestTerms::default() };
        let values = values.iter().copied();
        hand.send(hand.operator.force(values, Hold::UntilReleased, request, &hand.next))
    };
    hand.force([("ramp.1.value", 9.0.into())], Hold::UntilReleased);
    hand.step(0);
    hand.done.clear();
    let alone = force(&mut hand, &[("raw", 7.0)], 4);
    let both = force(&mut hand, &[("ramp.0.value", 5.0), ("ramp.1.value", 6.0)], 4);
    let release = hand.send(hand.prepare_release(["raw", "ramp.1.value"]));
    let later = force(&mut hand, &[("ramp.1.value", 8.0)], 5);
    hand.step(0);
    assert!(hand.done.contains(&OrderOutcome::Released { transaction: alone }));
    assert_eq!(hand.operator.forces().count(), 0);
    let pending: Vec<_> = hand.operator.pending().map(|to_come| to_come.names).collect();
    assert_eq!(pending, [["ramp.0.value"], ["ramp.1.value"]]);
    let [entry] = hand.entries().try_into().unwrap();
    assert_eq!((entry.action, entry.transaction), (Action::Release, release));
    // What was in place ends at its value; what was to come leaves the signal as it is.
    let (raw, ramp) = (Value::Integer(3), Value::Number(9.0));
    let changes =
        entry.changes.into_iter().map(|change| (change.name, change.before, change.after));
    let mut changes: Vec<_> = changes.collect();
    changes.sort_by(|one, other| one.0.cmp(&other.0));
    let expected = [("ramp.1.value".to_owned(), ramp, None), ("raw".to_owned(), raw, Some(raw))];
    assert_eq!(changes, expected);
    for _ in 0..3 {
        hand.step(0);
    }
    assert_eq!((hand.value("raw"), hand.value("ramp.0.value")), (3.0, 5.0));
    assert_ne!(hand.value("ramp.1.value"), 6.0);
    // What was asked for after the release comes.
    hand.step(0);
    assert_eq!(hand.value("ramp.1.value"), 8.0);
    let forced: Vec<_> = hand.entries().into_iter().map(|entry| entry.transaction).collect();
    assert_eq!(forced, [both, later]);
}
