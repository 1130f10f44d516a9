//! Times of tasks, and what they follow: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;
use isochrone_schedule::{Margin, Wake};

use crate::findings::{VALID, assert_one, findings, instead_of, plan, value_of};

#[test]
fn periods_outside_10_us_to_1_h_and_what_is_no_duration_are_refused() {
    let range = "from \"10us\" to \"1h\"";
    let rows = [
        ("zero", "«\"0ms\"", "0ms is out of range"),
        ("negative", "«\"-1ms\"", "cannot be negative"),
        ("below 10 us", "«\"9.999us\"", "out of range"),
        ("above 1 h", "«\"3600.000000001s\"", "out of range"),
        ("unknown unit", "«\"1 fortnight\"", "no unit \"fortnight\""),
        ("fractions of a nanosecond", "«\"10000.5ns\"", "whole nanoseconds"),
        ("empty", "«\"\"", "a number and a unit"),
        ("exponent", "«\"1e3us\"", "no unit"),
        ("huge", "«\"99999999999999999999s\"", "too long"),
    ];
    for (name, period, message) in rows {
        let text = VALID.replace("period = \"1ms\"", &format!("period = {period}"));
        assert_one(name, &text, OutOfRange, message, range);
    }
    let text = VALID.replace("period = \"1ms\"", "period = «1");
    assert_one("number", &text, WrongType, "a duration such as \"1ms\", not an integer", "");
}

#[test]
fn a_period_that_needs_only_another_form_is_refused_with_that_form() {
    let help = |period: &str| format!("write period = \"{period}\"");
    for (written, message, right) in [
        ("\"1\"", "the unit is missing: \"1ms\"?", "1ms"),
        ("\"T#0,5s\"", "decimals have a point, not a comma", "T#0.5s"),
        ("\"T#2\"", "the unit is missing", "T#2ms"),
        ("2", "is a duration such as \"1ms\", not an integer", "2ms"),
    ] {
        let text = VALID.replace("period = \"1ms\"", &format!("period = «{written}"));
        let problem = if written.starts_with('"') { OutOfRange } else { WrongType };
        assert_one(written, &text, problem, message, &help(right));
    }
}

#[test]
fn a_period_may_be_written_as_a_time_literal() {
    for (period, period_ns) in
        [("T#100ms", 100_000_000), ("time#1s_500ms", 1_500_000_000), ("T#0.5s", 500_000_000)]
    {
        let text = VALID.replace("period = \"1ms\"", &format!("period = \"{period}\""));
        assert_eq!(plan(&text).unwrap().tasks[0].schedule.period_ns, period_ns, "{period}");
    }
    let negative = VALID.replace("period = \"1ms\"", "period = «\"T#-1ms\"");
    assert_one("negative", &negative, OutOfRange, "a duration cannot be negative", "");
}

#[test]
fn the_shortest_and_the_longest_period_are_accepted() {
    for (period, period_ns) in
        [("10us", 10_000), ("1h", 3_600_000_000_000), ("12345.678us", 12_345_678)]
    {
        let text = format!("[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"{period}\"\n");
        assert_eq!(plan(&text).unwrap().tasks[0].schedule.period_ns, period_ns);
    }
}

#[test]
fn a_phase_is_less_than_the_period() {
    let help = "within the period";
    value_of(OutOfRange, "phase = \"100us\"")
        .finds("\"1ms\"", "phase is not less than the period", help)
        .finds("\"1s\"", "phase is not less than the period", help)
        .finds("\"-1us\"", "cannot be negative", "less than the period");
}

