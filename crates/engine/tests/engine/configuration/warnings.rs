//! Constants that make a block report an error from its first call, and those that only may.

use isochrone_engine::{Plan, Problem};

use crate::findings::{assert_one, plan};
use crate::one_task::{TASK, blocks, output};

/// Blocks `x` in a node of OB 35 with the inputs `r` (LREAL), `b` (BOOL) and `i` (INT), and its text.
fn planned(block_type: &str, count: usize, pins: &str) -> (Plan, String) {
    let inputs = "ob = 35\n[[input]]\nname = \"r\"\n[[input]]\nname = \"b\"\ntype = \"BOOL\"\n\
        [[input]]\nname = \"i\"\ntype = \"INT\"\n";
    let (output, blocks) = (output(&["r", "b", "i"]), blocks("x", count, block_type, pins));
    let text = [TASK, inputs, &output, &blocks].concat();
    (plan(&text).unwrap(), text)
}

/// The warnings about one block.
fn warnings(block_type: &str, pins: &str) -> Vec<String> {
    let (plan, text) = planned(block_type, 1, pins);
    for warning in &plan.warnings {
        assert_eq!(warning.problem, Problem::ConstantError);
        assert!(warning.is_warning() && warning.help.is_some());
        assert_eq!(&text[warning.span.clone()], "\"x\"");
    }
    plan.warnings.into_iter().map(|warning| warning.message).collect()
}

#[track_caller]
fn assert_warned(block_type: &str, pins: &str, status: &str) {
    let warnings = warnings(block_type, pins);
    assert_eq!(warnings.len(), 1, "{pins}: {warnings:?}");
    let expected = format!("block \"x\" reports 16#{status} from its first call: ");
    assert!(warnings[0].starts_with(&expected), "{pins}: {warnings:?}");
}

#[track_caller]
fn assert_quiet(block_type: &str, pins: &str) {
    assert_eq!(warnings(block_type, pins), Vec::<String>::new(), "{pins}");
}

const RAMP: &str = "LimRateOfChangeCI";
const ADVANCED: &str = "LimRateOfChangeAdvancedCI";
const SCALE: &str = "ScaleLinear";

#[test]
fn a_negative_rate_is_a_warning_whatever_is_wired() {
    assert_warned(RAMP, "setChangeRate = -1.0", "8200");
    assert_warned(RAMP, "setChangeRate = -1.0, value = \"r\", enDefaultOutValue = \"b\"", "8200");
    assert_warned(ADVANCED, "setNegUpRateLim = -1, autoValue = \"r\"", "8202");
    assert_warned(ADVANCED, "setNegUpRateLim = -1, reset = \"b\", manOp = \"b\"", "8202");
}

#[test]
fn limits_the_wrong_way_round_are_a_warning() {
    assert_warned(SCALE, "x = \"r\", x1 = 0, y1 = 0, x2 = 1, y2 = 1, yMin = 1, yMax = 0", "8200");
    assert_warned(ADVANCED, "autoValue = \"r\", setLowLim = 1.0", "8200");
}

#[test]
fn a_signal_that_is_infinite_is_a_warning_unless_a_mode_avoids_it() {
    assert_warned(RAMP, "value = inf", "8F00");
    assert_quiet(RAMP, "value = inf, enDefaultOutValue = true");
    assert_quiet(RAMP, "value = inf, enDefaultOutValue = \"b\"");
}

#[test]
fn an_ob_that_no_task_has_is_a_warning_that_says_what_to_do() {
    assert_warned(RAMP, "callOB = 36, value = \"r\"", "8601");
    assert_warned(ADVANCED, "callOB = 7, autoValue = \"r\"", "8600");
    assert_quiet(RAMP, "callOB = 35");
    assert_quiet(RAMP, "callOB = \"i\"");
}

#[test]
fn a_wire_that_can_avoid_the_error_avoids_the_warning() {
    let line = "x = \"r\", x1 = 0, y1 = 0, x2 = 1, y2 = 1";
    for pins in [
        "yMin = 2e6, yMax = \"r\"",
        "yMin = \"r\", yMax = -2e6",
        "yMin = 1e200, yMax = \"r\"",
        "yMin = \"r\", yMax = \"r\"",
    ] {
        assert_quiet(SCALE, &format!("{line}, {pins}"));
    }
    assert_quiet(
        SCALE,
        "x = 3.0, x1 = 3.0, y1 = 0, x2 = 3.5, y2 = \"r\", yMin = 5.0, yMax = \"r\"",
    );
    // The low limit must be below -5 while the rate must not be negative.
    assert_quiet(ADVANCED, "setHighLim = -5.0, setLowLim = \"r\", setPosUpRateLim = \"r\"");
    assert_quiet(ADVANCED, "setHighLim = \"r\", setLowLim = 5e6, setPosUpRateLim = \"r\"");
    assert_quiet(RAMP, "setChangeRate = \"r\"");
}

