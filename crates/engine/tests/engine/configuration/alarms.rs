//! Process alarms: what they become, and mistakes in them.

use isochrone_engine::{AlarmWatch, Plan, Problem, TaskEngine};
use isochrone_model::AlarmSeverity;

use crate::findings::{findings, plan};

/// A node with signals of every kind; `«` marks nothing here.
const NODE: &str = r#"
[node]
name = "n"
[[task]]
name = "fast"
period = "1ms"
[[task]]
name = "slow"
period = "10ms"
[[input]]
name = "raw"
task = "fast"
service = "plant/raw"
max_age = "1s"
[[variable]]
name = "level"
initial = 0
task = "fast"
[[variable]]
name = "on"
type = "BOOL"
initial = false
task = "slow"
[[variable]]
name = "pause"
type = "TIME"
initial = "T#1s"
task = "slow"
[[block]]
name = "pump-1"
type = "ScaleLinear"
task = "fast"
in = { x = "raw", x1 = 0.0, y1 = 0.0, x2 = 1.0, y2 = 1.0, yMin = -inf, yMax = inf }
[[output]]
service = "plant/out"
task = "slow"
signals = ["on", "pause"]
"#;

fn with(alarm: &str) -> String {
    format!("{NODE}[[alarm]]\nname = \"a\"\n{alarm}\n")
}

fn of(alarm: &str) -> Plan {
    plan(&with(alarm)).unwrap_or_else(|errors| panic!("{alarm}: {errors:?}"))
}

#[test]
fn an_alarm_is_in_the_task_of_its_first_signal_unless_it_names_another() {
    for (alarm, task) in [
        ("when = 'level > 1.6'", "fast"),
        ("when = 'on'", "slow"),
        ("when = 'raw.ok'", "fast"),
        ("when = 'level > 1.6'\ntask = \"slow\"", "slow"),
        ("when = 'b.active'\n[[alarm]]\nname = \"b\"\nwhen = 'on'", "slow"),
        ("when = '\"pump-1.y@prev\" < level'", "fast"),
    ] {
        let plan = of(alarm);
        let found = plan.tasks.iter().find(|it| it.alarms.iter().any(|alarm| alarm.name == "a"));
        assert_eq!(found.map(|task| &*task.name), Some(task), "{alarm}");
        assert!(plan.warnings.iter().all(|it| it.problem == Problem::NoEffect), "{alarm}");
    }
}

#[test]
fn an_alarm_has_what_the_file_says_and_defaults_for_the_rest() {
    let plan = of("when = ' level >= 1.6 '\nfor = \"1500us\"\nhysteresis = 0.5\n\
                   severity = \"critical\"\ntext = \"Tank\"");
    let alarm = plan.alarms().next().unwrap();
    assert_eq!((&*alarm.when, alarm.delay_ns, alarm.hysteresis), ("level >= 1.6", 1_500_000, 0.5));
    assert_eq!((alarm.severity, &*alarm.text), (AlarmSeverity::Critical, "Tank"));
    let plan = of("when = 'NOT on'");
    let alarm = plan.alarms().next().unwrap();
    let said = (alarm.severity, &*alarm.text, alarm.delay_ns, &*alarm.signal);
    assert_eq!(said, (AlarmSeverity::Warning, "NOT on", 0, "on"));
    // Alarms are no blocks.
    assert_eq!(plan.instances(), 1);
}

/// Whether an alarm is active after one cycle with these values.
fn is_active(when: &str, level: f64, on: bool) -> bool {
    let plan = of(&format!("when = '{when}'\ntask = \"slow\""));
    let mut engines = TaskEngine::build(&plan).unwrap();
    engines[0].give_variable(0, level);
    engines[0].step(0);
    engines[1].give_variable(0, f64::from(u8::from(on)));
    engines[1].step(0);
    let active = plan.tasks[1].alarms[0].active_slot();
    engines[1].image()[active] != 0.0
}