#[test]
fn a_margin_is_less_than_the_period() {
    for margin in ["1ms", "2ms"] {
        let to = format!("wake = \"hybrid\"\nmargin = «\"{margin}\"");
        let text = VALID.replace("wake = \"hybrid\"", &to);
        let message = "margin is not less than the period";
        assert_one(margin, &text, OutOfRange, message, "part of the period");
    }
    for (margin, keys) in [
        (Margin::Fixed(999_999), "margin = \"999999ns\""),
        (Margin::Adaptive { cpu_budget: 0.5 }, "cpu_budget = 0.5"),
    ] {
        for wake in ["", "wake = \"hybrid\"\n"] {
            let text = VALID.replace("wake = \"hybrid\"", &format!("{wake}{keys}"));
            assert_eq!(plan(&text).unwrap().tasks[0].schedule.wake, Wake::Hybrid(margin));
        }
    }
}

#[test]
fn a_margin_that_nothing_would_use_is_refused_where_it_stands() {
    let help = "write wake = \"hybrid\", or leave";
    instead_of(Conflict, "wake = \"hybrid\"")
        .finds(
            "wake = \"sleep\"\nmargin = «\"80us\"",
            "margin is for wake = \"hybrid\" only: wake = \"sleep\" has no margin",
            help,
        )
        .finds(
            "wake = \"spin\"\ncpu_budget = «0.1",
            "cpu_budget is for wake = \"hybrid\" only: wake = \"spin\" has no margin",
            help,
        )
        .finds(
            "wake = \"sleep\"\ncpu_budget = 0.1\nmargin = «\"80us\"",
            "margin and cpu_budget are for wake = \"hybrid\" only: wake = \"sleep\" has no margin",
            "write wake = \"hybrid\", and keep one of them, or leave both out",
        )
        .finds(
            "cpu_budget = «0.1\nmargin = \"80us\"",
            "has both margin and cpu_budget",
            "keep one",
        );
    instead_of(Conflict, "priority = 80\ncpu = 1\nwake = \"hybrid\"").finds(
        "margin = «\"80us\"",
        "without a priority the task sleeps until its release",
        help,
    );
}

/// [`VALID`] with a task that follows.
fn following(follow: &str) -> String {
    VALID.replace("cpu = 1", &format!("cpu = 1\nfollow = {follow}"))
}

#[test]
fn a_task_follows_a_service_of_one_of_its_inputs() {
    let text = following("{ service = \"plant/analog\", within = \"300us\" }");
    for wake in ["sleep", "hybrid", "spin"] {
        let plan = plan(&text.replace("\"hybrid\"", &format!("\"{wake}\""))).unwrap();
        assert_eq!(plan.tasks[0].followed_service.as_deref(), Some("plant/analog"));
        assert_eq!(plan.tasks[0].schedule.follow_within_ns, Some(300_000), "{wake}");
    }
    assert_eq!(plan(VALID).unwrap().tasks[0].schedule.follow_within_ns, None);
}

#[test]
fn a_service_that_no_input_of_the_task_reads_cannot_be_followed() {
    let message = "is the service of none of its inputs";
    for (service, help) in
        [("plant/analg", "did you mean \"plant/analog\"?"), ("plant/level", "plant/analog")]
    {
        let text = following(&format!("{{ service = «\"{service}\", within = \"300us\" }}"));
        assert_one(service, &text, UnknownSource, message, help);
    }
    // The input is read by another task.
    let text = following("{ service = «\"plant/analog\", within = \"300us\" }")
        .replace("[[input]]\nname = \"start\"", "[[task]]\nname = \"slow\"\nperiod = \"1s\"\n\n[[input]]\nname = \"start\"\ntask = \"fast\"")
        .replace("type = \"ScaleLinear\"\ntask = \"fast\"", "type = \"ScaleLinear\"\ntask = \"slow\"")
        .replace("channel = 7\ntask = \"fast\"", "channel = 7\ntask = \"slow\"")
        .replace("count = 3", "count = 3\ntask = \"fast\"")
        .replace("type = \"SawTooth\"", "type = \"SawTooth\"\ntask = \"fast\"");
    assert_one("another task's", &text, UnknownSource, message, "give it an [[input]]");
}

