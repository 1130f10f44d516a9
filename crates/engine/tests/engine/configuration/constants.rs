//! Constants: what is wrong, where, and what would be right.

use isochrone_blocks::Ob;
use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_one, assert_rows, plan};

#[test]
fn constants_of_another_type_or_out_of_range_are_refused() {
    let (rate, start) = ("setChangeRate = 10.0", "startValue = \"start\"");
    let (time, endless) = ("timeRange = 50", "endlessSteps = true");
    assert_rows(&[
        (
            "NaN",
            rate,
            "setChangeRate = «nan",
            OutOfRange,
            "setChangeRate cannot be NaN",
            "inf and -inf",
        ),
        (
            "-NaN",
            rate,
            "setChangeRate = «-nan",
            OutOfRange,
            "setChangeRate cannot be NaN",
            "inf and -inf",
        ),
        (
            "true for LREAL",
            rate,
            "setChangeRate = «true",
            TypeMismatch,
            "true is no LREAL",
            "a number such as 1.0",
        ),
        (
            "array",
            rate,
            "setChangeRate = «[1]",
            WrongType,
            "takes a number, true or false, or a wire, not array",
            "",
        ),
        (
            "hexadecimal beyond 64 bits",
            rate,
            "setChangeRate = «0x1E99999999999999999",
            WrongType,
            "setChangeRate",
            "",
        ),
        (
            "decimal for INT",
            start,
            "startValue = «1.5",
            TypeMismatch,
            "1.5 is no INT",
            "a whole number",
        ),
        (
            "whole decimal for INT",
            start,
            "startValue = «1.0",
            TypeMismatch,
            "1.0 is no INT",
            "a whole number",
        ),
        (
            "true for INT",
            start,
            "startValue = «true",
            TypeMismatch,
            "true is no INT",
            "a whole number",
        ),
        (
            "too large for INT",
            start,
            "startValue = «32768",
            OutOfRange,
            "32768 does not fit",
            "INT holds -32768 to 32767",
        ),
        (
            "too small for INT",
            start,
            "startValue = «-32769",
            OutOfRange,
            "-32769 does not fit",
            "INT holds",
        ),
        (
            "decimal for TIME",
            time,
            "timeRange = «0.5",
            TypeMismatch,
            "0.5 is no TIME",
            "whole milliseconds",
        ),
        (
            "too large for TIME",
            time,
            "timeRange = «2147483648",
            OutOfRange,
            "does not fit",
            "TIME holds",
        ),
        (
            "text without a unit for TIME",
            time,
            "timeRange = «\"50\"",
            OutOfRange,
            "pin timeRange \"50\": the unit is missing: \"50ms\"?",
            "100, \"100ms\" or \"T#100ms\"",
        ),
        (
            "fractions for TIME",
            time,
            "timeRange = «\"T#0.5ms\"",
            OutOfRange,
            "fractions of a millisecond",
            "whole milliseconds",
        ),
        (
            "another prefix for TIME",
            time,
            "timeRange = «\"S5T#1s\"",
            OutOfRange,
            "begins with T# or TIME#, not S5T#",
            "",
        ),
        ("TIME beyond 32 bits", time, "timeRange = «\"T#25d\"", OutOfRange, "TIME holds", ""),
        (
            "TIME for LREAL",
            rate,
            "setChangeRate = «\"T#50ms\"",
            TypeMismatch,
            "\"T#50ms\" is no LREAL",
            "a number such as 1.0",
        ),
        (
            "a quoted number for LREAL",
            rate,
            "setChangeRate = «\"10\"",
            TypeMismatch,
            "\"10\" is a text, but pin setChangeRate takes a number",
            "write setChangeRate = 10, without quotes",
        ),
        (
            "a quoted number with decimals for LREAL",
            rate,
            "setChangeRate = «\"8.0\"",
            TypeMismatch,
            "\"8.0\" is a text",
            "write setChangeRate = 8.0, without quotes",
        ),
        (
            "a quoted truth value for BOOL",
            endless,
            "endlessSteps = «\"TRUE\"",
            TypeMismatch,
            "takes true or false",
            "write endlessSteps = true, without quotes",
        ),
        (
            "a time with a comma",
            "timeRange = 50",
            "timeRange = «\"T#1,5s\"",
            OutOfRange,
            "decimals have a point, not a comma: \"T#1.5s\"",
            "",
        ),
        ("1 for BOOL", endless, "endlessSteps = «1", TypeMismatch, "1 is no BOOL", "true or false"),
        (
            "0.0 for BOOL",
            endless,
            "endlessSteps = «0.0",
            TypeMismatch,
            "0.0 is no BOOL",
            "true or false",
        ),
    ]);
}

