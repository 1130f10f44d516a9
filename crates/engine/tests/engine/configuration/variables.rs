//! Variables: what they stand for, and mistakes in them.

use isochrone_engine::{Problem, TaskEngine};

use crate::findings::{VALID, assert_mistakes, findings, plan, start_value};

/// [`VALID`] with variables that its blocks read.
fn with_variables() -> String {
    let variables = "[[variable]]\nname = \"low\"\ninitial = -1\nrange = [-inf, 0]\n\
        [[variable]]\nname = \"steps\"\ntype = \"INT\"\ninitial = \"16#0A\"\n\
        [[variable]]\nname = \"endless\"\ntype = \"BOOL\"\ninitial = true\n\
        [[variable]]\nname = \"time\"\ntype = \"TIME\"\ninitial = \"T#1s\"\n[[block]]\nname = \"scale\"";
    VALID
        .replace("[[block]]\nname = \"scale\"", variables)
        .replace("y1 = 0.0", "y1 = \"low\"")
        .replace("yMin = 0.0", "yMin = \"low\"")
        .replace(
            "timeRange = 50\nendlessSteps = true",
            "timeRange = \"time\"\nendlessSteps = \"endless\"\nnumberSteps = \"steps\"",
        )
        .replace("signals = [\"scale.y\"", "signals = [\"low\", \"endless\", \"scale.y\"")
}

#[test]
fn a_variable_stands_once_in_the_image_and_any_number_of_pins_and_frames_reads_it() {
    let plan = plan(&with_variables()).unwrap();
    assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
    let initial = [("low", -1.0), ("steps", 10.0), ("endless", 1.0), ("time", 1000.0)];
    for (name, value) in initial {
        assert_eq!(start_value(&plan, name), value, "{name}");
    }
    let task = &plan.tasks[0];
    assert_eq!(
        task.variables.iter().map(|it| (&*it.name, it.initial)).collect::<Vec<_>>(),
        initial
    );
    let limits: Vec<_> = plan.limits.iter().map(|it| (&*it.names, it.min, it.max)).collect();
    assert_eq!(limits, [("low", f64::NEG_INFINITY, 0.0)]);
    let slot = task.variable_slot(0) as u32;
    let readers = task.banks.iter().flat_map(|bank| &bank.wires).filter(|wire| wire.from == slot);
    let readers: Vec<String> = readers.map(|wire| plan.slot_name(0, wire.to as usize)).collect();
    assert_eq!(readers, ["scale.y1", "scale.yMin"]);

    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    engine.step(0);
    let mut frame = [f64::NAN; 3];
    engine.read_output(0, &mut frame);
    assert_eq!(frame[..2], [-1.0, 1.0]);
    engine.give_variable(0, -2.5);
    engine.step(1);
    engine.read_output(0, &mut frame);
    assert_eq!(frame[..2], [-2.5, 1.0]);
}

#[test]
fn another_task_reads_a_variable_as_it_reads_any_value() {
    let text = "[node]\nname = \"n\"\n[[task]]\nname = \"a\"\nperiod = \"1ms\"\n\
        [[task]]\nname = \"b\"\nperiod = \"1ms\"\n\
        [[input]]\nname = \"x\"\nservice = \"x\"\ntask = \"b\"\n\
        [[variable]]\nname = \"v\"\ninitial = 2.5\ntask = \"a\"\n\
        [[variable]]\nname = \"w\"\ninitial = 1.0\ntask = \"b\"\n\
        [[output]]\nservice = \"s\"\ntask = \"b\"\nsignals = [\"v\", \"w\", \"x\"]\n";
    let plan = plan(text).unwrap();
    let mut engines = TaskEngine::build(&plan).unwrap();
    let [a, b] = &mut engines[..] else { panic!("two tasks") };
    let mut frame = [f64::NAN; 3];
    b.step(0);
    b.read_output(0, &mut frame);
    assert_eq!(frame, [2.5, 1.0, 0.0], "the initial value, before the other task has run");
    a.give_variable(0, 7.0);
    b.step(1);
    b.read_output(0, &mut frame);
    assert_eq!(frame, [2.5, 1.0, 0.0], "that of its last finished cycle");
    a.step(0);
    b.give_variable(0, 3.0);
    b.step(2);
    b.read_output(0, &mut frame);
    assert_eq!(frame, [7.0, 3.0, 0.0]);
}

