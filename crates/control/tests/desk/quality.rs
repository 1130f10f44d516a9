//! What signals that are read are worth.

use isochrone_control::desk::{OrderOutcome, RequestTerms};
use isochrone_engine::InputReading;
use isochrone_model::{Flags, Hold, Role, Value};

use crate::hand::{Hand, draft};
use isochrone_testing::two_tasks::{TASKS, input, output, ramp};

const PUBLISHED: [(&str, &str); 10] = [
    ("fast", "level"),
    ("fast", "ramp.delayedValue"),
    ("fast", "first.delayedValue"),
    ("fast", "second.delayedValue"),
    ("fast", "second.status"),
    ("fast", "alone.delayedValue"),
    ("slow", "late.delayedValue"),
    ("slow", "free.delayedValue"),
    ("fast", "pace"),
    ("slow", "paced.delayedValue"),
];

/// Two tasks that read each other, a loop within one of them, blocks that can fail, a variable that both read, and
/// what depends on nothing. Each signal has an output of its own. The first ramp has this rate.
fn plant(rate: f64) -> String {
    let entries = [
        input("level", "fast"),
        input("wish", "fast"),
        ramp("ramp", "fast", "level", rate),
        ramp("first", "fast", "second.delayedValue@prev", "ramp.delayedValue"),
        "[[variable]]\nname = \"pace\"\ninitial = 1.0\ntask = \"fast\"\n".to_owned(),
        ramp("second", "fast", "first.delayedValue", "pace"),
        ramp("alone", "fast", 3.0, "late.delayedValue"),
        ramp("late", "slow", "wish", "second.delayedValue"),
        ramp("free", "slow", 1.0, 1.0),
        ramp("paced", "slow", 1.0, "pace"),
    ];
    let outputs = PUBLISHED.map(|(task, signal)| output(task, &[signal]));
    TASKS.to_owned() + &entries.concat() + &outputs.concat()
}

fn give(hand: &mut Hand, flags: [Flags; 2]) {
    for (input, flags) in flags.into_iter().enumerate() {
        let reading =
            InputReading { value: 1.0, ok: flags.is_empty(), age_s: 0.0, source_ns: 1, flags };
        assert!(hand.engines[0].read_input(input, &reading));
    }
}

/// What is said of these signals after a cycle of each task.
fn read(hand: &mut Hand, names: &[&str]) -> Vec<(String, Flags)> {
    hand.done.clear();
    let (prepared, total) = hand.get(names.iter().copied(), 0, usize::MAX).unwrap();
    assert!(total >= names.len());
    hand.send(Ok(prepared));
    (0..2).for_each(|task| hand.step(task));
    let readings = hand.done.drain(..).filter_map(|done| match done {
        OrderOutcome::Read(reading) => Some(reading),
        _ => None,
    });
    let one = |reading: isochrone_control::desk::Reading| {
        let names = reading.values.into_iter().map(|(name, _)| name);
        names.zip(reading.quality.expect("nothing changed meanwhile")).collect::<Vec<_>>()
    };
    readings.flat_map(one).collect()
}

/// Of each published signal what is said of it, and what its frame says.
#[track_caller]
fn assert_as_frames_say(hand: &mut Hand, case: &str) {
    let read = read(hand, &PUBLISHED.map(|(_, signal)| signal));
    for (task, name) in ["fast", "slow"].into_iter().enumerate() {
        let of_task = PUBLISHED.iter().filter(|(of, _)| *of == name);
        for (output, (_, signal)) in of_task.enumerate() {
            let said = read.iter().find(|(known, _)| known == signal).unwrap().1;
            let frame = hand.engines[task].output_flags(output);
            assert_eq!(said, frame, "{signal}, {case}: {said} is said, the frame has {frame}");
        }
    }
}

