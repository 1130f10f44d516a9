//! Variables: values that operators give.

use isochrone_control::desk::*;
use isochrone_engine::Pattern;
use isochrone_model::*;

use crate::hand::{Hand, draft};

/// A set point that two ramps of its task and one of another read, a switch, and a time that nobody may change.
const NODE: &str = r#"
[node]
name = "level"
control = "force"

[[protect]]
names = ["pause"]

[limits]
"c*" = [-10, 10]

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

[[variable]]
name = "setpoint"             # in m
initial = 20.0                # until somebody knows better
range = [0.0, 100.0]
task = "fast"

[[variable]]
name = "on"
type = "BOOL"
initial = false
task = "slow"

[[variable]]
name = "count"
type = "INT"
initial = 3
task = "slow"

[[variable]]
name = "pause"
type = "TIME"
initial = "T#1s500ms"
task = "fast"

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 2
in = { value = "setpoint", setChangeRate = inf }

[[block]]
name = "saw"
type = "SawTooth"
task = "fast"
in = { timeRange = "pause", incrementRange = 1, numberSteps = 3 }

[[block]]
name = "after"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "setpoint", setChangeRate = inf, enDefaultOutValue = "on", defaultOutValue = "count" }

[[output]]
service = "plant/fast"
task = "fast"
signals = ["ramp.0.delayedValue", "setpoint", "raw"]

[[output]]
service = "plant/slow"
task = "slow"
signals = ["after.delayedValue"]
"#;

fn refused(hand: &Hand, text: &str) -> Vec<String> {
    let refusal = hand.operator.change(draft(text), RequestTerms::default()).unwrap_err();
    refusal.findings.iter().map(|finding| finding.message.clone()).collect()
}

#[test]
fn a_variable_is_found_by_its_name_which_is_all_that_it_has() {
    let hand = Hand::new(NODE);
    let signals = hand.operator.signals();
    for (name, value_type, task) in
        [("setpoint", "LREAL", 0), ("pause", "TIME", 0), ("on", "BOOL", 1), ("count", "INT", 1)]
    {
        let signal = signals.find(name).unwrap();
        let found = (&*signal.name, signal.role, signal.value_type.as_str(), signal.task);
        assert_eq!(found, (name, Role::Variable, value_type, task));
        assert_eq!(signals.at(signal.task, signal.slot).unwrap(), signal);
    }
    let names = |pattern: &str| -> Vec<String> {
        let matches = signals.matching(&Pattern::new(pattern));
        matches.page(0, 100).map(|signal| signal.name).collect()
    };
    assert_eq!(names("*"), ["raw", "setpoint", "pause", "on", "count"]);
    assert_eq!(names("*.ok"), ["raw.ok"]);
    let all: Vec<String> = signals.all().page(0, 5).map(|signal| signal.name).collect();
    assert_eq!(all, ["raw", "raw.ok", "raw.age", "setpoint", "pause"]);
    for (name, help) in [
        ("setpont", "did you mean \"setpoint\"?"),
        ("setpoint.ok", "setpoint is a variable, which has its value alone: \"setpoint\""),
        ("setpoint.0.x", "setpoint is a variable"),
        ("raw.ok.x", "there is: raw.ok, raw.age"),
        ("zzz", "there is: count, on, pause, raw, setpoint, "),
    ] {
        let refusal = signals.find(name).unwrap_err();
        let found = refusal.findings[0].help.as_deref().unwrap();
        assert!(found.contains(help), "{name}: {found}");
    }
}

#[test]
fn all_that_read_a_variable_have_what_was_set_from_one_cycle_on() {
    let mut hand = Hand::new(NODE);
    hand.steps(2);
    let values = |hand: &Hand| {
        ["ramp.0.delayedValue", "ramp.1.delayedValue", "after.delayedValue"]
            .map(|name| hand.value(name))
    };
    assert_eq!(values(&hand), [20.0; 3]);
    let number = hand.set([("setpoint", 35.5.into())]);
    assert_eq!(hand.value("setpoint"), 20.0, "not before its cycle");
    hand.steps(1);
    assert_eq!((hand.value("setpoint"), values(&hand)), (35.5, [35.5; 3]));
    let [entry] = hand.entries().try_into().unwrap();
    assert_eq!((entry.action, &*entry.task, entry.cycle), (Action::Set, "fast", 2));
    let change = &entry.changes[0];
    assert_eq!((&*change.name, change.before), ("setpoint", 20.0.into()));
    assert_eq!((change.after, change.value_type.as_deref()), (Some(35.5.into()), Some("LREAL")));
    assert!(hand.operator.has_changed());
    hand.set([("on", true.into()), ("count", (-7).into())]);
    hand.steps(1);
    assert_eq!(values(&hand), [35.5, 35.5, -7.0]);
    let undo = hand.operator.undo(number, RequestTerms::default(), &hand.next);
    hand.send(undo);
    hand.steps(1);
    assert_eq!((hand.value("setpoint"), values(&hand)), (20.0, [20.0, 20.0, -7.0]));
}

