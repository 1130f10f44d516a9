//! The verbs mark every value that is computed from a dead sensor, in its node and in the next one.

use std::thread;
use std::time::{Duration, Instant};

use crate::plant::{run, sensor};
use isochrone_testing::{Domain, PATIENCE, wait_until};
use serde_json::{Value, json};

/// Two tasks, the second of which reads what the first computes of the sensor.
const FIRST: &str = r#"
[node]
name = "first"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[task]]
name = "slow"
period = "10ms"
[[input]]
name = "level"
service = "plant/sensor"
task = "fast"
max_age = "500ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "level", setChangeRate = 10.0 }
[[block]]
name = "late"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.delayedValue", setChangeRate = 10.0 }
[[block]]
name = "alone"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 1.0, setChangeRate = 10.0 }
[[output]]
service = "first/out"
task = "fast"
signals = ["ramp.delayedValue"]
"#;

/// Takes what it gets.
const SECOND: &str = r#"
[node]
name = "second"
[[task]]
name = "t"
period = "5ms"
[[input]]
name = "got"
service = "first/out"
signal = "ramp.delayedValue"
max_age = "60s"
[[block]]
name = "next"
type = "LimRateOfChangeCI"
in = { value = "got", setChangeRate = 10.0 }
"#;

fn quality(domain: &Domain, names: &str) -> Value {
    let stdout = domain.run(&format!("get {names} --json")).expect_code(0).stdout;
    serde_json::from_str::<Value>(&stdout).unwrap()["quality"].clone()
}

/// Asks until the answer is this: a sensor that has no CPU for a while is stale for a while.
#[track_caller]
fn wait_for_quality(domain: &Domain, names: &str, expected: &Value) {
    let since = Instant::now();
    loop {
        let quality = quality(domain, names);
        if quality == *expected {
            return;
        }
        assert!(since.elapsed() < PATIENCE, "{quality}, not {expected}");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn what_is_computed_from_a_dead_sensor_is_marked_through_blocks_tasks_and_nodes() {
    let domain = Domain::new();
    let first = run(&domain, "first.toml", FIRST);
    let second = run(&domain, "second.toml", SECOND);
    let sensor = sensor(&domain, "1.5");
    let all = "first level level.ok ramp.value ramp.setChangeRate ramp.delayedValue late.delayedValue alone.delayedValue";
    wait_for_quality(&domain, all, &json!({}));
    wait_for_quality(&domain, "second got next.delayedValue", &json!({}));

    let mut watch = domain.start("watch first late.delayedValue");
    watch.wait_for("late.delayedValue=1.5\n");
    sensor.kill();
    let stale = json!({
        "level": ["STALE"],
        "ramp.value": ["STALE"],
        "ramp.delayedValue": ["STALE"],
        "late.delayedValue": ["STALE"],
    });
    wait_for_quality(&domain, all, &stale);
    watch.wait_for("late.delayedValue=1.5 [STALE]\n");
    watch.stop().expect_code(0);
    let upstream = json!({"got": ["UPSTREAM"], "next.delayedValue": ["UPSTREAM"]});
    wait_for_quality(&domain, "second got next.delayedValue", &upstream);

    let shown = domain.run("show first level late.delayedValue alone.delayedValue").expect_code(0);
    let end_of = |name: &str| {
        let line = shown.stdout.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_once("LREAL").unwrap().1.trim().to_owned()
    };
    assert_eq!(end_of("level "), "not ok, STALE");
    assert_eq!(end_of("late.delayedValue "), "STALE");
    assert_eq!(end_of("alone.delayedValue "), "");
    let got = domain.run("get first ramp.delayedValue alone.delayedValue").expect_code(0);
    assert_eq!(got.stdout, "1.5\n1\n", "a script reads values alone");
    assert_eq!(got.complaints(), "warning: ramp.delayedValue is STALE");
    let quiet = domain.run("get first alone.delayedValue").expect_code(0);
    assert_eq!(quiet.complaints(), "");
    [first, second].into_iter().for_each(|node| drop(node.stop().expect_code(0)));
}

#[test]
fn an_input_is_marked_by_what_it_is_worth_under_a_force_of_its_ok() {
    let domain = Domain::new();
    let first = run(&domain, "first.toml", FIRST);
    let sensor = sensor(&domain, "5");
    let wait_for_mark = |is_marked: bool| {
        wait_until("the mark follows the sensor", || {
            let shown = domain.run("show first level").expect_code(0).stdout;
            let line = shown.lines().find(|line| line.starts_with("level ")).unwrap();
            line.contains("not ok") == is_marked
        });
    };
    domain.run("force first level.ok=false --hold").expect_code(0);
    wait_for_mark(false);
    domain.run("force first level.ok=true --hold").expect_code(0);
    sensor.stop().expect_code(0);
    wait_for_mark(true);
    first.stop().expect_code(0);
}

#[test]
fn a_force_marks_what_it_acts_on_and_leaves_no_mark_behind() {
    let domain = Domain::new();
    let first = run(&domain, "first.toml", FIRST);
    domain.run("force first alone.value=3 --hold").expect_code(0);
    let forced = json!({"alone.value": ["FORCED"], "alone.delayedValue": ["FORCED"]});
    let names = "first alone.value alone.delayedValue alone.setChangeRate";
    assert_eq!(quality(&domain, names), forced);
    let shown = domain.run("show first alone").expect_code(0).stdout;
    let line = |name: &str| shown.lines().find(|line| line.starts_with(name)).unwrap();
    assert!(line("alone.value").ends_with("forced"), "{shown}");
    assert!(line("alone.delayedValue").ends_with("FORCED"), "{shown}");
    domain.run("release first --all").expect_code(0);
    assert_eq!(quality(&domain, names), json!({}));
    // Without a sample, what is computed from an input is computed from its default.
    let substitute = json!({"late.delayedValue": ["SUBSTITUTE"]});
    wait_for_quality(&domain, "first late.delayedValue", &substitute);
    first.stop().expect_code(0);
}
