//! A node that follows another one, which comes, is killed and comes back.

use isochrone_testing::plants::{self, counter};
use isochrone_testing::{Domain, Ended, Plant, Process, assert_says, cells};

/// What is followed: a counter that is released so long after the follower's grid.
fn source(phase: &str) -> String {
    counter("saw", "10ms").replace("[[block]]", &format!("phase = \"{phase}\"\n[[block]]"))
}

/// Follows the counter, and reads a service that nobody sends.
fn follower() -> String {
    plants::follower("saw", "8ms")
        + r#"
[[input]]
name = "other"
service = "plant/other"
[[output]]
service = "plant/after"
signals = ["saw", "other"]
"#
}

/// The newest value of a signal that a subscriber printed.
fn newest(stdout: &str, signal: &str) -> u64 {
    let (_, after) = stdout.rsplit_once(&format!(" {signal}=")).unwrap_or_default();
    let value = after.split_whitespace().next().and_then(|value| value.parse::<f64>().ok());
    value.unwrap_or_default() as u64
}

/// What telemetry counts of cycles that began with a frame.
const WITH_FRAME: &[&str] = &["followed", "found_ready"];
/// The same of those that began without.
const WITHOUT: &[&str] = &["timed_out"];

/// Waits until the sum of counts of the follower has grown by so much.
#[track_caller]
fn wait_for_more(telemetry: &mut Process, counts: &[&str], more: u64) {
    let mut first = None;
    telemetry.wait_until(&counts.join(" + "), |stdout, _| {
        // The last line may not be whole.
        let (lines, _) = stdout.rsplit_once('\n').unwrap_or_default();
        let now = counts.iter().map(|count| newest(lines, &format!("task.t.{count}"))).sum::<u64>();
        now >= *first.get_or_insert(now) + more
    });
}

#[test]
fn a_follower_outlives_its_source_and_follows_the_next_one() {
    let domain = Domain::new();
    domain.write("source.toml", source("1ms"));
    domain.write("other_phase.toml", source("6ms"));
    let follower = domain.start_node("follower.toml", &follower(), "--report report.json");
    let mut telemetry = domain.start("subscribe isochrone/follower/telemetry");
    wait_for_more(&mut telemetry, WITHOUT, 5);
    for configuration in ["source.toml", "other_phase.toml"] {
        let source = domain.start(&format!("run {configuration}"));
        wait_for_more(&mut telemetry, WITH_FRAME, 50);
        source.kill();
        wait_for_more(&mut telemetry, WITHOUT, 50);
    }
    telemetry.stop().expect_code(0);
    let ended = follower.stop().expect_code(0);
    let counts = ["followed a frame", "found it ready at the release", "timed out"];
    for row in ["follow wait", "follow latency"].into_iter().chain(counts) {
        assert!(ended.stdout.contains(row), "{row}: {}", ended.stdout);
    }
    let report = domain.json("report.json");
    let task = &report["tasks"][0];
    let mut links = report["links"].as_array().unwrap().iter();
    let link = links.find(|link| link["service"] == "plant/saw").unwrap();
    let number = |key: &str| task[key].as_u64().unwrap_or_else(|| panic!("{key}: {task}"));
    let with_frame = number("followed") + number("found_ready");
    assert_eq!(with_frame + number("timed_out"), number("cycles"));
    assert!(with_frame <= link["frames"].as_u64().unwrap(), "{report}");
    assert!(with_frame >= 100 && number("timed_out") >= 105, "{task}");
    assert!(task["follow_latency_ns"]["count"].as_u64() > Some(0), "{task}");
    assert_eq!(link["restarts"], 1, "{link}");
}

/// A node that follows the frames of another one, and sends its own.
fn one_of_a_loop(name: &str, other: &str) -> Plant {
    Plant::new(name)
        .task("t", "10ms")
        .with(&format!("follow = {{ service = \"loop/{other}\", within = \"4ms\" }}"))
        .input("other", &format!("loop/{other}"), "feedback = true")
        .output(&format!("loop/{name}"), &["other"])
}

