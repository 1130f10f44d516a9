//! Constants: what is wrong, where, and what would be right.

use isochrone_blocks::Ob;
use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_mistakes, assert_one, plan, start_value};

#[test]
fn constants_of_another_type_or_out_of_range_are_refused() {
    assert_mistakes(
        r#"
        OutOfRange: value of setChangeRate = 10.0
            nan  | setChangeRate cannot be NaN | inf and -inf
            -nan | setChangeRate cannot be NaN | inf and -inf
        TypeMismatch: value of setChangeRate = 10.0
            true     | true is no LREAL                                     | a number such as 1.0
            "T#50ms" | "T#50ms" is no LREAL                                 | a number such as 1.0
            "10"     | "10" is a text, but pin setChangeRate takes a number | write setChangeRate = 10, without quotes
            "8.0"    | "8.0" is a text                                      | write setChangeRate = 8.0, without quotes
            "1,000.5" | "1,000.5" is no LREAL | decimals have a point, not a comma, and nothing stands between thousands
            "0,5"    | "0,5" is no LREAL                                    | write setChangeRate = 0.5: decimals have a point, not a comma
            "10 m/s" | "10 m/s" is no LREAL                                 | write setChangeRate = 10, the number alone, in 1/s
            "16#0A"  | "16#0A" is no LREAL                                  | write a number such as 1.0
            "16#64"  | "16#64" is no LREAL
        WrongType: value of setChangeRate = 10.0
            [1]                   | takes a number, true or false, or a wire, not array
            0x1E99999999999999999 | setChangeRate
        TypeMismatch: value of startValue = "start"
            1.5  | 1.5 is no INT  | a whole number
            1.0  | 1.0 is no INT  | a whole number
            true | true is no INT | a whole number
        OutOfRange: value of startValue = "start"
            32768     | 32768 does not fit | INT holds -32768 to 32767
            -32769    | -32769 does not fit | INT holds
            "16#8000" | 32768 does not fit | INT holds
            "16#XY"   | pin startValue "16#XY": after 16# come digits of base 16, such as 16#8F00 | write a whole number
        OutOfRange: value of timeRange = 50
            2147483648 | does not fit                                     | TIME holds
            "50"       | pin timeRange "50": the unit is missing: "50ms"? | write timeRange = "50ms"
            "T#1,5s"   | decimals have a point, not a comma: "T#1.5s"     | write timeRange = "T#1.5s"
        TypeMismatch: value of endlessSteps = true
            "TRUE" | takes true or false | write endlessSteps = true, without quotes
            1      | 1 is no BOOL        | true or false
            0.0    | 0.0 is no BOOL      | true or false
        TypeMismatch
            timeRange = 50      -> timeRange = «0.5     | 0.5 is no TIME  | whole milliseconds
            endlessSteps = true -> numberSteps = «"5,0" | "5,0" is no INT | write numberSteps = 5: decimals
        "#,
    );
}

#[test]
fn constants_are_read_in_the_notations_of_toml_and_of_plc_programmers() {
    let numbers = [
        ("10", 10.0),
        ("0x10", 16.0),
        ("0b11", 3.0),
        ("0o17", 15.0),
        ("1_000", 1000.0),
        ("+5", 5.0),
        ("1e3", 1000.0),
        ("inf", f64::INFINITY),
        ("100000000000000000000", 1e20),
    ];
    let times = ["1500", "\"1500ms\"", "\"1.5s\"", "\"T#1s500ms\"", "\"time#1_500MS\""];
    let times = times.map(|written| (written, 1_500.0));
    let bases = [
        ("\"16#64\"", 100.0),
        ("\"2#0110_0100\"", 100.0),
        ("\"8#144\"", 100.0),
        ("\"-16#8000\"", -32768.0),
    ];
    for (line, key, pin, constants) in [
        ("setChangeRate = 10.0", "setChangeRate", "ramp.0.setChangeRate", &numbers[..]),
        ("timeRange = 50", "timeRange", "saw.timeRange", &times),
        ("endlessSteps = true", "numberSteps", "saw.numberSteps", &bases),
    ] {
        for (written, value) in constants {
            let plan = plan(&VALID.replace(line, &format!("{key} = {written}"))).unwrap();
            assert_eq!(start_value(&plan, pin), *value, "{key} = {written}");
        }
    }
}

#[test]
fn the_default_of_a_whole_number_input_is_read_alike() {
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
    assert_mistakes(
        r#"
        OutOfRange: instead of endlessSteps = true
            numberSteps = «16#64 | 16#64 is read as 16: in TOML, # begins a comment | write 100; a pin of type INT or WORD also takes "16#64", in quotes
        OutOfRange: value of ob = 35
            16#23   | 16#23 is read as 16   | write 35
            35#Main | 35#Main is read as 35 | a blank before a comment
        OutOfRange
            [[task]] -> [limits]\n"ramp.*.setChangeRate" = [\n0.5, «16#64\n]\n[[task]] | 16#64 is read as 16 | write 100
        "#,
    );
    // There the comment swallows the end of the table.
    assert_mistakes(
        r#"
        Syntax: instead of [block.in]\nstartValue = "start"\ntimeRange = 50\nendlessSteps = true
            in = { timeRange = 50, numberSteps = «16#64 } | 16#64 is read as 16 | write 100
        "#,
    );
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
