//! `control`, `[[protect]]`, `[limits]` and pins of single instances: what they do, and mistakes in them.

use isochrone_model::Access;

use crate::findings::{VALID, assert_mistakes, plan, start_value};

const NODE: &str = "name = \"level\"\n";

#[test]
fn a_node_may_be_set_but_not_forced_unless_it_says_otherwise() {
    assert_eq!(plan(VALID).unwrap().control, Access::Set);
    for control in Access::ALL {
        let line = format!("{NODE}control = \"{}\"\n", control.as_str());
        let text = VALID.replacen(NODE, &line, 1);
        assert_eq!(plan(&text).unwrap().control, control);
    }
}

#[test]
fn mistakes_in_what_may_be_done_are_reported_where_they_stand() {
    assert_mistakes(
        r#"
        OutOfRange: before [[task]]
            [[protect]]\nnames = «[]                       | [[protect]] names is empty                                     | name at least one signal
            [limits]\n«"ramp.*.setChangeRate" = [0.0, 5.0] | ramp.0.setChangeRate is 10.0, outside of its limits 0.0 to 5.0 | change the value in [block.in]
            [limits]\n"ramp.*.setChangeRate" = «[5.0, 0.0] | 5.0 to 0.0 is no range                                         | [0.0, 50.0]
            [limits]\n"ramp.*.setChangeRate" = «[0.0, nan] | is no range
        WrongType: before [[task]]
            [[protect]]\nnames = «"raw"                   | [[protect]] names is an array of texts | write names = ["raw"]
            [limits]\n"ramp.*.setChangeRate" = «50.0      | is an array of two numbers             | = [0.0, 50.0]
            [limits]\n"ramp.*.setChangeRate" = «[0, 1, 2] | is an array of two numbers             | = [0.0, 50.0]
        UnknownSource: before [[task]]
            [[protect]]\nnames = [«"rmp.*.value"]           | there is no signal "rmp.*.value"          | did you mean "ramp.*.value"?
            [[protect]]\nnames = [«"scale.yy"]              | there is no signal "scale.yy"             | did you mean "scale.y"?
            [[protect]]\nnames = [«"ramp.value"]            | there is no signal "ramp.value"           | "ramp.*.value"
            [limits]\n«"scale.yMinn" = [0.0, 1.0]           | there is no signal "scale.yMinn"          | did you mean "scale.yMin"?
            [limits]\n«"Scale.yMin" = [0.0, 1.0]            | there is no signal "Scale.yMin"           | did you mean "scale.yMin"?
            [limits]\n«"ramp.setchangerate" = [0.0, 20.0]   | there is no signal "ramp.setchangerate"   | did you mean "ramp.*.setChangeRate"?
            [limits]\n«"ramp.1.setchangerate" = [0.0, 20.0] | there is no signal "ramp.1.setchangerate" | did you mean "ramp.1.setChangeRate"?
        Conflict: before [[task]]
            [limits]\n«"raw" = [0.0, 1.0]          | "raw" is no parameter that has limits              | limits are for input pins
            [limits]\n«"scale.x" = [0.0, 1.0]      | "scale.x" is no parameter that has limits          | no wire leads to
            [limits]\n«"saw.endlessSteps" = [0, 1] | "saw.endlessSteps" is no parameter that has limits | hold numbers
        OutOfRange
            [node]\nname = "level" -> [node]\nname = "level"\ncontrol = «"sett" | [node] control cannot be "sett" | did you mean "set"?
        MissingKey
            [[task]] -> «[[protect]]\n[[task]] | [[protect]] has no names | write names = ["pump.*"]
        "#,
    );
}

#[test]
fn limits_of_all_pins_of_a_block_bound_no_pin_that_means_the_calling_task() {
    let limits = "[limits]\n\"ramp.*.*\" = [0.0, 50.0]\n\"ramp.*.callOB\" = [1, 40]\n[[task]]";
    let limited = VALID.replacen("[[task]]", limits, 1);
    assert_eq!(plan(&limited).unwrap().limits.len(), 2);
    // One that is given is bounded as all others are.
    assert_mistakes(
        r#"
        OutOfRange: instead of setChangeRate = 10.0\n
            setChangeRate = 10.0\ncallOB = 35\n[limits]\n«"ramp.*.callOB" = [1, 29]\n | ramp.0.callOB is 35.0, outside of its limits 1.0 to 29.0 | change the value in [block.in]
        "#,
    );
}

#[test]
fn an_instance_can_differ_from_the_others_of_its_block() {
    let own = "setChangeRate = 10.0\n[block.in.1]\nsetChangeRate = 5.0\nvalue = 3.0\n\
               [block.in.2]\nvalue = \"ramp.0.delayedValue\"\n";
    let plan = plan(&VALID.replacen("setChangeRate = 10.0\n", own, 1)).unwrap();
    let task = &plan.tasks[0];
    let slot =
        |name: &str| (0..task.image.len()).find(|slot| plan.slot_name(0, *slot) == name).unwrap();
    let constants = [("ramp.0", 10.0), ("ramp.1", 5.0), ("ramp.2", 10.0)];
    for (instance, rate) in constants {
        assert_eq!(start_value(&plan, &format!("{instance}.setChangeRate")), rate);
    }
    assert_eq!(start_value(&plan, "ramp.1.value"), 3.0);
    let wires = task.banks.iter().flat_map(|bank| &bank.wires);
    let sources = |to: &str| -> Vec<String> {
        let to = slot(to) as u32;
        let wires = wires.clone().filter(|wire| wire.to == to);
        wires.map(|wire| plan.slot_name(0, wire.from as usize)).collect()
    };
    assert_eq!(sources("ramp.0.value"), ["scale.y"]);
    assert!(sources("ramp.1.value").is_empty());
    assert_eq!(sources("ramp.2.value"), ["ramp.0.delayedValue"]);
}

#[test]
fn mistakes_in_the_pins_of_an_instance_are_reported_where_they_stand() {
    assert_mistakes(
        r#"
        UnknownSource: after setChangeRate = 10.0
            [block.in.«3]\nvalue = 1.0  | there is no "ramp.3"  | the instances of ramp are 0 to 2
            [block.in.«01]\nvalue = 1.0 | there is no "ramp.01" | the instances of ramp are 0 to 2
        UnknownSource
            yMax = 1.75 -> yMax = 1.75\n[block.in.«0]\nyMax = 1.0 | there is no "scale.0" | scale is a single block; write its pins in [block.in]
        UnknownPin
            setChangeRate = 10.0 -> setChangeRate = 10.0\n[block.in.1]\n«valu = 1.0 | has no input pin "valu" | did you mean "value"?
        TypeMismatch
            setChangeRate = 10.0 -> setChangeRate = 10.0\n[block.in.1]\nvalue = «true | true is no LREAL | write a number
        "#,
    );
}

#[test]
fn an_instance_that_reports_an_error_from_its_first_call_is_named() {
    let own = "setChangeRate = 10.0\n[block.in.1]\nsetChangeRate = -1.0\n";
    let plan = plan(&VALID.replacen("setChangeRate = 10.0\n", own, 1)).unwrap();
    let [warning] = &plan.warnings[..] else { panic!("{:?}", plan.warnings) };
    assert!(warning.message.starts_with("block \"ramp.1\" reports 16#"), "{warning}");
}