#[test]
fn a_forced_variable_holds_and_has_what_was_set_meanwhile_when_it_is_released() {
    let mut hand = Hand::new(NODE);
    hand.steps(1);
    hand.force([("setpoint", 50.0.into())], Hold::UntilReleased);
    hand.steps(2);
    hand.set([("setpoint", 60.0.into())]);
    hand.steps(1);
    assert_eq!((hand.value("setpoint"), hand.value("after.delayedValue")), (50.0, 50.0));
    // The input of the first frame has had no sample.
    let flags = |hand: &Hand| [0, 1].map(|task| hand.engines[task].output_flags(0));
    assert_eq!(flags(&hand), [Flags::FORCED | Flags::SUBSTITUTE, Flags::FORCED]);
    hand.release("setpoint");
    hand.steps(1);
    assert_eq!((hand.value("setpoint"), hand.value("ramp.1.delayedValue")), (60.0, 60.0));
    assert_eq!(flags(&hand), [Flags::SUBSTITUTE, Flags::NONE]);
    assert_eq!(hand.engines[1].output_source_ns(0), 0);
}

#[test]
fn a_value_out_of_range_of_another_type_or_out_of_reach_is_refused() {
    let hand = Hand::new(NODE);
    let rows: [(&str, Value, &str); 6] = [
        ("setpoint", 100.5.into(), "100.5 is outside the limits of \"setpoint\", 0.0 to 100.0"),
        ("count", 11.into(), "11 is outside the limits of \"count\", -10.0 to 10.0"),
        ("setpoint", f64::NAN.into(), "NaN is no LREAL"),
        ("count", 1.5.into(), "1.5 is no INT"),
        ("on", 3.into(), "3 is no BOOL"),
        ("pause", 3.into(), "\"pause\" is protected"),
    ];
    for (name, value, message) in rows {
        let set = hand.operator.set([(name, value)], RequestTerms::default(), &hand.next);
        let terms = RequestTerms::default();
        let force = hand.operator.force([(name, value)], Hold::UntilReleased, terms, &hand.next);
        for refusal in [set.unwrap_err(), force.unwrap_err()] {
            assert!(refusal.message.contains(message), "{name}: {}", refusal.message);
        }
    }
    let signal = hand.operator.signals().find("setpoint").unwrap();
    assert_eq!(hand.operator.limits(&signal), Some([0.0, 100.0]));
}

#[test]
fn what_was_set_is_saved_as_initial_value_in_its_notation() {
    let text = NODE.replace("[[protect]]\nnames = [\"pause\"]\n", "");
    let mut hand = Hand::new(&text);
    hand.set([("setpoint", 7.5.into()), ("pause", 250.into())]);
    hand.set([("on", true.into())]);
    hand.steps(1);
    let saved = hand.operator.save(&text).unwrap();
    let expected = text
        .replace("initial = 20.0                #", "initial = 7.5                 #")
        .replace("T#1s500ms", "T#250ms")
        .replace("initial = false", "initial = true");
    assert_eq!(saved, expected);
    let again = Hand::new(&saved);
    assert_eq!((again.value("setpoint"), again.value("on"), again.value("count")), (7.5, 1.0, 3.0));
}

#[test]
fn a_change_adds_and_removes_variables_and_those_that_stay_keep_what_was_set() {
    let mut hand = Hand::new(NODE);
    hand.set([("setpoint", 35.0.into()), ("count", 5.into())]);
    hand.force([("on", true.into())], Hold::UntilReleased);
    hand.steps(1);
    // At another place of the image, beside others.
    let added = "[[variable]]\nname = \"rate\"\ninitial = 4.0\ntask = \"fast\"\n[[variable]]\nname = \"setpoint\"";
    let text = NODE.replacen("[[variable]]\nname = \"setpoint\"", added, 1).replace(
        "in = { value = \"setpoint\", setChangeRate = inf }",
        "in = { value = \"setpoint\", setChangeRate = \"rate\" }",
    );
    let summary = hand.change(&text);
    assert_eq!((&*summary.added, &*summary.removed), (&["rate".to_owned()][..], &[][..]));
    assert_eq!(summary.changed, ["ramp.*.setChangeRate"]);
    hand.steps(2);
    let values = ["setpoint", "count", "on", "rate", "after.defaultOutValue"];
    assert_eq!(values.map(|name| hand.value(name)), [35.0, 5.0, 1.0, 4.0, 5.0]);
    hand.set([("rate", 1.0.into())]);
    hand.release("on");
    hand.steps(1);
    assert_eq!((hand.value("on"), hand.value("ramp.0.setChangeRate")), (0.0, 1.0));
    let summary = hand.change(NODE);
    assert_eq!((&*summary.added, &*summary.removed), (&[][..], &["rate".to_owned()][..]));
    hand.steps(1);
    assert_eq!(["setpoint", "count"].map(|name| hand.value(name)), [35.0, 5.0]);
    assert!(hand.operator.signals().find("rate").is_err());
}