#[test]
fn the_wait_for_a_frame_ends_before_the_period() {
    for within in ["1ms", "2s"] {
        let text = following(&format!("{{ service = \"plant/analog\", within = «\"{within}\" }}"));
        let message = "[task.follow] within is not less than the period";
        assert_one(within, &text, OutOfRange, message, "part of the period");
    }
    let text = following("{ service = \"plant/analog\", within = «\"0us\" }");
    assert_one("zero", &text, OutOfRange, "within", "longer than 0");
    let with_margin = |within: &str, margin: &str| {
        following(&format!("{{ service = \"plant/analog\", within = {within} }}"))
            .replace("wake = \"hybrid\"", &format!("wake = \"hybrid\"\nmargin = \"{margin}\""))
    };
    let message = "within and the margin together are not less than the period";
    let text = with_margin("«\"900us\"", "100us");
    assert_one("with a margin", &text, OutOfRange, message, "shorten one of them");
    assert!(plan(&with_margin("\"900us\"", "99us")).is_ok());
}

#[test]
fn a_task_that_follows_what_it_sends_itself_is_warned_of() {
    let text = "[node]\nname = \"n\"\n[[task]]\nname = \"a\"\nperiod = \"1ms\"\n\
                follow = { service = «\"s\", within = \"300us\" }\n\
                [[input]]\nname = \"x\"\nservice = \"s\"\nmax_age = \"1s\"\n\
                [[output]]\nservice = \"s\"\nsignals = [\"x\"]\n";
    let message = "task \"a\" follows \"s\", which it sends itself";
    assert_one("own output", text, FollowsItself, message, "follow the service of another task");
}

#[test]
fn a_task_that_keeps_its_source_from_sending_is_warned_of() {
    let text = |source: &str, follower: &str| {
        format!(
            "[node]\nname = \"n\"\n[[task]]\nname = \"a\"\nperiod = \"1ms\"\n{source}\n\
             [[task]]\nname = \"b\"\nperiod = \"1ms\"\n{follower}\n\
             follow = {{ service = «\"s\", within = \"300us\" }}\n\
             [[input]]\nname = \"i\"\nservice = \"j\"\ntask = \"a\"\nmax_age = \"1s\"\n\
             [[input]]\nname = \"x\"\nservice = \"s\"\ntask = \"b\"\nmax_age = \"1s\"\n\
             [[output]]\nservice = \"s\"\ntask = \"a\"\nsignals = [\"i\"]\n\
             [[output]]\nservice = \"t\"\ntask = \"b\"\nsignals = [\"x\"]\n"
        )
    };
    let (cpu, help) =
        ("cpu = 1", "give task \"a\" a higher priority than task \"b\", or another CPU");
    for (source, message) in [
        ("priority = 7", "which has priority 7 and runs on the same CPU 1"),
        ("priority = 6", "which has priority 6"),
        ("", "which has no priority"),
    ] {
        let text = text(&format!("{cpu}\n{source}"), &format!("{cpu}\npriority = 7"));
        assert_one(source, &text, StarvedSource, message, help);
    }
    for (source, follower) in [
        ("cpu = 1\npriority = 8", "cpu = 1\npriority = 7"),
        ("cpu = 0\npriority = 7", "cpu = 1\npriority = 7"),
        ("priority = 7", "cpu = 1\npriority = 7"),
        ("cpu = 1", "cpu = 1"),
    ] {
        assert!(findings(&text(source, follower)).is_empty(), "{source} {follower}");
    }
}

#[test]
fn what_is_followed_and_for_how_long_is_both_written() {
    let text = following("«{ within = \"300us\" }");
    assert_one("service", &text, MissingKey, "has no service", "service = \"plant/analog\"");
    let text = following("«{ service = \"plant/analog\" }");
    assert_one("within", &text, MissingKey, "has no within", "within = \"300us\"");
}
