//! Constants: what is wrong, where, and what would be right.

use isochrone_blocks::Ob;
use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_one, before, instead_of, plan, start_value, value_of};

#[test]
fn constants_of_another_type_or_out_of_range_are_refused() {
    value_of(OutOfRange, "setChangeRate = 10.0")
        .finds("nan", "setChangeRate cannot be NaN", "inf and -inf")
        .finds("-nan", "setChangeRate cannot be NaN", "inf and -inf");
    value_of(TypeMismatch, "setChangeRate = 10.0")
        .finds("true", "true is no LREAL", "a number such as 1.0")
        .finds("\"T#50ms\"", "\"T#50ms\" is no LREAL", "a number such as 1.0")
        .finds(
            "\"10\"",
            "\"10\" is a text, but pin setChangeRate takes a number",
            "write setChangeRate = 10, without quotes",
        )
        .finds("\"8.0\"", "\"8.0\" is a text", "write setChangeRate = 8.0, without quotes")
        .finds(
            "\"0,5\"",
            "\"0,5\" is no LREAL",
            "write setChangeRate = 0.5: decimals have a point, not a comma",
        )
        .finds(
            "\"10 m/s\"",
            "\"10 m/s\" is no LREAL",
            "write setChangeRate = 10, the number alone, in 1/s",
        )
        .finds("\"16#0A\"", "\"16#0A\" is no LREAL", "write a number such as 1.0")
        .finds("\"16#64\"", "\"16#64\" is no LREAL", "");
    value_of(WrongType, "setChangeRate = 10.0")
        .finds("[1]", "takes a number, true or false, or a wire, not array", "")
        .finds("0x1E99999999999999999", "setChangeRate", "");
    value_of(TypeMismatch, "startValue = \"start\"")
        .finds("1.5", "1.5 is no INT", "a whole number")
        .finds("1.0", "1.0 is no INT", "a whole number")
        .finds("true", "true is no INT", "a whole number");
    value_of(OutOfRange, "startValue = \"start\"")
        .finds("32768", "32768 does not fit", "INT holds -32768 to 32767")
        .finds("-32769", "-32769 does not fit", "INT holds")
        .finds("\"16#8000\"", "32768 does not fit", "INT holds")
        .finds(
            "\"16#XY\"",
            "pin startValue \"16#XY\": after 16# come digits of base 16, such as 16#8F00",
            "write a whole number",
        );
    value_of(TypeMismatch, "timeRange = 50").finds("0.5", "0.5 is no TIME", "whole milliseconds");
    value_of(OutOfRange, "timeRange = 50")
        .finds("2147483648", "does not fit", "TIME holds")
        .finds(
            "\"50\"",
            "pin timeRange \"50\": the unit is missing: \"50ms\"?",
            "write timeRange = \"50ms\"",
        )
        .finds("\"T#0.5ms\"", "fractions of a millisecond", "whole milliseconds")
        .finds("\"S5T#1s\"", "begins with T# or TIME#, not S5T#", "")
        .finds("\"T#25d\"", "TIME holds", "")
        .finds(
            "\"T#1,5s\"",
            "decimals have a point, not a comma: \"T#1.5s\"",
            "write timeRange = \"T#1.5s\"",
        );
    value_of(TypeMismatch, "endlessSteps = true")
        .finds("\"TRUE\"", "takes true or false", "write endlessSteps = true, without quotes")
        .finds("1", "1 is no BOOL", "true or false")
        .finds("0.0", "0.0 is no BOOL", "true or false");
    instead_of(TypeMismatch, "endlessSteps = true").finds(
        "numberSteps = «\"5,0\"",
        "\"5,0\" is no INT",
        "write numberSteps = 5: decimals",
    );
}

/// What a constant that is written so is when the node starts; `line` is what stands there in [`VALID`].
fn read(line: &str, key: &str, written: &str, pin: &str) -> f64 {
    let text = VALID.replace(line, &format!("{key} = {written}"));
    start_value(&plan(&text).unwrap(), pin)
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
        let rate = read("setChangeRate = 10.0", "setChangeRate", written, "ramp.0.setChangeRate");
        assert_eq!(rate, value, "{written}");
    }
}

