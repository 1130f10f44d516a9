//! Running values, written into the configuration.

use isochrone_control::desk::*;

use crate::hand::Hand;
use crate::level::NODE;

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
    let prepared = hand.operator.undo(number, RequestTerms::default(), &hand.next);
    hand.send(prepared);
    hand.step(0);
    assert!(!hand.operator.save(&text).unwrap().contains("setChangeRate = 20.0"));
}

#[test]
fn saved_times_and_numbers_with_a_base_keep_their_notation() {
    let saw = |time_range: &str, steps: &str| {
        let saw = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\ntask = \"fast\"";
        format!("{NODE}\n{saw}\nin = {{ timeRange = {time_range}, numberSteps = {steps} }}\n")
    };
    for (before, after) in [
        (("\"T#100ms\"", "\"16#0A\""), ("\"T#500ms\"", "\"16#14\"")),
        (("\"100ms\"", "\"2#1010\""), ("\"500ms\"", "\"2#10100\"")),
        (("100", "10"), ("500", "20")),
    ] {
        let text = saw(before.0, before.1);
        let mut hand = Hand::new(&text);
        hand.set([("saw.timeRange", 500.into()), ("saw.numberSteps", 20.into())]);
        hand.step(0);
        hand.step(1);
        assert_eq!(hand.operator.save(&text).unwrap(), saw(after.0, after.1));
    }
}

#[test]
fn running_values_are_not_saved_into_a_configuration_of_another_node() {
    let mut hand = Hand::new(NODE);
    hand.set([("free.value", 7.5.into())]);
    hand.step(1);
    let other = NODE.replace("\"free\"", "\"other\"");
    let why = |text: &str| hand.operator.save(text).unwrap_err().to_string();
    assert_eq!(
        why(&other),
        "the configuration has no place for \"free.value\", so it is not the one that the node runs"
    );
    assert!(why("= 1").starts_with("the configuration is not TOML: "), "{}", why("= 1"));
}
