//! Names that stand twice, or for nothing: where, and what would be right.

use isochrone_blocks::{CATALOGUE, EXPR};
use isochrone_engine::Problem::*;
use isochrone_engine::{Plan, Rules, Source};

use crate::findings::{VALID, assert_mistakes, assert_one};

#[test]
fn names_that_stand_twice_are_refused_where_they_stand_again() {
    assert_mistakes(
        r#"
        Duplicate: before [[block]]\nname = "scale"
            [[input]]\nname = «"start"\ntype = "INT" | input "start" is taken | give each input a name of its own
        Duplicate: instead of signals = ["scale.y", "ramp.0.delayedValue"]
            signals = ["raw"]\n[[output]]\nservice = «"plant/level"\nsignals = ["raw"] | service "plant/level" is taken | give each output a service of its own
            signals = ["raw", "scale.y", «"raw"] | signal "raw" is taken | name each signal of an output once
        Duplicate
            [[output]] -> [[block]]\nname = «"saw"\ntype = "SawTooth"\n[[output]] | block "saw" is taken | give each block a name of its own
        "#,
    );

    for (keys, message, help) in [
        ("name = «\"a\"", "task \"a\" is taken", "give each task a name of its own"),
        (
            "name = \"b\"\nob = «35",
            "ob \"35\" is taken",
            "give each task an ob of its own, or none",
        ),
    ] {
        let tasks = "[node]\nname = \"n\"\n[[task]]\nname = \"a\"\nperiod = \"1ms\"\nob = 35\n";
        let text = format!("{tasks}[[task]]\nperiod = \"1ms\"\n{keys}\n");
        assert_one(keys, &text, Duplicate, message, help);
    }
}

#[test]
fn a_reference_to_the_task_that_took_the_name_of_another_is_no_error_of_its_own() {
    let text = "[node]\nname = \"n\"\n[[task]]\nname = \"fast\"\nperiod = \"1ms\"\n\
                [[task]]\nname = «\"fast\"\nperiod = \"1s\"\n\
                [[block]]\nname = \"b\"\ntype = \"SawTooth\"\ntask = \"slow\"\n";
    assert_one("slow", text, Duplicate, "task \"fast\" is taken", "a name of its own");
}

#[test]
fn no_node_is_named_as_the_services_of_layouts_are() {
    assert_mistakes(
        r#"
        BadName
            name = "level" -> name = «"layout" | name "layout" is taken | choose another name
        "#,
    );
}

#[test]
fn the_services_of_the_nodes_themselves_are_no_outputs() {
    assert_mistakes(
        r#"
        BadName: instead of [[output]]\nservice = "plant/level"
            [[output]]\nservice = «"isochrone/x/telemetry"  | "isochrone/x/telemetry" cannot be an output's service | such as "plant/telemetry"
            [[output]]\nservice = «"isochrone/layout/level" | what nodes say of themselves                          | such as "plant/level"
            [[output]]\nservice = «"isochrone/"             | what nodes say of themselves                          | such as "plant/level"
        "#,
    );
}

#[test]
fn names_of_nothing_are_refused_with_the_nearest_that_exists() {
    let catalogue: Vec<&str> = CATALOGUE.iter().chain([&EXPR]).map(|it| it.name).collect();
    let to = "[[block]]\nname = \"b\"\ntype = «\"XYZ123\"\n[[output]]";
    assert_one(
        "block type: nothing near",
        &VALID.replace("[[output]]", to),
        UnknownBlockType,
        "there is no block type \"XYZ123\"",
        &format!(
            "there are {}: {}, \u{2026}; a block of your own needs the program that brings it \
             (examples/own_blocks)",
            catalogue.len(),
            catalogue[..12].join(", ")
        ),
    );
    assert_mistakes(
        r#"
        UnknownSource: value of startValue = "start"
            "strat" | there is no input "strat" | did you mean "start"?
            "q"     | there is no input "q"     | there is: raw, start
        UnknownSource: value of value = "scale.y"
            "scael.y" | there is no block "scael" | did you mean "scale"?
            "q.y"     | there is no block "q"     | there is: scale, ramp, saw
        UnknownTask
            name = "saw"   -> name = "saw"\ntask = «"fats" | there is no task "fats" | did you mean "fast"?
            name = "start" -> name = "start"\ntask = «"quick" | there is no task "quick" | there is: fast
            signals = [    -> signals = ["raw"]\n[[output]]\nservice = "s"\ntask = «"fst"\nsignals = [ | there is no task "fst" | did you mean "fast"?
        UnknownBlockType
            [[output]] -> [[block]]\nname = "b"\ntype = «"Sawtoth"\n[[output]] | there is no block type "Sawtoth" | did you mean "SawTooth"?
        UnknownSource
            "scale.y", "ramp -> «"scal.y", "ramp | there is no block "scal" | did you mean "scale"?
        "#,
    );
}

#[test]
fn a_pin_that_does_not_exist_or_is_of_the_other_direction_is_refused() {
    assert_mistakes(
        r#"
        UnknownPin: instead of setChangeRate = 10.0
            «setChangRate = 10.0  | LimRateOfChangeCI has no input pin "setChangRate" | did you mean "setChangeRate"?
            «setchangerate = 10.0 | no input pin                                      | did you mean "setChangeRate"?
            «delayedValue = 10.0  | no input pin "delayedValue"                       | delayedValue is an output pin; it cannot be set
        UnknownKey: after count = 3
            «enDefaultOutValue = true | [[block]] has no key "enDefaultOutValue" | enDefaultOutValue is a pin of LimRateOfChangeCI; write it in [block.in]
        UnknownPin: value of value = "scale.y"
            "scale.zz" | block "scale" (ScaleLinear) has no output pin "zz" | there is: y, error, status
            "scale.x1" | has no output pin "x1"                             | x1 is an input pin; a wire starts at an output pin
        UnknownPin: instead of "scale.y", "ramp
            «"scale.statsu", "ramp | no output pin "statsu" | did you mean "scale.status"?
            «"scale.y@prev", "ramp | no output pin "y@prev"
        UnknownKey
            [block.in]\nx = "raw"\nx1 = 0.0 -> «x1 = 0.0\n[block.in]\nx = "raw" | [[block]] has no key "x1" | x1 is a pin of ScaleLinear; write it in [block.in]
        "#,
    );
}

#[test]
fn a_service_name_that_the_transport_refuses_is_reported_with_its_reason() {
    let rules = Rules {
        service_name: |name| {
            if name.contains("level") { Err("levels are secret".into()) } else { Ok(()) }
        },
        ..Rules::default()
    };
    let source = Source { name: "level.toml".into(), text: VALID.into() };
    let findings = Plan::new(source, &rules).unwrap_err();
    assert_eq!(findings.all.len(), 1);
    let finding = &findings.all[0];
    assert_eq!(finding.problem, BadName);
    assert_eq!(
        finding.message,
        "\"plant/level\" cannot be the name of a service: levels are secret"
    );
    assert_eq!(&VALID[finding.span.clone()], "\"plant/level\"");
}

#[test]
fn the_catalogue_of_the_rules_is_the_one_that_counts() {
    let rules = Rules { catalogue: &[], ..Rules::default() };
    let source = Source { name: String::new(), text: VALID.into() };
    let findings = Plan::new(source, &rules).unwrap_err();
    let unknown = findings.all.iter().filter(|finding| finding.problem == UnknownBlockType);
    assert_eq!(unknown.count(), 3);
}
