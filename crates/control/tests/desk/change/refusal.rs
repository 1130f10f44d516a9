//! What cannot be changed while a node runs.

use isochrone_control::desk::*;
use isochrone_model::*;

use super::refused;
use crate::hand::{Hand, draft};
use crate::level::RAMPS;

#[test]
fn a_forced_signal_must_be_in_the_new_configuration() {
    let mut hand = Hand::new(RAMPS);
    hand.force([("ramp.2.delayedValue", 2.0.into())], Hold::UntilReleased);
    hand.steps(1);
    let text = RAMPS.replace("count = 3", "count = 2");
    assert_eq!(
        refused(&hand, &text),
        ["\"ramp.2.delayedValue\" is forced, and the new configuration does not keep its block"]
    );
    let refusals = hand.operator.change(draft(&text), RequestTerms::default()).unwrap_err();
    assert_eq!(refusals.code, Code::CannotChange);
}

#[test]
fn each_thing_that_cannot_be_changed_online_is_named() {
    let hand = Hand::new(RAMPS);
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
        (
            "\"1s\"\n",
            "\"1s\"\npriority = 7\n",
            "task \"slow\"",
            "its priority is not set and would be 7",
        ),
        (
            "\"100ms\"\n",
            "\"100ms\"\nfollow = { service = \"plant/raw\", within = \"9ms\" }\n",
            "task \"fast\"",
            "its follow is not set and would be { service = \"plant/raw\", within = \"9ms\" }",
        ),
        (
            "\"1s\"\n",
            "\"1s\"\nwake = \"hybrid\"\nmargin = \"50us\"\n",
            "task \"slow\"",
            "its wake is sleep and would be hybrid (margin 50us)",
        ),
        (
            "\"1s\"\n",
            "\"1s\"\ncpu = \"auto\"\n",
            "task \"slow\"",
            "its cpu is any and would be auto",
        ),
        (
            "\"1s\"\n",
            "\"1s\"\non_overrun = { misses = 3, cycles = 10 }\n",
            "task \"slow\"",
            "its on_overrun is not set and would be { misses = 3, cycles = 10 }",
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
        ("default = 3.0", "default = 3.0\nunit = \"m\"", "input \"raw\"", "its unit would change"),
        (
            "count = 3",
            "count = 3\nunit = \"m\"",
            "output \"plant/ramp\"",
            "the unit of ramp.0.delayedValue would change",
        ),
        (
            "\"plant/after\"",
            "\"plant/after\"\nunit = \"m\"",
            "output \"plant/after\"",
            "the unit of after.delayedValue would change",
        ),
        ("\"plant/after\"", "\"plant/b\"", "output \"plant/after\"", "it would be gone"),
    ];
    for (from, to, what, difference) in rows {
        assert!(RAMPS.contains(from), "{from}");
        let findings = refused(&hand, &RAMPS.replace(from, to));
        let expected = format!("{what} cannot be changed while the node runs: {difference}");
        assert!(findings.contains(&expected), "{expected}: {findings:?}");
    }
    let both = RAMPS.replace("\"100ms\"", "\"50ms\"").replace("\"plant/after\"", "\"plant/b\"");
    assert_eq!(refused(&hand, &both).len(), 3, "all of them are named");
    let new = refused(&hand, &format!("{RAMPS}\n[[task]]\nname = \"third\"\nperiod = \"1s\"\n"));
    assert_eq!(new, ["task \"third\" cannot be changed while the node runs: it would be new"]);
}

#[test]
fn units_that_no_output_publishes_and_comments_may_change() {
    let hand = Hand::new(RAMPS);
    let text = RAMPS
        .replace("default = 3.0", "default = 3.0\ncomment = \"Transmitter\"")
        .replace("count = 3", "count = 3\nunits = { setChangeRate = \"m/s\" }")
        .replace("name = \"guard\"", "name = \"guard\"\nunit = \"m\"")
        .replace("\"plant/ramp\"", "\"plant/ramp\"\ncomment = \"For the historian\"");
    assert!(hand.operator.change(draft(&text), RequestTerms::default()).is_ok());
}

#[test]
fn what_is_protected_stays_as_it_is() {
    let hand = Hand::new(RAMPS);
    let protected = |text: &str| {
        let refusals = hand.operator.change(draft(text), RequestTerms::default()).unwrap_err();
        assert_eq!(refusals.code, Code::Forbidden);
        refusals.findings[0].name.clone()
    };
    let raw = "value = \"raw\", setChangeRate = 10.0";
    assert_eq!(
        protected(&RAMPS.replace(raw, "value = \"raw\", setChangeRate = 9.0")),
        "guard.setChangeRate"
    );
    assert_eq!(protected(&RAMPS.replace(raw, "value = 1.0, setChangeRate = 10.0")), "guard.value");
}

#[test]
fn only_a_node_that_may_be_forced_can_be_changed() {
    let hand = Hand::new(&RAMPS.replace("control = \"force\"", "control = \"set\""));
    let text = RAMPS.replace("control = \"force\"", "control = \"set\"");
    let refusals = hand.operator.change(draft(&text), RequestTerms::default()).unwrap_err();
    assert_eq!(refusals.code, Code::Forbidden);
    assert!(refusals.to_string().contains("changing the configuration"), "{refusals}");
}