#[test]
fn a_condition_holds_as_structured_text_has_it() {
    for (when, holds) in [
        ("level > 2", [false, false, true]),
        ("level >= 2", [false, true, true]),
        ("level < 2.0", [true, false, false]),
        ("level <= 2_0e-1", [true, true, false]),
        ("level = 2", [false, true, false]),
        ("level <> 2#10", [true, false, true]),
        ("level>-1", [true, true, true]),
    ] {
        let found = [1.0, 2.0, 3.0].map(|level| is_active(when, level, false));
        assert_eq!(found, holds, "{when}");
    }
    for (when, holds) in [
        ("on", [false, true]),
        ("not on", [true, false]),
        ("Not \"on\"", [true, false]),
        ("on = true", [false, true]),
        ("on <> TRUE", [true, false]),
    ] {
        assert_eq!([false, true].map(|on| is_active(when, 0.0, on)), holds, "{when}");
    }
    for (when, holds) in [
        ("level > 1 AND on", [false, false, false, true]),
        ("3 < level + 1 OR on", [false, true, true, true]),
        ("2 < level", [false, false, true, true]),
        ("NOT (level > 1 AND level <= 3)", [true, true, false, false]),
        ("SEL(on, level > 2, level < 2)", [false, true, true, false]),
        ("ABS(level - 2) >= 1.0 XOR on", [true, false, true, false]),
    ] {
        let found = [(1.0, false), (1.0, true), (3.0, false), (3.0, true)]
            .map(|(level, on)| is_active(when, level, on));
        assert_eq!(found, holds, "{when}");
    }
    assert!(is_active("pause = T#1s", 0.0, false));
    assert!(!is_active("pause < T#900ms", 0.0, false));
}

#[test]
fn an_input_that_is_not_ok_keeps_the_alarm_as_it_is() {
    use isochrone_engine::InputReading;
    use isochrone_model::Flags;

    let plan = of("when = 'raw > 1.0'");
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let mut watch = AlarmWatch::of(&plan.tasks[0]);
    let mut told = Vec::new();
    for (cycle, (value, ok)) in
        [(2.0, false), (2.0, true), (0.0, false), (0.0, true)].into_iter().enumerate()
    {
        let reading = InputReading { value, ok, age_s: 0.0, source_ns: 1, flags: Flags::default() };
        engine.read_input(0, &reading);
        engine.step(cycle as u64);
        watch.look(engine.image(), cycle as u64, |event| {
            told.push((event.cycle, event.active, event.ok, event.value));
            true
        });
    }
    let expected = [
        (0, false, false, 2.0),
        (1, true, true, 2.0),
        (2, true, false, 0.0),
        (3, false, true, 0.0),
    ];
    assert_eq!(told, expected);
}

/// What an alarm tells of cycles in which `raw`, which is `ok` or not, and the variable `level` have these values.
fn told(alarm: &str, cycles: &[(f64, bool, f64)]) -> Vec<(u64, bool, bool)> {
    use isochrone_engine::InputReading;
    use isochrone_model::Flags;

    let plan = of(alarm);
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let mut watch = AlarmWatch::of(&plan.tasks[0]);
    let mut told = Vec::new();
    for (cycle, (value, ok, level)) in (0..).zip(cycles.iter().copied()) {
        let reading = InputReading { value, ok, age_s: 0.0, source_ns: 1, flags: Flags::default() };
        engine.read_input(0, &reading);
        engine.give_variable(0, level);
        engine.step(cycle);
        watch.look(engine.image(), cycle, |event| {
            told.push((event.cycle, event.active, event.ok));
            true
        });
    }
    told
}

#[test]
fn an_expression_is_evaluated_only_while_all_its_inputs_are_ok_and_its_result_is_no_error() {
    let either = told(
        "when = 'raw > 1.0 OR level > 5.0'",
        &[
            (2.0, true, 0.0),
            (0.0, false, 0.0),
            (0.0, true, 0.0),
            (0.0, false, 9.0),
            (0.0, true, 9.0),
        ],
    );
    let expected =
        [(0, true, true), (1, true, false), (2, false, true), (3, false, false), (4, true, true)];
    assert_eq!(either, expected);
    let divided = told(
        "when = '1.0 / level > 2.0 AND raw < 5.0'",
        &[(0.0, true, 0.1), (0.0, true, 0.0), (0.0, true, 1.0), (f64::NAN, true, 0.1)],
    );
    assert_eq!(divided, [(0, true, true), (1, true, false), (2, false, true), (3, false, false)]);
    // What asks itself whether the input can be believed is evaluated without belief.
    let either = told("when = 'raw > 1.0 OR NOT raw.ok'", &[(0.0, false, 0.0), (0.0, true, 0.0)]);
    assert_eq!(either, [(0, true, true), (1, false, true)]);
    let lost = told("when = 'NOT raw.ok AND level > 0.0'", &[(0.0, false, 1.0), (0.0, true, 1.0)]);
    assert_eq!(lost, [(0, true, true), (1, false, true)]);
}