#[test]
fn mistakes_in_variables_are_reported_where_they_stand() {
    assert_mistakes(
        r#"
        OutOfRange: before [[output]]
            [[variable]]\nname = "v"\ntype = «"LREEL"\ninitial = 0                    | [[variable]] type cannot be "LREEL"                              | did you mean "LREAL"?
            [[variable]]\nname = "v"\ntype = «"WORD"\ninitial = 0                     | [[variable]] type cannot be "WORD"                               | there is: LREAL, INT, BOOL, TIME
            [[variable]]\nname = "v"\ninitial = «nan                                  | [[variable]] initial NaN is out of range                         | a number that LREAL can hold, and not NaN
            [[variable]]\nname = "v"\ntype = "INT"\ninitial = «40000                  | initial 40000 is out of range                                    | INT can hold
            [[variable]]\nname = "v"\ntype = "INT"\ninitial = «1.5                    | initial 1.5 is not a whole number                                | INT holds whole numbers from -32768 to 32767
            [[variable]]\nname = "v"\ntype = "TIME"\ninitial = «"1 parsec"            | initial "1 parsec"                                               | T#
            [[variable]]\nname = "v"\ninitial = «120\nrange = [0.0, 100.0]            | [[variable]] initial 120.0 is outside of its range 0.0 to 100.0  | change initial or range
            [[variable]]\nname = "v"\ninitial = 1\nrange = «[2, 1]                     | [[variable]] range: 2.0 to 1.0 is no range                       | write range = [0.0, 50.0]
            [limits]\n«"v" = [0.0, 1.0]\n[[variable]]\nname = "v"\ninitial = 2         | v is 2.0, outside of its limits 0.0 to 1.0                       | change the value in initial
        WrongType: before [[output]]
            [[variable]]\nname = "v"\ninitial = «"high"                               | [[variable]] initial is a number, not a text
            [[variable]]\nname = "v"\ninitial = «true                                 | [[variable]] initial is a number, not a boolean
            [[variable]]\nname = "v"\ninitial = 1\nrange = «5                         | [[variable]] range is an array of two numbers                    | write range = [0.0, 50.0]
            [[variable]]\nname = "v"\ninitial = 1\nrange = «[1]                       | [[variable]] range is an array of two numbers
        MissingKey: before [[output]]
            «[[variable]]\nname = "v"                                                 | [[variable]] has no initial                                      | write initial = 0
            «[[variable]]\ninitial = 0                                                | [[variable]] has no name                                         | write name = "…"
        UnknownKey: before [[output]]
            [[variable]]\nname = "v"\n«intial = 0                                     | [[variable]] has no key "intial"                                 | did you mean "initial"?
            [[variable]]\nname = "v"\ninitial = 0\n«service = "s"                     | [[variable]] has no key "service"                                | there is: name, type, initial, range, unit, comment, task
        Conflict: before [[output]]
            [[variable]]\nname = "v"\ntype = "BOOL"\ninitial = true\nrange = «[0, 1]   | [[variable]] range is not for BOOL                               | leave range out
            [limits]\n«"v*" = [0, 9]\n[[variable]]\nname = "v"\ninitial = 1\nrange = [0, 9] | "v*" bounds a variable that has a range                     | keep one of the two
            [limits]\n«"v" = [0, 1]\n[[variable]]\nname = "v"\ntype = "BOOL"\ninitial = true | "v" is no parameter that has limits                        | and for variables that hold numbers
        Duplicate: before [[output]]
            [[variable]]\nname = «"raw"\ninitial = 0                                  | variable "raw" is taken already                                  | a name that no other one and no input has
            [[variable]]\nname = "v"\ninitial = 0\n[[variable]]\nname = «"v"\ninitial = 1 | variable "v" is taken already
        BadName: before [[output]]
            [[variable]]\nname = «"a.b"\ninitial = 0                                  | [[variable]] name "a.b" is not a valid name
        UnknownTask: before [[output]]
            [[variable]]\nname = "v"\ninitial = 0\ntask = «"fats"                     | there is no task "fats"                                          | did you mean "fast"?
        NoEffect: before [[output]]
            [[variable]]\nname = «"v"\ninitial = 0                                    | nothing reads variable "v"                                       | wire it to a pin
        "#,
    );
}

#[test]
fn mistakes_in_wires_from_variables_name_the_variable() {
    let variable = "[[variable]]\nname = \"goal\"\ninitial = 0\n[[output]]";
    for (from, to, message, help) in [
        (
            "y1 = 0.0",
            "y1 = \"gaol\"",
            "there is no input or variable \"gaol\"",
            "did you mean \"goal\"?",
        ),
        ("y1 = 0.0", "y1 = \"goal.ok\"", "variable \"goal\" has no \"ok\"", "write \"goal\""),
        (
            "y1 = 0.0",
            "y1 = \"goal@prev\"",
            "\"goal\" is a variable, which has no value",
            "@prev goes behind",
        ),
        (
            "endlessSteps = true",
            "endlessSteps = \"goal\"",
            "\"goal\" is LREAL, but pin endlessSteps takes BOOL",
            "",
        ),
        (
            "[\"scale.y\"",
            "[\"goal@prev\", \"scale.y\"",
            "\"goal\" is a variable",
            "a variable has no @prev; write \"goal\"",
        ),
        (
            "[[task]]",
            "[[protect]]\nnames = [\"goal.age\"]\n[[task]]",
            "variable \"goal\" has no \"age\"",
            "write \"goal\"",
        ),
    ] {
        let text = VALID.replacen("[[output]]", variable, 1).replacen(from, to, 1);
        let found = findings(&text);
        let wrong = found.iter().find(|finding| !finding.is_warning()).unwrap();
        assert!(wrong.message.contains(message), "{to}: {wrong:?}");
        assert!(wrong.help.as_deref().unwrap_or_default().contains(help), "{to}: {wrong:?}");
    }
}

#[test]
fn an_input_without_a_service_is_a_note_that_names_the_way_out() {
    let noted = plan(VALID).unwrap().notes;
    let note = noted.iter().find(|note| note.problem == Problem::NoService).unwrap();
    assert!(note.message.starts_with("input \"start\" has no service: "), "{note}");
    assert!(note.help.as_deref().unwrap().contains("[[variable]]"), "{note:?}");
    assert_eq!(&VALID[note.span.clone()], "\"start\"");
    let served = VALID.replace("type = \"INT\"", "type = \"INT\"\nservice = \"s\"");
    assert!(plan(&served).unwrap().notes.iter().all(|note| note.problem != Problem::NoService));
}
