//! Wires: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;

use crate::findings::{assert_mistakes, assert_one, plan};

#[test]
fn a_pin_without_a_default_must_be_connected() {
    assert_mistakes(
        r#"
        MissingPin: instead of name = "scale"\ntype = "ScaleLinear"\ntask = "fast"\n[block.in]\nx = "raw"\n
            name = «"scale"\ntype = "ScaleLinear"\n[block.in]\n | pin x of block "scale" is not connected | set them in [block.in]
        MissingPin: before [[output]]
            [[block]]\nname = «"b"\ntype = "ScaleLinear"\nin = { x = 1.0, x1 = 0.0, x2 = 1.0, y1 = 0.0, y2 = 1.0 } | pins yMin, yMax of block "b" are not connected | set them in [block.in]
        "#,
    );
}

#[test]
fn a_wire_joins_pins_of_one_type_and_int_feeds_lreal() {
    let sources =
        [("r", "LREAL"), ("i", "INT"), ("b", "BOOL"), ("t", "TIME"), ("ramp.status", "WORD")];
    let pins = [
        ("LimRateOfChangeCI", "value", "LREAL"),
        ("SawTooth", "startValue", "INT"),
        ("SawTooth", "reset", "BOOL"),
        ("SawTooth", "timeRange", "TIME"),
        ("LimRateOfChangeCI", "callOB", "INT"),
    ];
    for (source, source_type) in sources {
        for (block_type, pin, pin_type) in pins {
            let marked = format!(
                "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n\
                 [[input]]\nname = \"r\"\n\
                 [[input]]\nname = \"i\"\ntype = \"INT\"\n\
                 [[input]]\nname = \"b\"\ntype = \"BOOL\"\n\
                 [[input]]\nname = \"t\"\ntype = \"TIME\"\n\
                 [[block]]\nname = \"ramp\"\ntype = \"LimRateOfChangeCI\"\n\
                 [[block]]\nname = \"x\"\ntype = \"{block_type}\"\nin.{pin} = «\"{source}\"\n"
            );
            if source_type == pin_type || (source_type, pin_type) == ("INT", "LREAL") {
                assert!(plan(&marked.replace('«', "")).is_ok(), "{source_type} to {pin_type}");
            } else {
                let message =
                    format!("\"{source}\" is {source_type}, but pin {pin} takes {pin_type}");
                assert_one(source, &marked, TypeMismatch, &message, "INT also feeds LREAL");
            }
        }
    }
}

#[test]
fn pins_that_lgf_spells_otherwise_are_named() {
    assert_mistakes(
        r#"
        UnknownPin
            value = "scale.y"     -> value = «"scale.Ret_Val"    | no output pin "Ret_Val"           | what LGF calls Ret_Val is pin "y" here
            "ramp.0.delayedValue" -> «"ramp.0.subFunctionStatus" | no output pin "subFunctionStatus" | is pin "subfunctionStatus" here
        "#,
    );
}

#[test]
fn a_wire_must_say_which_of_several_instances_and_only_one_that_exists() {
    assert_mistakes(
        r#"
        UnknownSource: instead of "ramp.0.delayedValue"
            «"ramp.delayedValue"     | which of the 3 instances of ramp                          | name each instance: "ramp.0.delayedValue", "ramp.1.delayedValue" …
            «"ramp[2].delayedValue"  | there is no block "ramp[2]"                               | write "ramp.2.delayedValue"
            «"raw@prev"              | "raw" is an input, which has no value of the cycle before | an input has no @prev; write "raw"
            «"ramp.3.delayedValue"   | there is no "ramp.3"                                      | ramp.0 to ramp.2
            «"ramp.-1.delayedValue"  | there is no "ramp.-1"                                     | ramp.0 to ramp.2
            «"scale.1.y"             | there is no "scale.1"                                     | scale is a single block: "scale.y"
            «"scale"                 | there is no input "scale"                                 | such as "scale.y"
            «"ramp.{i}.delayedValue" | there is no "ramp.{i}"                                    | name each instance: "ramp.0.delayedValue"
        UnknownSource: value of value = "scale.y"
            "scale[0].y" | there is no block "scale[0]" | write "scale.y"
            "raw{i}"     | there is no input "raw0"     | did you mean "raw"?
        UnknownSource: before [[output]]
            [[block]]\nname = "four"\ncount = 4\ntype = "LimRateOfChangeCI"\nin.value = «"ramp.{i}.delayedValue" | there is no "ramp.3", which instance 3 of four is wired to | ramp.0 to ramp.2
        UnknownSource
            x = "raw" -> x = «"ramp.{i}.delayedValue" | "ramp.{i}.delayedValue" has {i}, the number of the reading instance, and scale has no count | write the number that is meant, as in "ramp.0.delayedValue", or give scale a count
            startValue = "start" -> startValue = «"ramp.delayedValue" | which of the 3 instances of ramp | "ramp.{i}.delayedValue" the one with the reader's number
        "#,
    );
}

#[test]
fn the_value_of_the_cycle_before_exists_only_behind_a_blocks_pin() {
    assert_mistakes(
        r#"
        UnknownSource
            x = "raw" -> x = «"raw@prev" | "raw" is an input, which has no value of the cycle before | @prev goes behind
        UnknownPin
            x = "raw" -> x = «"scale.yy@prev" | no output pin "yy"
        "#,
    );
}