#[test]
fn another_initial_value_replaces_what_was_set_and_another_type_or_task_begins_anew() {
    let mut hand = Hand::new(NODE);
    hand.set([("setpoint", 35.0.into()), ("count", 5.into()), ("on", true.into())]);
    hand.steps(1);
    hand.entries();
    let text = NODE
        .replace("initial = 20.0 ", "initial = 21.0 ")
        .replace("type = \"INT\"", "type = \"LREAL\"")
        .replace("initial = false\ntask = \"slow\"", "initial = false\ntask = \"fast\"");
    let prepared = hand.operator.change(draft(&text), RequestTerms::default()).unwrap();
    let changed = &prepared.values()[0];
    assert_eq!((&*changed.name, &changed.before), ("setpoint", &Given::Value(35.0.into())));
    assert_eq!(changed.after, Given::Value(21.0.into()));
    let summary = hand.change(&text);
    // The wires from those that begin anew are others than before.
    assert_eq!(summary.changed, ["setpoint", "after.defaultOutValue", "after.enDefaultOutValue"]);
    assert_eq!(
        (summary.added.join(" "), summary.removed.join(" ")),
        ("on count".into(), "on count".into())
    );
    hand.steps(1);
    assert_eq!(["setpoint", "count", "on"].map(|name| hand.value(name)), [21.0, 3.0, 0.0]);
    let applied = hand.entries();
    let changes: Vec<_> = applied.iter().flat_map(|entry| &entry.changes).collect();
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert_eq!((changes[0].before, changes[0].after), (35.0.into(), Some(21.0.into())));
}

#[test]
fn a_change_is_refused_that_excludes_what_was_set_or_drops_what_is_forced_or_protected() {
    let mut hand = Hand::new(NODE);
    hand.set([("setpoint", 35.0.into())]);
    hand.force([("on", true.into())], Hold::UntilReleased);
    hand.steps(1);
    let without = |name: &str, instead: &str| {
        let begin = NODE.find(&format!("[[variable]]\nname = \"{name}\"")).unwrap();
        let end = begin + NODE[begin..].find("\n\n").unwrap();
        let text = NODE[..begin].to_owned() + &NODE[end..];
        text.replace(&format!("\"{name}\""), instead)
    };
    let narrow = NODE.replace("[0.0, 100.0]", "[0.0, 30.0]");
    assert_eq!(
        refused(&hand, &narrow),
        ["35.0 is outside the limits of \"setpoint\", 0.0 to 30.0"]
    );
    assert_eq!(
        refused(&hand, &without("on", "false")),
        ["\"on\" is forced, and the new configuration does not keep it"]
    );
    let unprotected = without("pause", "\"T#1s\"");
    let gone = refused(&hand, &unprotected.replace("names = [\"T#1s\"]", "names = [\"raw\"]"));
    assert!(gone[0].contains("[[protect]]"), "{gone:?}");
    let slower = refused(&hand, &NODE.replace("T#1s500ms", "T#2s"));
    assert!(slower[0].contains("\"pause\" is protected"), "{slower:?}");
    let told = hand
        .operator
        .change(draft(&NODE.replace("[0.0, 100.0]", "[0.0, 40.0]")), RequestTerms::default());
    assert_eq!(told.unwrap().summary().limits, ["setpoint: 0.0 to 100.0 -> 0.0 to 40.0"]);
}

#[test]
fn a_journal_repeats_what_was_done_to_variables_bit_for_bit() {
    let mut hand = Hand::new(NODE);
    let mut rows = Vec::new();
    for cycle in 0..8 {
        match cycle {
            2 => hand.set([("setpoint", 0.1.into()), ("on", true.into())]),
            3 => hand.force([("setpoint", 1.0.into())], Hold::Seconds(0.2)),
            4 => hand.set([("setpoint", (0.1 + 0.2).into())]),
            _ => 0,
        };
        hand.step(0);
        rows.push(hand.engines[0].image().to_vec());
    }
    let entries: Vec<Entry> = hand.entries().into_iter().filter(|it| it.task == "fast").collect();
    assert_eq!(entries.len(), 4, "{entries:?}");
    let plan = crate::hand::plan(NODE);
    let mut engine = isochrone_engine::TaskEngine::build(&plan).unwrap().remove(0);
    let mut replay = Replay::new(&plan);
    for (cycle, row) in (0..).zip(&rows) {
        engine.expire(cycle, drop);
        for entry in entries.iter().filter(|entry| entry.cycle == cycle) {
            replay.check(entry).unwrap();
            assert!(replay.apply(entry, &mut engine).unwrap().is_empty(), "{entry:?}");
        }
        engine.step(cycle);
        let bits = |image: &[f64]| image.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(engine.image()), bits(row), "cycle {cycle}");
    }
}