#[test]
fn times_are_read_as_plc_programmers_write_them() {
    for written in ["1500", "\"1500ms\"", "\"1.5s\"", "\"T#1s500ms\"", "\"time#1_500MS\""] {
        let time_ms = read("timeRange = 50", "timeRange", written, "saw.timeRange");
        assert_eq!(time_ms, 1_500.0, "{written}");
    }
}

#[test]
fn whole_numbers_are_read_with_the_bases_of_plc_programmers() {
    let bases =
        [("16#64", 100.0), ("2#0110_0100", 100.0), ("8#144", 100.0), ("-16#8000", -32768.0)];
    for (written, value) in bases {
        let quoted = format!("\"{written}\"");
        let steps = read("endlessSteps = true", "numberSteps", &quoted, "saw.numberSteps");
        assert_eq!(steps, value, "{written}");
    }
    let input = |default: &str| {
        let to = format!("type = \"INT\"\ndefault = {default}");
        VALID.replace("type = \"INT\"", &to)
    };
    assert_eq!(plan(&input("\"16#64\"")).unwrap().tasks[0].image[1], 100.0);
    let reason = "[[input]] default \"16#\": after 16# come digits of base 16";
    assert_one("digits", &input("«\"16#\""), OutOfRange, reason, "");
}

#[test]
fn a_number_that_a_comment_cuts_short_is_refused() {
    instead_of(OutOfRange, "endlessSteps = true").finds(
        "numberSteps = «16#64",
        "16#64 is read as 16: in TOML, # begins a comment",
        "write 100; a pin of type INT or WORD also takes \"16#64\", in quotes",
    );
    value_of(OutOfRange, "ob = 35").finds("16#23", "16#23 is read as 16", "write 35").finds(
        "35#Main",
        "35#Main is read as 35",
        "a blank before a comment",
    );
    let limits = "[limits]\n\"ramp.*.setChangeRate\" = [\n0.5, «16#64\n]";
    before(OutOfRange, "[[task]]").finds(limits, "16#64 is read as 16", "write 100");
    // There the comment swallows the end of the table.
    instead_of(Syntax, "[block.in]\nstartValue = \"start\"\ntimeRange = 50\nendlessSteps = true")
        .finds("in = { timeRange = 50, numberSteps = «16#64 }", "16#64 is read as 16", "write 100");
    // There it is not what makes the file no TOML, and hides nothing of that.
    let broken = VALID.replace("endlessSteps = true", "endlessSteps = «= true");
    let text = format!("text = \"\"\"\nob = 16#23\n\"\"\"\n{broken}");
    for elsewhere in [broken.replace("ob = 35", "ob = 16#23"), text] {
        assert_one("elsewhere", &elsewhere, Syntax, "this is not TOML: extra `=`", "");
    }
    assert!(plan(&VALID.replace("ob = 35", "ob = 35 # main")).is_ok());
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
        assert_eq!(start_value(&plan, "ramp.callOB").to_bits(), ob.slot().to_bits(), "{written}");
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
        ("\"OB35\"", UnknownTask, "no task or input \"OB35\"", "callOB = 35, without quotes"),
        ("\"ob_38\"", UnknownTask, "no task or input \"ob_38\"", "callOB = 38, without quotes"),
        ("\"raw\"", TypeMismatch, "\"raw\" is LREAL, but pin callOB takes INT", ""),
        ("\"ramp\"", UnknownSource, "no input \"ramp\"", "such as \"ramp.delayedValue\""),
        ("\"slow.y\"", UnknownSource, "no block \"slow\"", ""),
        ("\"number@prev\"", UnknownSource, "is an input", "@prev goes behind"),
    ] {
        assert_one(written, &with_ob(&format!("«{written}")), problem, message, help);
    }
    let both = with_ob("«\"number\"").replace("name = \"slow\"", "name = \"number\"");
    let message = "\"number\" at pin callOB is a task and an input";
    assert_one("both", &both, Duplicate, message, "another name");
}
