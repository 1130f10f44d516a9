//! Values of keys of tasks, blocks and outputs: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_one, instead_of, plan, value_of};

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
        let message = format!("ob {ob} is out of range");
        value_of(OutOfRange, "ob = 35").finds(ob, &message, "30 to 38 or 123 to 32767");
    }
    for ob in ["30", "38", "123", "32767"] {
        assert!(plan(&VALID.replace("ob = 35", &format!("ob = {ob}"))).is_ok(), "{ob}");
    }
}

#[test]
fn values_of_tasks_that_are_out_of_range_are_refused_with_the_range() {
    value_of(OutOfRange, "priority = 80").finds("0", "priority 0", "from 1 to 89").finds(
        "90",
        "priority 90",
        "from 1 to 89",
    );
    value_of(WrongType, "priority = 80")
        .finds("\"80\"", "a whole number, not a text", "write priority = 80")
        .finds("80.0", "a whole number, not a float", "");
    value_of(OutOfRange, "cpu = 1")
        .finds("-1", "cpu -1", "from 0 to 1023")
        .finds("\"1\"", "cannot be \"1\"", "write cpu = 1")
        .finds("\"atuo\"", "cannot be \"atuo\"", "did you mean \"auto\"?")
        .finds("1024", "cpu 1024", "from 0 to 1023");
    value_of(WrongType, "cpu = 1").finds("1.0", "a whole number or a text, not a float", "");
    value_of(OutOfRange, "wake = \"hybrid\"")
        .finds("\"hybird\"", "cannot be \"hybird\"", "did you mean \"hybrid\"?")
        .finds("\"9\"", "cannot be \"9\"", "there is: sleep, hybrid, spin");
    value_of(OutOfRange, "overrun = \"skip\"").finds(
        "\"catchup\"",
        "cannot be \"catchup\"",
        "did you mean \"catch_up\"?",
    );
}

#[test]
fn counts_are_at_least_1_and_a_file_has_at_most_ten_million_instances() {
    let range = "from 1 to 10000000";
    value_of(OutOfRange, "count = 3")
        .finds("0", "count 0", range)
        .finds("-3", "count -3", range)
        .finds("10000001", "count 10000001", range)
        .finds("99999999999999999999", "out of range", range);
    value_of(WrongType, "count = 3").finds("3.0", "a whole number, not a float", "");
}

#[test]
fn outputs_have_signals_and_services_have_names() {
    value_of(OutOfRange, "signals = [\"scale.y\", \"ramp.0.delayedValue\"]").finds(
        "[]",
        "signals is empty",
        "at least one \"block.pin\"",
    );
    value_of(WrongType, "signals = [\"scale.y\", \"ramp.0.delayedValue\"]")
        .finds("\"scale.y\"", "an array of texts, not a text", "write signals = [\"scale.y\"]")
        .finds("[1]", "an array of texts", "");
    instead_of(BadName, "\"plant/level\"").finds(
        "«\"\"",
        "cannot be the name of a service: it is empty",
        "",
    );
    instead_of(BadName, "\"plant/analog\"").finds(
        "«\"\"",
        "cannot be the name of a service: it is empty",
        "",
    );
}