proptest::proptest! {
    #[test]
    fn an_expression_that_says_the_same_as_a_comparison_makes_the_same_alarm(
        delay in 0_u8..4,
        cycles in proptest::collection::vec((0_usize..4, proptest::bool::weighted(0.9)), 1..40),
    ) {
        let cycles: Vec<_> = cycles
            .into_iter()
            .map(|(value, ok)| ([0.0, 1.0, 2.0, f64::NAN][value], ok, 1.0))
            .collect();
        let [comparison, expression] = ["raw > level", "raw > level AND TRUE"]
            .map(|when| told(&format!("when = '{when}'\nfor = \"{delay}ms\""), &cycles));
        proptest::prop_assert_eq!(comparison, expression);
    }
}

#[test]
fn a_condition_on_the_cycle_before_tells_the_value_of_that_cycle() {
    let plan = of("when = '\"pump-1.y@prev\" > level'");
    let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
    let mut watch = AlarmWatch::of(&plan.tasks[0]);
    let mut told = Vec::new();
    for (cycle, raw) in [(0, 1.0), (1, 2.0), (2, -1.0), (3, -1.0)] {
        engine.set_input(0, raw, 1);
        engine.step(cycle);
        watch.look(engine.image(), cycle, |event| {
            told.push((event.cycle, event.active, event.value));
            true
        });
    }
    assert_eq!(told, [(1, true, 1.0), (3, false, -1.0)]);
}

#[test]
fn an_alarm_is_wired_like_a_block_and_a_loop_of_alarms_is_found() {
    let plan = of("when = 'level > 1'\n[[output]]\nservice = \"plant/a\"\ntask = \"fast\"\n\
                   signals = [\"a.active\", \"a.ok\"]");
    let output = plan.tasks[0].outputs.first().unwrap();
    assert_eq!(output.signals[0].slot, plan.tasks[0].alarms[0].active_slot());
    assert_eq!(output.signals[1].slot, plan.tasks[0].alarms[0].ok_slot());
    let looped = "when = 'b.active'\ntask = \"fast\"\n[[alarm]]\nname = \"b\"\nwhen = 'a.active'";
    let found = findings(&with(looped));
    assert!(found.iter().any(|it| it.message == "loop: a -> b -> a"), "{found:?}");
}

/// A condition, with a mark where its mistake stands, what is said, and the help.
const MISTAKES: [(&str, &str, &str); 21] = [
    ("«level", "level is LREAL, and a condition takes BOOL", "compare it: level > 0"),
    (
        "«level + 1.0",
        "level + 1.0 is LREAL, and a condition takes BOOL",
        "compare it: level + 1.0 > 0",
    ),
    ("«1 < 2", "the condition names no signal, so it never changes", "level.y > 1.6 AND NOT stop"),
    ("level «>", "nothing stands behind >", ""),
    ("level «== 3", "== is not of this language", "equality is ="),
    ("«level > 1 > 0", "a comparison has two sides", "write level > 1 AND 1 > 0"),
    ("level > 1 AND «level", "level is LREAL, and AND takes BOOL or WORD", "compare it: level > 0"),
    ("pump«-1.y > 3", "a name with - stands in double quotes", "write \"pump-1.y\""),
    ("level«@prev > 3", "a name with @ stands in double quotes", "write \"level@prev\""),
    ("«\"pump-1.y > 3", "the double quote that begins this name has no other one", ""),
    ("«NOT", "nothing stands behind NOT", ""),
    ("NOT «level", "level is LREAL, and NOT takes BOOL or WORD", "NOT (level > 0)"),
    ("on = «1", "1 is a number, and on is BOOL", "a BOOL is TRUE or FALSE"),
    ("level > «T#2s", "level is LREAL and T#2s is TIME, and > takes values of one type", ""),
    ("pause > «2", "2 is a number, and pause is TIME", "a TIME is written T#2s"),
    ("level > «16#zz", "16#zz: after 16# come digits of base 16", ""),
    ("«lvel > 3", "there is no input or variable \"lvel\"", "did you mean \"level\"?"),
    ("on OR «lvel > 3", "there is no input or variable \"lvel\"", "did you mean \"level\"?"),
    ("«a > 3", "there is no input or variable \"a\"", "a is an alarm; write \"a.active\""),
    ("«a.activ", "alarm \"a\" has no signal \"activ\"", "did you mean \"a.active\"?"),
    (
        "«\"level@prev\" > 1",
        "\"level\" is a variable, which has no value of the cycle before",
        "write \"level\"",
    ),
];

