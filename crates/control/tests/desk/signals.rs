//! The signals of a node: their names, their roles, and patterns that stand for many.

use isochrone_control::desk::*;
use isochrone_engine::Pattern;
use isochrone_engine::{Plan, Rules, Source};
use isochrone_model::*;

use crate::hand::Hand;
use crate::level::NODE;

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
        ("scal", "did you mean \"scale\"? it is a block; there is: scale."),
        ("", "there is: raw, "),
        ("zzz.zzz.zzz.zzz", "there is: raw, "),
    ];
    for (name, help) in rows {
        let refusal = hand.operator.signals().find(name).unwrap_err();
        let found = refusal.findings[0].help.as_deref().unwrap();
        assert!(found.contains(help), "{name}: {found}");
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
    assert!(names("ramp..*").is_empty());
    assert_eq!(names("ramp.**.value"), names("ramp.*.value"));
    let all = signals.matching(&Pattern::new("*.*.*"));
    let pages = (0..all.total()).step_by(3).flat_map(|offset| all.page(offset, 3));
    assert!(pages.map(|s| s.name).eq(all.page(0, all.total()).map(|s| s.name)));
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
