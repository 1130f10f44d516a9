//! Parameters that are set: in which cycle, and what is warned of.

use isochrone_control::desk::*;
use isochrone_model::*;

use crate::hand::Hand;
use crate::level::NODE;

#[test]
fn all_values_of_a_task_are_set_before_one_cycle_which_is_told_with_what_was_there_before() {
    let mut hand = Hand::new(NODE);
    hand.step(0);
    let number = hand.set([("scale.y1", 5.0.into()), ("ramp.0.setChangeRate", 20.0.into())]);
    assert_eq!(hand.value("scale.y1"), 0.0);
    hand.step(0);
    let [entry] = &hand.entries()[..] else { panic!() };
    assert_eq!((entry.transaction, &*entry.task, entry.cycle), (number, "fast", 1));
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
        entries.iter().map(|e| (e.transaction, &*e.task)).collect::<Vec<_>>(),
        [(number, "slow"), (number, "fast")]
    );
}

#[test]
fn a_set_waits_for_the_cycle_that_it_names_and_takes_the_next_if_that_is_missed() {
    let mut hand = Hand::new(NODE);
    for (at, runs, applied) in [(3, [1, 2, 3].as_slice(), 3), (9, &[7, 8, 11], 11)] {
        let request = RequestTerms { at: Some(at.into()), ..RequestTerms::default() };
        let prepared = hand.operator.set([("free.value", at as f64)], request, &[0, 0]);
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
    let request = RequestTerms { at: Some(4.into()), ..RequestTerms::default() };
    let prepared = hand.operator.set([("free.value", 1.0)], request, &[0, 0]);
    hand.next[1] = 4;
    hand.step(1);
    let number = hand.send(prepared);
    hand.step(1);
    assert_eq!(hand.done, [OrderOutcome::TooLate { transaction: number }]);
    assert_eq!(hand.value("free.value"), 25.0);
}

#[test]
fn a_value_that_a_block_refuses_from_then_on_is_warned_of_and_set() {
    let mut hand = Hand::new(NODE);
    let values = [("free.setChangeRate", Value::from(-1.0))];
    let prepared = hand.operator.set(values, RequestTerms::default(), &hand.next).unwrap();
    let [warning] = &prepared.warnings[..] else { panic!("{:?}", prepared.warnings) };
    assert!(warning.to_string().starts_with("block \"free\" will report 16#"), "{warning}");
    hand.send(Ok(prepared));
    hand.step(1);
    assert_eq!(hand.engines[1].block_errors(), 1);
    let good =
        hand.operator.set([("free.setChangeRate", 1.0)], RequestTerms::default(), &hand.next);
    assert!(good.unwrap().warnings.is_empty());
}

#[test]
fn what_many_blocks_will_report_is_told_once_with_their_number_and_the_first_names() {
    let ramps = "[[block]]\nname = \"many\"\ntype = \"LimRateOfChangeCI\"\ntask = \"slow\"\n\
                 count = 300\n[[block]]\nname = \"free\"";
    let hand = Hand::new(&NODE.replace("[[block]]\nname = \"free\"", ramps));
    let names: Vec<String> = (0..300).map(|n| format!("many.{n}.setChangeRate")).collect();
    let values = names.iter().map(|name| (name.as_str(), Value::from(-1.0)));
    let prepared = hand.operator.set(values, RequestTerms::default(), &hand.next).unwrap();
    let told = ValueWarning::sentences(&prepared.warnings);
    let [(name, sentence)] = &told[..] else { panic!("{told:?}") };
    assert_eq!(*name, "many.0");
    assert!(
        sentence.starts_with(
            "300 blocks (\"many.0\", \"many.1\", \"many.2\" and 297 more) will report 16#"
        ),
        "{sentence}"
    );
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
    let prepared = hand.operator.set(values, RequestTerms::default(), &hand.next).unwrap();
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
    let prepared = hand.operator.set(values, RequestTerms::default(), &hand.next).unwrap();
    assert_eq!(prepared.warnings, [], "it is reset with it");
    let hold = Hold::Seconds(1.0);
    let values = [("free.value", 2.0)];
    let prepared = hand.operator.force(values, hold, RequestTerms::default(), &hand.next).unwrap();
    let told: Vec<String> = prepared.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        ["\"free.value\" was forced already: the new force, with its end, replaces that one"]
    );
}

#[test]
fn what_is_written_is_read_for_its_signal_and_all_that_cannot_be_read_is_said() {
    let mut hand = Hand::new(NODE);
    let set = |hand: &Hand, values: &[(&'static str, &'static str)]| {
        hand.operator.set(values.iter().copied(), RequestTerms::default(), &hand.next)
    };
    let given =
        [("free.value", "16#10"), ("free.enDefaultOutValue", "TRUE"), ("free.callOB", "slow")];
    let prepared = set(&hand, &given);
    hand.send(prepared);
    hand.step(1);
    assert_eq!((hand.value("free.value"), hand.value("free.enDefaultOutValue")), (16.0, 1.0));
    let wrong = [
        ("free.value", "1,5"),
        ("free.setChangeRate", "5s"),
        ("free.callOB", "slwo"),
        ("free.enDefaultOutValue", "5"),
        ("nothing.x", "\u{1b}[2J"),
        ("scale.y1", "9\u{1b}[2J"),
    ];
    let refused = set(&hand, &wrong).unwrap_err();
    assert_eq!(refused.code, Code::InvalidParams, "whatever else is wrong");
    let said: Vec<_> = refused.findings.iter().map(Finding::to_string).collect();
    let expected = [
        "free.value: decimals have a point, not a comma: 1.5",
        "free.setChangeRate: \"5s\" has a unit, which only a TIME has; this is an LREAL: write the number alone, in 1/s",
        "free.callOB: there is no task \"slwo\"; give an OB number, calling task, or a task: fast, slow",
        "5 is no BOOL, as \"free.enDefaultOutValue\" is; write true or false",
    ];
    assert_eq!(said[..4], expected);
    assert!(said[4].starts_with("there is no signal \"nothing.x\""), "{}", said[4]);
    assert!(!said[5].contains('\u{1b}'), "{}", said[5]);
}

#[test]
fn a_set_in_some_cycles_is_due_so_many_after_the_one_that_runs() {
    let hand = Hand::new(NODE);
    let ask = |at| {
        let request = RequestTerms { at: Some(at), ..RequestTerms::default() };
        hand.operator.set([("free.value", 1.0), ("free.setChangeRate", 1.0)], request, &[10, 4])
    };
    let due = |at| ask(at).unwrap().cycles().collect::<Vec<_>>();
    assert_eq!(due(At::In(3)), [(1, 6)]);
    assert_eq!(due(At::Cycle(6)), [(1, 6)]);
    assert_eq!(ask(At::In(0)).unwrap_err().code, Code::TooLate);
    let far = ask(At::In(12)).unwrap_err().to_string();
    assert!(far.contains("cycle +12: it is more than 10 s ahead"), "{far}");
}