#[test]
fn constants_in_every_notation_of_toml_are_read() {
    for (written, value) in [
        ("10", 10.0),
        ("0x10", 16.0),
        ("0b11", 3.0),
        ("0o17", 15.0),
        ("1_000", 1000.0),
        ("+5", 5.0),
        ("1e3", 1000.0),
        ("inf", f64::INFINITY),
        ("100000000000000000000", 1e20),
    ] {
        let text = VALID.replace("setChangeRate = 10.0", &format!("setChangeRate = {written}"));
        let plan = plan(&text).unwrap();
        let slot = (0..).find(|slot| plan.slot_name(0, *slot) == "ramp.0.setChangeRate").unwrap();
        assert_eq!(plan.tasks[0].image[slot], value, "{written}");
    }
}

#[test]
fn times_are_read_as_plc_programmers_write_them() {
    for written in ["1500", "\"1500ms\"", "\"1.5s\"", "\"T#1s500ms\"", "\"time#1_500MS\""] {
        let text = VALID.replace("timeRange = 50", &format!("timeRange = {written}"));
        let plan = plan(&text).unwrap();
        let slot = (0..).find(|slot| plan.slot_name(0, *slot) == "saw.timeRange").unwrap();
        assert_eq!(plan.tasks[0].image[slot], 1_500.0, "{written}");
    }
}

#[test]
fn the_default_of_a_time_input_is_read_alike() {
    let input = |value_type: &str, default: &str| {
        let to = format!("type = \"{value_type}\"\ndefault = {default}");
        VALID
            .replace("type = \"INT\"", &to)
            .replace("startValue", "timeRange")
            .replace("timeRange = 50\n", "")
    };
    for written in ["-250", "\"-250ms\"", "\"T#-0.25s\""] {
        assert_eq!(plan(&input("TIME", written)).unwrap().tasks[0].image[1], -250.0, "{written}");
    }
    let reason = "[[input]] default \"T#1x\": there is no unit \"x\"";
    assert_one("unit", &input("TIME", "«\"T#1x\""), OutOfRange, reason, "\"T#100ms\"");
}

/// A ramp whose `callOB` is written so, in a node with the tasks `fast` (OB 35) and `slow`.
fn with_ob(written: &str) -> String {
    format!(
        "[node]\nname = \"n\"\n[[task]]\nname = \"fast\"\nperiod = \"1ms\"\nob = 35\n\
         [[task]]\nname = \"slow\"\nperiod = \"10ms\"\n\
         [[input]]\nname = \"number\"\ntype = \"INT\"\ntask = \"fast\"\n\
         [[input]]\nname = \"raw\"\ntask = \"fast\"\n\
         [[output]]\nservice = \"o\"\ntask = \"fast\"\nsignals = [\"raw\", \"number\"]\n\
         [[block]]\nname = \"ramp\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\nin.callOB = {written}\n"
    )
}

#[test]
fn call_ob_is_a_number_a_task_or_a_wire() {
    for (written, ob) in [
        ("35", Ob::Number(35)),
        ("\"fast\"", Ob::Number(35)),
        ("\"slow\"", Ob::Task { period_ns: 10_000_000 }),
        ("nan", Ob::Caller),
        ("-nan", Ob::Caller),
    ] {
        let plan = plan(&with_ob(written)).unwrap();
        let slot = (0..).find(|slot| plan.slot_name(0, *slot) == "ramp.callOB").unwrap();
        assert_eq!(plan.tasks[0].image[slot].to_bits(), ob.slot().to_bits(), "{written}");
        assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
    }
    assert_eq!(plan(&with_ob("\"number\"")).unwrap().tasks[0].banks[0].wires.len(), 1);
}

#[test]
fn what_call_ob_cannot_mean_is_refused_with_the_way_out() {
    for (written, problem, message, help) in [
        ("\"slwo\"", UnknownTask, "there is no task or input \"slwo\"", "did you mean \"slow\"?"),
        ("\"OB_Cyclic\"", UnknownTask, "no task or input \"OB_Cyclic\"", "fast, slow, number, raw"),
        ("\"35\"", UnknownTask, "no task or input \"35\"", "callOB = 35, without quotes"),
        ("\"raw\"", TypeMismatch, "\"raw\" is LREAL, but pin callOB takes INT", ""),
        ("\"ramp\"", UnknownSource, "no input \"ramp\"", "such as \"ramp.delayedValue\""),
        ("\"slow.y\"", UnknownSource, "no block \"slow\"", ""),
        ("\"number@prev\"", UnknownSource, "is an input", "@prev goes behind"),
    ] {
        assert_one(written, &with_ob(&format!("«{written}")), problem, message, help);
    }
    let both = with_ob("«\"number\"").replace("name = \"slow\"", "name = \"number\"");
    assert_one(
        "both",
        &both,
        Duplicate,
        "\"number\" at pin callOB is a task and an input",
        "another name",
    );
}
