//! Units and comments: where they are found, and mistakes in them.

use isochrone_engine::Problem;

use crate::findings::{VALID, assert_mistakes, assert_one, plan};

/// [`VALID`] with a unit at everything that can have one.
fn labelled() -> String {
    VALID
        .replace("channel = 7\n", "channel = 7\nunit = \"counts\"\ncomment = \"LT-101\"\n")
        .replace(
            "type = \"ScaleLinear\"\n",
            "type = \"ScaleLinear\"\nunit = \"m\"\nunits = { y1 = \"cm\" }\ncomment = \"Level\"\n",
        )
        .replace("service = \"plant/level\"\n", "service = \"plant/level\"\nunit = \"km\"\n")
}

/// The units of signals of the tasks by name.
fn units(text: &str, names: &[&str]) -> Vec<String> {
    let plan = plan(text).unwrap();
    let unit = |name: &&str| {
        let slots = plan.tasks.iter().enumerate();
        let mut slots =
            slots.flat_map(|(task, of)| (0..of.image.len()).map(move |slot| (task, slot)));
        let (task, slot) =
            slots.find(|(task, slot)| plan.slot_name(*task, *slot) == *name).unwrap();
        plan.slot_unit(task, slot).to_owned()
    };
    names.iter().map(unit).collect()
}

#[test]
fn a_unit_is_that_of_the_file_or_else_of_the_block_type() {
    let names =
        ["raw", "raw.ok", "raw.age", "start", "scale.y", "scale.y1", "scale.x", "scale.error"];
    let expected = ["counts", "", "s", "", "m", "cm", "", ""];
    assert_eq!(units(&labelled(), &names), expected);
    assert_eq!(units(VALID, &["raw", "ramp.1.setChangeRate", "ramp.1.value"]), ["", "1/s", ""]);
    // A TIME is shown with its own.
    assert_eq!(units(VALID, &["saw.timeRange"]), [""]);
    let of_all = VALID.replace("count = 3\n", "count = 3\nunits = { setChangeRate = \"m/s\" }\n");
    assert_eq!(units(&of_all, &["ramp.0.setChangeRate", "ramp.2.setChangeRate"]), ["m/s"; 2]);
}

#[test]
fn an_output_has_the_units_of_its_signals_and_its_own_for_those_without_any() {
    let plan = plan(&labelled()).unwrap();
    let output = plan.tasks.iter().flat_map(|task| &task.outputs).next().unwrap();
    let units: Vec<&str> = output.signals.iter().map(|signal| signal.unit.as_str()).collect();
    assert_eq!(units, ["m", "km"]);
    assert_eq!(plan.labels("scale").unwrap().comment, "Level");
    assert_eq!(plan.labels("ramp.1"), None);
    let input = plan.tasks.iter().flat_map(|task| &task.inputs).next().unwrap();
    assert_eq!((input.name.as_str(), input.comment.as_str()), ("raw", "LT-101"));
}

#[test]
fn mistakes_in_units_and_comments_are_reported_where_they_stand() {
    assert_mistakes(
        r#"
        OutOfRange: after channel = 7
            unit = «""                    | [[input]] unit is empty                                | leave it out
            unit = «"  "                  | [[input]] unit is empty
            unit = «" m"                  | [[input]] unit begins or ends with a blank             | compared byte for byte
            unit = «"m\u001b[2J"          | [[input]] unit "m\u001b[2J" has a control character
            comment = «"a\u202eb"         | [[input]] comment "a\u202eb" has a control character | write one line
            comment = «""                 | [[input]] comment is empty
        WrongType: after channel = 7
            unit = «5                     | [[input]] unit is a text, not an integer
            comment = «["a"]              | [[input]] comment is a text, not an array
        Conflict: after type = "INT"
            unit = "m"\ntask = "fast"\n[[input]]\nname = "t"\ntype = "TIME"\nunit = «"ms" | [[input]] unit is not for TIME | a TIME is written with its own
        Conflict: after type = "ScaleLinear"
            unit = «"m"\nunits = { y = "m" } | [[block]] has two units for y                     | keep unit or units
            units = { «error = "m" }      | pin "error" is a BOOL                                  | a BOOL or a WORD has none
        UnknownPin: after type = "ScaleLinear"
            units = { «yMinn = "m" }      | ScaleLinear has no pin "yMinn"                         | did you mean "yMin"?
        OutOfRange: after type = "ScaleLinear"
            units = { y = «"" }           | [block.units] y is empty
        WrongType: after type = "ScaleLinear"
            units = { y = «1 }            | [block.units] y is a text, such as "m"
        UnknownKey: after service = "plant/level"
            «units = { y = "m" }          | [[output]] has no key "units"                          | did you mean "unit"?
        "#,
    );
    let long =
        VALID.replace("channel = 7\n", &format!("channel = 7\nunit = «\"{}\"\n", "m".repeat(256)));
    assert_one("long", &long, Problem::OutOfRange, "[[input]] unit has 256 bytes", "at most 255");
}

#[test]
fn the_unit_of_an_output_that_no_signal_takes_is_an_error() {
    let other = labelled()
        .replace(", \"ramp.0.delayedValue\"", "")
        .replace("unit = \"km\"", "unit = «\"km\"");
    let message = "[[output]] unit is \"km\", and scale.y is in \"m\"";
    assert_one("other", &other, Problem::Conflict, message, "nothing is converted");
    let none = VALID.replace(
        "signals = [\"scale.y\", \"ramp.0.delayedValue\"]",
        "signals = [\"scale.error\"]\nunit = «\"m\"",
    );
    let message = "none of its signals can have one";
    assert_one("none", &none, Problem::Conflict, message, "a BOOL or a WORD has none");
    let announced = VALID.replace("signals = [\"scale.y\",", "unit = «\"m\"\nsignals = [\"raw\",");
    let message = "[[output]] unit \"m\" would also be that of input raw, whose publisher may announce another";
    assert_one("announced", &announced, Problem::Conflict, message, "give the [[input]] a unit");
    let same = other.replace("«\"km\"", "\"m\"");
    assert!(plan(&same).is_ok());
}
