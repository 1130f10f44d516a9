//! Values of keys of tasks, blocks and outputs: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_one, assert_rows, plan};

#[test]
fn a_limit_of_missed_releases_can_be_reached() {
    let limited = |misses: &str, cycles: u64| {
        let to = format!("cpu = 1\non_overrun = {{ misses = {misses}, cycles = {cycles} }}");
        VALID.replace("cpu = 1", &to)
    };
    let message = "misses is greater than cycles";
    assert_one("5 of 2", &limited("«5", 2), OutOfRange, message, "of 2 releases at most 2");
    assert!(plan(&limited("5", 5)).is_ok());
}

#[test]
fn ob_numbers_are_30_to_38_or_123_and_above() {
    for ob in
        ["29", "39", "122", "32768", "0", "-35", "9223372036854775807", "99999999999999999999"]
    {
        let text = VALID.replace("ob = 35", &format!("ob = «{ob}"));
        assert_one(
            ob,
            &text,
            OutOfRange,
            &format!("ob {ob} is out of range"),
            "30 to 38 or 123 to 32767",
        );
    }
    for ob in ["30", "38", "123", "32767"] {
        assert!(plan(&VALID.replace("ob = 35", &format!("ob = {ob}"))).is_ok(), "{ob}");
    }
}

#[test]
fn values_of_tasks_that_are_out_of_range_are_refused_with_the_range() {
    assert_rows(&[
        ("priority 0", "priority = 80", "priority = «0", OutOfRange, "priority 0", "from 1 to 89"),
        (
            "priority 90",
            "priority = 80",
            "priority = «90",
            OutOfRange,
            "priority 90",
            "from 1 to 89",
        ),
        (
            "priority text",
            "priority = 80",
            "priority = «\"80\"",
            WrongType,
            "a whole number, not a text",
            "write priority = 80",
        ),
        (
            "priority decimal",
            "priority = 80",
            "priority = «80.0",
            WrongType,
            "a whole number, not a float",
            "",
        ),
        ("cpu negative", "cpu = 1", "cpu = «-1", OutOfRange, "cpu -1", "from 0 to 1023"),
        ("cpu text", "cpu = 1", "cpu = «\"1\"", OutOfRange, "cannot be \"1\"", "write cpu = 1"),
        (
            "cpu word",
            "cpu = 1",
            "cpu = «\"atuo\"",
            OutOfRange,
            "cannot be \"atuo\"",
            "did you mean \"auto\"?",
        ),
        (
            "cpu decimal",
            "cpu = 1",
            "cpu = «1.0",
            WrongType,
            "a whole number or a text, not a float",
            "",
        ),
        ("cpu too large", "cpu = 1", "cpu = «1024", OutOfRange, "cpu 1024", "from 0 to 1023"),
        (
            "wake",
            "wake = \"hybrid\"",
            "wake = «\"hybird\"",
            OutOfRange,
            "cannot be \"hybird\"",
            "did you mean \"hybrid\"?",
        ),
        (
            "wake: nothing near",
            "wake = \"hybrid\"",
            "wake = «\"9\"",
            OutOfRange,
            "cannot be \"9\"",
            "there is: sleep, hybrid, spin",
        ),
        (
            "overrun",
            "overrun = \"skip\"",
            "overrun = «\"catchup\"",
            OutOfRange,
            "cannot be \"catchup\"",
            "did you mean \"catch_up\"?",
        ),
    ]);
}

#[test]
fn counts_are_at_least_1_and_a_file_has_at_most_a_million_instances() {
    let range = "from 1 to 1000000";
    assert_rows(&[
        ("zero", "count = 3", "count = «0", OutOfRange, "count 0", range),
        ("negative", "count = 3", "count = «-3", OutOfRange, "count -3", range),
        ("too many", "count = 3", "count = «1000001", OutOfRange, "count 1000001", range),
        (
            "beyond 64 bits",
            "count = 3",
            "count = «99999999999999999999",
            OutOfRange,
            "out of range",
            range,
        ),
        ("decimal", "count = 3", "count = «3.0", WrongType, "a whole number, not a float", ""),
    ]);
}

#[test]
fn outputs_have_signals_and_services_have_names() {
    assert_rows(&[
        (
            "no signals",
            "signals = [\"scale.y\", \"ramp.0.delayedValue\"]",
            "signals = «[]",
            OutOfRange,
            "signals is empty",
            "at least one \"block.pin\"",
        ),
        (
            "signals text",
            "signals = [\"scale.y\", \"ramp.0.delayedValue\"]",
            "signals = «\"scale.y\"",
            WrongType,
            "an array of texts, not a text",
            "write signals = [\"scale.y\"]",
        ),
        (
            "signals number",
            "signals = [\"scale.y\", \"ramp.0.delayedValue\"]",
            "signals = «[1]",
            WrongType,
            "an array of texts",
            "",
        ),
        (
            "output service",
            "\"plant/level\"",
            "«\"\"",
            BadName,
            "cannot be the name of a service: it is empty",
            "",
        ),
        (
            "input service",
            "\"plant/analog\"",
            "«\"\"",
            BadName,
            "cannot be the name of a service: it is empty",
            "",
        ),
    ]);
}