#[test]
fn a_signal_has_the_flags_of_a_frame_with_it_alone_whatever_is_stale_or_forced() {
    let mut hand = Hand::new(&plant(10.0));
    let forceable: Vec<String> = {
        let signals = hand.operator.signals();
        let all = (0..2).flat_map(|task| (0..200).filter_map(move |slot| signals.at(task, slot)));
        // A block that says by force that it fails has none of the flags of one that does.
        let is_told = |name: &str| name.ends_with("tatus") || name.ends_with("error");
        let all = all.filter(|one| one.role != Role::Age && !is_told(&one.name));
        all.map(|one| one.name).collect()
    };
    assert!(forceable.len() > 30, "{forceable:?}");
    for level in [Flags::NONE, Flags::STALE, Flags::UPSTREAM | Flags::FORCED] {
        for wish in [Flags::NONE, Flags::SUBSTITUTE] {
            give(&mut hand, [level, wish]);
            hand.steps(3);
            assert_as_frames_say(&mut hand, &format!("{level} and {wish}"));
        }
    }
    for name in &forceable {
        give(&mut hand, [Flags::STALE, Flags::NONE]);
        let value = match hand.operator.signals().find(name).unwrap().value_type.as_str() {
            "BOOL" => true.into(),
            "LREAL" => 2.0.into(),
            _ => Value::Integer(2),
        };
        hand.force([(name, value)], Hold::UntilReleased);
        hand.steps(3);
        assert_as_frames_say(&mut hand, &format!("{name} is forced"));
        hand.release(name);
        hand.steps(3);
        assert_as_frames_say(&mut hand, &format!("{name} is released"));
    }
}

#[test]
fn a_block_in_error_marks_its_outputs_and_all_that_is_computed_from_them() {
    let mut hand = Hand::new(&plant(10.0));
    give(&mut hand, [Flags::NONE; 2]);
    hand.steps(3);
    hand.set([("ramp.setChangeRate", (-1.0).into())]);
    hand.steps(3);
    assert_as_frames_say(&mut hand, "ramp reports an error");
    let said = read(&mut hand, &["ramp.delayedValue", "ramp.value", "first.value", "free.*"]);
    let flags = |name: &str| said.iter().find(|(known, _)| known == name).unwrap().1;
    assert_eq!(flags("ramp.delayedValue"), Flags::ERROR);
    assert_eq!(flags("ramp.value"), Flags::NONE, "what it reads is good");
    assert_eq!(flags("first.value"), Flags::ERROR, "by the wire of the cycle before");
    assert!(said.iter().filter(|(name, _)| name.starts_with("free")).all(|(_, f)| f.is_empty()));
}

#[test]
fn wires_take_the_flags_of_their_source_and_parameters_and_the_worth_of_inputs_have_none() {
    let mut hand = Hand::new(&plant(10.0));
    give(&mut hand, [Flags::STALE, Flags::NONE]);
    hand.steps(3);
    let names =
        ["ramp.value", "ramp.setChangeRate", "level", "level.ok", "level.age", "late.value"];
    let said = read(&mut hand, &names);
    let of = |name: &str| said.iter().find(|(known, _)| known == name).unwrap().1.to_string();
    assert_eq!(names.map(of), ["STALE", "", "STALE", "", "", ""]);
}

#[test]
fn while_another_configuration_is_on_its_way_nothing_is_said() {
    let mut hand = Hand::new(&plant(10.0));
    let before = hand.get(["ramp.delayedValue"], 0, 1).unwrap().0;
    hand.send(Ok(before));
    let prepared = hand.operator.change(draft(&plant(20.0)), RequestTerms::default()).unwrap();
    let (_, replacements) = hand.operator.send_change(prepared, &hand.next).unwrap();
    hand.replacements = replacements.into_iter().map(Some).collect();
    let during = hand.get(["ramp.delayedValue"], 0, 1).unwrap().0;
    hand.send(Ok(during));
    hand.steps(1);
    let read: Vec<_> = hand
        .done
        .drain(..)
        .filter_map(|done| match done {
            OrderOutcome::Read(reading) => Some(reading.quality),
            _ => None,
        })
        .collect();
    assert_eq!(read, [None, None]);
    assert_eq!(self::read(&mut hand, &["ramp.delayedValue"]).len(), 1, "and then again it is");
}