#[test]
fn a_mistake_in_a_condition_is_named_with_its_place() {
    for (marked, message, help) in MISTAKES {
        let text = with(&format!("when = '{marked}'"));
        let place = text.find('«').unwrap();
        let found = findings(&text);
        let errors: Vec<_> = found.iter().filter(|it| !it.is_warning()).collect();
        assert_eq!(errors.len(), 1, "{marked}: {errors:?}");
        assert!(errors[0].message.contains(message), "{marked}: {errors:?}");
        assert_eq!(errors[0].span.start, place, "{marked}: {errors:?}");
        let said = errors[0].help.as_deref().unwrap_or_default();
        assert!(said.contains(help), "{marked}: {said}");
    }
}

#[test]
fn the_place_in_a_text_with_escapes_is_that_in_the_file() {
    for (when, wrong) in [
        (r#""\"pump-1.y\" > 1 AND 5""#, "5"),
        (r#""\u006Cevel \t> 1 AND 5""#, "5"),
        ("'''\nlevel > 1 AND 5'''", "5"),
        ("\"\"\"\r\nlevel > 1\\\"AND on\"\"\"", "\\\""),
    ] {
        let text = with(&format!("when = {when}"));
        let found = findings(&text);
        let place = text.rfind(wrong).unwrap();
        let error = found.iter().find(|it| !it.is_warning());
        assert_eq!(error.map(|it| it.span.start), Some(place), "{when}: {found:?}");
    }
}

#[test]
fn a_mistake_in_the_other_keys_is_named_with_the_way_out() {
    for (alarm, message, help) in [
        ("when = 'on'\nhysteresis = 0.1", "hysteresis goes with one comparison", "for gives"),
        (
            "when = 'level > 1 OR on'\nhysteresis = 0.1",
            "hysteresis goes with",
            "a Hysteresis block",
        ),
        ("when = 'level = 1'\nhysteresis = 0.1", "hysteresis goes with", "leave hysteresis out"),
        ("when = 'level > 1'\nhysteresis = -1", "hysteresis -1 is out of range", "0 or greater"),
        ("when = 'level > 1'\nseverity = \"high\"", "severity cannot be \"high\"", "info, warning"),
        ("when = 'level > 1'\nfor = \"2\"", "for \"2\": the unit is missing", ""),
        ("when = ''", "[[alarm]] when: there is no expression", "level.y > 1.6 AND NOT stop"),
        ("for = \"2s\"", "[[alarm]] has no when", "write when = \"level.y > 1.6\""),
        ("when = 'on'\ntask = \"slo\"", "there is no task \"slo\"", "did you mean \"slow\"?"),
        (
            "when = 'a.active'",
            "this alarm does not say which task it belongs to",
            "there are several tasks",
        ),
        (
            "when = 'on'\n[[alarm]]\nname = \"a\"\nwhen = 'on'",
            "alarm \"a\" is taken",
            "no other one",
        ),
        (
            "when = 'on'\n[[block]]\nname = \"a\"\ntype = \"SawTooth\"\ntask = \"fast\"",
            "alarm \"a\" is taken",
            "no block has",
        ),
        (
            "when = 'on'\n[[input]]\nname = \"a\"\ntask = \"fast\"",
            "\"a.ok\" would be a signal of this input and a pin of alarm \"a\"",
            "another name",
        ),
    ] {
        let found = findings(&with(alarm));
        let is_meant = |it: &&isochrone_engine::Diagnostic| it.message.contains(message);
        let meant = found.iter().find(is_meant);
        let meant = meant.unwrap_or_else(|| panic!("{alarm}: {found:?}"));
        let said = meant.help.as_deref().unwrap_or_default();
        assert!(said.contains(help), "{alarm}: {said}");
    }
}

#[test]
fn a_text_is_one_line_of_the_length_of_a_comment_and_a_condition_is_limited() {
    let long = "x".repeat(1001);
    let long_when = format!("when = \"{}level > 1\"", " ".repeat(4000));
    for (alarm, said) in [
        (format!("when = 'on'\ntext = '{long}'"), "[[alarm]] text has 1001 bytes"),
        ("when = 'on'\ntext = ' '".to_owned(), "[[alarm]] text is empty"),
        ("when = 'on'\ntext = \"a\\u001bb\"".to_owned(), "has a control character"),
        (long_when, "[[alarm]] when has 4009 bytes"),
    ] {
        let found = plan(&with(&alarm)).expect_err("it is refused");
        let found = format!("{found:?}");
        assert!(found.contains(said), "{said}: {found}");
    }
    assert_eq!(of(&format!("when = 'on'\ntext = '{}'", &long[1..])).tasks[1].alarms.len(), 1);
}
