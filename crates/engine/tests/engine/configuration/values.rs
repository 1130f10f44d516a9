//! Values of keys of tasks, blocks and outputs: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;

use crate::findings::{VALID, assert_mistakes, assert_one, plan};

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
        let finding = format!("ob {ob} is out of range | 30 to 38 or 123 to 32767");
        assert_mistakes(&format!("OutOfRange: value of ob = 35\n{ob} | {finding}"));
    }
    for ob in ["30", "38", "123", "32767"] {
        assert!(plan(&VALID.replace("ob = 35", &format!("ob = {ob}"))).is_ok(), "{ob}");
    }
}

#[test]
fn values_of_tasks_that_are_out_of_range_are_refused_with_the_range() {
    assert_mistakes(
        r#"
        OutOfRange: value of priority = 80
            0  | priority 0  | from 1 to 89
            90 | priority 90 | from 1 to 89
        WrongType: value of priority = 80
            "80" | a whole number, not a text  | write priority = 80
            80.0 | a whole number, not a float
        OutOfRange: value of cpu = 1
            -1     | cpu -1           | from 0 to 1023
            "1"    | cannot be "1"    | write cpu = 1
            "atuo" | cannot be "atuo" | did you mean "auto"?
            1024   | cpu 1024         | from 0 to 1023
        OutOfRange: value of wake = "hybrid"
            "hybird" | cannot be "hybird" | did you mean "hybrid"?
            "9"      | cannot be "9"      | there is: sleep, hybrid, spin
        WrongType
            cpu = 1 -> cpu = «1.0 | a whole number or a text, not a float
        OutOfRange
            overrun = "skip" -> overrun = «"catchup" | cannot be "catchup" | did you mean "catch_up"?
        "#,
    );
}

#[test]
fn counts_are_at_least_1_and_a_file_has_at_most_a_million_instances() {
    assert_mistakes(
        r#"
        OutOfRange: value of count = 3
            0                    | count 0        | from 1 to 1000000
            -3                   | count -3       | from 1 to 1000000
            1000001              | count 1000001 | from 1 to 1000000
            99999999999999999999 | out of range   | from 1 to 1000000
        WrongType
            count = 3 -> count = «3.0 | a whole number, not a float
        "#,
    );
}

#[test]
fn outputs_have_signals_and_services_have_names() {
    assert_mistakes(
        r#"
        WrongType: value of signals = ["scale.y", "ramp.0.delayedValue"]
            "scale.y" | an array of texts, not a text | write signals = ["scale.y"]
            [1]       | an array of texts
        OutOfRange
            signals = ["scale.y", "ramp.0.delayedValue"] -> signals = «[] | signals is empty | at least one "block.pin"
        OutOfRange: after signals = ["scale.y", "ramp.0.delayedValue"]
            readers = «0  | readers 0  | from 1 to 64
            readers = «65 | readers 65 | from 1 to 64
        BadName
            "plant/level"  -> «"" | cannot be the name of a service: it is empty
            "plant/analog" -> «"" | cannot be the name of a service: it is empty
        "#,
    );
}