#[test]
fn what_is_only_limited_is_no_warning() {
    assert_quiet(SCALE, "x = 5, x1 = 0, y1 = 0, x2 = 1, y2 = 1, yMin = 0, yMax = 1");
    assert_quiet(SCALE, "x = 5, x1 = 1, y1 = 0, x2 = 1, y2 = 1, yMin = 0, yMax = 1");
    assert_quiet("SawTooth", "timeRange = -5, numberSteps = -1");
}

#[test]
fn the_defaults_of_a_block_are_no_warning() {
    assert_quiet(RAMP, "");
    assert_quiet(ADVANCED, "");
    assert_quiet("SawTooth", "");
}

#[test]
fn what_is_wired_to_a_latched_pin_is_a_note_and_no_warning() {
    let notes = |pins: &str| {
        let (plan, text) = planned("SawTooth", 3, pins);
        assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
        // Nor does any of the inputs have a service.
        let notes = plan.notes.into_iter().filter(|note| note.problem != Problem::NoService);
        let notes: Vec<_> = notes.collect();
        for note in &notes {
            assert_eq!((note.problem, &text[note.span.clone()]), (Problem::Latched, "\"x\""));
            assert!(!note.is_warning() && note.help.is_some());
        }
        notes.into_iter().map(|note| note.message).collect::<Vec<_>>()
    };
    assert_eq!(notes("startValue = 5, timeRange = \"1s\", reset = \"b\""), [""; 0]);
    let pins = "numberSteps = \"i\", startValue = \"i\", endlessSteps = \"b\", reset = \"b\"";
    let [note] = notes(pins).try_into().unwrap();
    let expected = "block \"x\" (SawTooth) reads what is wired to startValue, numberSteps, \
        endlessSteps in its first call and while reset is TRUE, at no other time";
    assert_eq!(note, expected);
}

#[test]
fn a_manual_value_beyond_a_limit_is_a_note_where_manual_mode_can_end() {
    let notes = |pins: &str| {
        let limits = "setPosUpRateLim = 1, setPosDownRateLim = 1, setHighLim = 10";
        let notes = planned(ADVANCED, 1, &format!("{limits}, {pins}")).0.notes;
        let notes = notes.into_iter().filter(|note| note.problem == Problem::Caution);
        notes.map(|note| (note.message, note.help.unwrap())).collect::<Vec<_>>()
    };
    for pins in [
        "manualValue = 20, manOp = true, autoValue = 50",
        "manualValue = 20, manOp = \"b\", autoValue = \"r\"",
    ] {
        let [(message, help)] = &notes(pins)[..] else { panic!("{pins}") };
        let expected =
            "block \"x\" (LimRateOfChangeAdvancedCI): when manOp becomes FALSE, its limits are off";
        assert!(message.starts_with(expected), "{message}");
        assert!(help.contains("a manualValue between the limits"), "{help}");
    }
    for pins in [
        "manualValue = 20",
        "manualValue = 10, manOp = \"b\"",
        "manualValue = \"r\", manOp = \"b\"",
        "manualValue = 20, manOp = \"b\", track = true",
    ] {
        assert_eq!(notes(pins), [], "{pins}");
    }
}

#[test]
fn many_instances_are_one_warning() {
    assert_eq!(planned(RAMP, 1000, "setChangeRate = -1.0").0.warnings.len(), 1);
}

#[test]
fn warnings_stand_beside_the_errors_of_the_file_in_its_order() {
    let text = TASK.to_string()
        + &blocks("x", 1, RAMP, "setChangeRate = -1.0")
        + &blocks("y", 1, RAMP, "value = \"z.y\"");
    let findings = plan(&text).unwrap_err();
    let problems: Vec<Problem> = findings.all.iter().map(|finding| finding.problem).collect();
    assert_eq!(problems, [Problem::ConstantError, Problem::UnknownSource]);
    assert_eq!(findings.summary(), "level.toml: 1 error and 1 warning");
}

#[test]
fn an_input_that_nothing_reads_is_a_warning_at_its_name() {
    let inputs = ["wired", "shown", "lost"].map(|name| format!("[[input]]\nname = \"{name}\"\n"));
    let text = TASK.to_string()
        + &inputs.concat().replace("\"lost\"", "«\"lost\"")
        + &blocks("x", 1, RAMP, "value = \"wired\"")
        + &output(&["shown"]);
    assert_one("lost", &text, Problem::NoEffect, "", "");
}
