//! Times of tasks, and what they follow: what is wrong, where, and what would be right.

use isochrone_engine::Problem::*;
use isochrone_model::{Margin, Wake};

use crate::findings::{VALID, assert_mistakes, assert_one, findings, plan};

#[test]
fn periods_outside_10_us_to_1_h_and_what_is_no_duration_are_refused() {
    assert_mistakes(
        r#"
        OutOfRange: value of period = "1ms"
            "0ms"             | 0ms is out of range | from "10us" to "1h"
            "-1ms"            | cannot be negative  | from "10us" to "1h"
            "9.999us"         | out of range        | from "10us" to "1h"
            "3600.000000001s" | out of range        | from "10us" to "1h"
            "1 fortnight"     | no unit "fortnight" | from "10us" to "1h"
        WrongType
            period = "1ms" -> period = «1 | a duration such as "1ms", not an integer
        "#,
    );
}

#[test]
fn a_period_that_needs_only_another_form_is_refused_with_that_form() {
    assert_mistakes(
        r#"
        OutOfRange: value of period = "1ms"
            "1"      | the unit is missing: "1ms"?        | write period = "1ms"
            "T#0,5s" | decimals have a point, not a comma | write period = "T#0.5s"
            "T#2"    | the unit is missing                | write period = "T#2ms"
        WrongType
            period = "1ms" -> period = «2 | is a duration such as "1ms", not an integer | write period = "2ms"
        "#,
    );
}

#[test]
fn the_shortest_and_the_longest_period_are_accepted() {
    for (period, period_ns) in
        [("10us", 10_000), ("1h", 3_600_000_000_000), ("12345.678us", 12_345_678)]
    {
        let text = format!("[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"{period}\"\n");
        assert_eq!(plan(&text).unwrap().tasks[0].settings.period_ns, period_ns);
    }
}

#[test]
fn a_phase_is_less_than_the_period() {
    assert_mistakes(
        r#"
        OutOfRange: value of phase = "100us"
            "1ms"  | phase is not less than the period | within the period
            "1s"   | phase is not less than the period | within the period
            "-1us" | cannot be negative                | less than the period
        "#,
    );
}

#[test]
fn a_margin_is_less_than_the_period() {
    assert_mistakes(
        r#"
        OutOfRange: after wake = "hybrid"
            margin = «"1ms" | margin is not less than the period | part of the period
            margin = «"2ms" | margin is not less than the period | part of the period
        "#,
    );
    for (margin, keys) in [
        (Margin::Fixed(999_999), "margin = \"999999ns\""),
        (Margin::Adaptive { cpu_budget: 0.5 }, "cpu_budget = 0.5"),
    ] {
        for wake in ["", "wake = \"hybrid\"\n"] {
            let text = VALID.replace("wake = \"hybrid\"", &format!("{wake}{keys}"));
            assert_eq!(plan(&text).unwrap().tasks[0].settings.wake, Wake::Hybrid(margin));
        }
    }
}

#[test]
fn a_margin_that_nothing_would_use_is_refused_where_it_stands() {
    assert_mistakes(
        r#"
        Conflict: instead of wake = "hybrid"
            wake = "sleep"\nmargin = «"80us"                   | margin is for wake = "hybrid" only: wake = "sleep" has no margin | write wake = "hybrid", or leave
            wake = "spin"\ncpu_budget = «0.1                   | cpu_budget is for wake = "hybrid" only: wake = "spin" has no margin | write wake = "hybrid", or leave
            wake = "sleep"\ncpu_budget = 0.1\nmargin = «"80us" | margin and cpu_budget are for wake = "hybrid" only: wake = "sleep" has no margin | write wake = "hybrid", and keep one of them, or leave both out
            cpu_budget = «0.1\nmargin = "80us"                 | has both margin and cpu_budget | keep one
        Conflict
            priority = 80\ncpu = 1\nwake = "hybrid" -> margin = «"80us" | without a priority the task sleeps until its release | write wake = "hybrid", or leave
        "#,
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
        assert_eq!(plan.tasks[0].settings.followed_service(), Some("plant/analog"));
        assert_eq!(plan.tasks[0].settings.schedule().follow_within_ns, Some(300_000), "{wake}");
    }
    assert_eq!(plan(VALID).unwrap().tasks[0].settings.schedule().follow_within_ns, None);
}

#[test]
fn a_service_that_no_input_of_the_task_reads_cannot_be_followed() {
    assert_mistakes(
        r#"
        UnknownSource: after cpu = 1
            follow = { service = «"plant/analg", within = "300us" } | is the service of none of its inputs | did you mean "plant/analog"?
            follow = { service = «"plant/level", within = "300us" } | is the service of none of its inputs | plant/analog
        "#,
    );
    // The input is read by another task.
    let text = following("{ service = «\"plant/analog\", within = \"300us\" }")
        .replace("[[input]]\nname = \"start\"", "[[task]]\nname = \"slow\"\nperiod = \"1s\"\n\n[[input]]\nname = \"start\"\ntask = \"fast\"")
        .replace("type = \"ScaleLinear\"\ntask = \"fast\"", "type = \"ScaleLinear\"\ntask = \"slow\"")
        .replace("channel = 7\ntask = \"fast\"", "channel = 7\ntask = \"slow\"")
        .replace("count = 3", "count = 3\ntask = \"fast\"")
        .replace("type = \"SawTooth\"", "type = \"SawTooth\"\ntask = \"fast\"");
    let message = "is the service of none of its inputs";
    assert_one("another task's", &text, UnknownSource, message, "give it an [[input]]");
}

#[test]
fn the_wait_for_a_frame_ends_before_the_period() {
    assert_mistakes(
        r#"
        OutOfRange: after cpu = 1
            follow = { service = "plant/analog", within = «"1ms" } | [task.follow] within is not less than the period | part of the period
            follow = { service = "plant/analog", within = «"2s" }  | [task.follow] within is not less than the period | part of the period
            follow = { service = "plant/analog", within = «"0us" } | within                                           | longer than 0
            follow = { service = "plant/analog", within = «"900us" }\nmargin = "100us" | within and the margin together are not less than the period | shorten one of them
        "#,
    );
    let follow = "{ service = \"plant/analog\", within = \"900us\" }\nmargin = \"99us\"";
    assert!(plan(&following(follow)).is_ok());
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
    assert_mistakes(
        r#"
        MissingKey: after cpu = 1
            follow = «{ within = "300us" }         | has no service | service = "plant/analog"
            follow = «{ service = "plant/analog" } | has no within  | within = "300us"
        "#,
    );
}