#[test]
fn nodes_that_follow_each_other_both_run_and_the_one_that_is_left_runs_on() {
    let domain = Domain::new();
    let nodes = [("a", "b"), ("b", "a")].map(|(name, other)| {
        domain.start_node(&format!("{name}.toml"), &one_of_a_loop(name, other), "")
    });
    let [mut a, mut b] =
        ["a", "b"].map(|name| domain.start(&format!("subscribe isochrone/{name}/telemetry")));
    wait_for_more(&mut a, WITH_FRAME, 20);
    wait_for_more(&mut b, WITH_FRAME, 20);
    let [first, _second] = nodes;
    first.kill();
    wait_for_more(&mut b, WITHOUT, 20);
}

/// The follower's configuration in a folder.
fn folder(configuration: &str) -> Domain {
    Domain::with(&[("follower.toml", configuration)])
}

#[test]
fn check_says_what_a_task_follows() {
    let text = folder(&follower()).run("check follower.toml").expect_code(0).stdout;
    let follows = "follows plant/saw within 8ms (watches for up to 8ms of each 10ms)";
    assert!(text.contains(&format!("wake sleep, {follows}, overrun skip")), "{text}");
    let with_margin =
        follower().replace("follow =", "margin = \"1ms\"\nwake = \"hybrid\"\nfollow =");
    let text = folder(&with_margin).run("check follower.toml").expect_code(0).stdout;
    assert!(text.contains("(watches for up to 9ms of each 10ms)"), "{text}");
    let follow = |configuration: &str| {
        folder(configuration).answer("check follower.toml --json")["tasks"][0]["follow"].clone()
    };
    let expected = serde_json::json!({"service": "plant/saw", "within_ns": 8_000_000});
    assert_eq!(follow(&follower()), expected);
    assert!(follow(&source("1ms")).is_null());
}

#[test]
fn a_service_that_the_task_does_not_read_is_pointed_at() {
    let text = follower().replace("{ service = \"plant/saw\"", "{ service = \"plant/swa\"");
    let error = folder(&text).run("check follower.toml").refused(2);
    assert_says(&error, &["follows \"plant/swa\"", "did you mean \"plant/saw\"?"]);
}

#[test]
fn real_time_tasks_that_would_watch_for_data_all_the_time_are_refused() {
    let follow = "priority = 5\nmargin = \"1900us\"\nfollow =";
    let domain = Domain::with(&[("follower.toml", &follower().replace("follow =", follow))]);
    let ended = domain.run("run follower.toml --cycles 1");
    let checked = domain.run("check follower.toml").expect_code(0).stderr;
    // Where the kernel does not throttle, nothing is refused.
    let is_refused = ended.status.code() != Some(0);
    assert_eq!(checked.contains("warning: run would refuse it here"), is_refused, "{checked}");
    if is_refused {
        let reasons = ["(wake = \"hybrid\", follow)", "a shorter within of follow"];
        assert_says(&ended.stderr, &reasons);
        assert_says(&checked, &reasons);
        domain.run("check --strict follower.toml").expect_code(1);
    }
}

#[test]
fn check_says_which_cpu_this_machine_does_not_have() {
    let folder = folder(&follower().replace("follow =", "cpu = 1023\nfollow ="));
    let Ended { stderr: noted, .. } = folder.run("check follower.toml").expect_code(0);
    assert_says(&noted, &["warning: task \"t\" cannot have CPU 1023 here: this process may use"]);
}

#[test]
fn simulate_takes_each_row_as_the_frame_of_a_cycle() {
    let plain = follower().replace("follow =", "# follow =");
    let simulated = |configuration: &str| {
        let folder = folder(configuration);
        folder.write("in.csv", "saw,other\n1,0\n2,0\n3,0\n");
        folder.run("simulate follower.toml --cycles 3 --inputs in.csv").expect_code(0).stdout
    };
    let rows = simulated(&follower());
    assert_eq!(cells(&rows).len(), 4, "{rows}");
    assert_eq!(rows, simulated(&plain));
}
