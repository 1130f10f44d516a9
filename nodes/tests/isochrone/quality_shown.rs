//! The verbs mark every value that is computed from a dead sensor, in its node and in the next one.

use crate::plant::sensor;
use isochrone_testing::plants::{GAUGE, tank};
use isochrone_testing::{Domain, Plant, wait_for_ok, wait_until};
use serde_json::{Value, json};

/// Takes what it gets of the gauge.
fn second() -> Plant {
    Plant::new("second")
        .task("t", "5ms")
        .input("got", "level/out", "signal = \"ramp.delayedValue\"\nmax_age = \"60s\"")
        .ramp("next", "value = \"got\", setChangeRate = 10.0")
}

fn quality(domain: &Domain, names: &str) -> Value {
    domain.answer(&format!("get {names} --json"))["quality"].clone()
}

/// Asks until the answer is this: a sensor that has no CPU for a while is stale for a while.
#[track_caller]
fn wait_for_quality(domain: &Domain, names: &str, expected: &Value) {
    wait_for_ok(&format!("the quality is {expected}"), || {
        let quality = quality(domain, names);
        if quality == *expected { Ok(()) } else { Err(quality) }
    });
}

#[test]
fn what_is_computed_from_a_dead_sensor_is_marked_through_blocks_tasks_and_nodes() {
    let (domain, _first) = tank(GAUGE);
    let _second = domain.start_node("second.toml", &second(), "");
    let sensor = sensor(&domain, "1.5");
    let all = "level x x.ok ramp.value ramp.setChangeRate ramp.delayedValue late.delayedValue alone.delayedValue";
    wait_for_quality(&domain, all, &json!({}));
    wait_for_quality(&domain, "second got next.delayedValue", &json!({}));

    let mut watch = domain.start_until("watch level late.delayedValue", "late.delayedValue=1.5\n");
    sensor.kill();
    let stale = json!({
        "x": ["STALE"],
        "ramp.value": ["STALE"],
        "ramp.delayedValue": ["STALE"],
        "late.delayedValue": ["STALE"],
    });
    wait_for_quality(&domain, all, &stale);
    watch.wait_for("late.delayedValue=1.5 [STALE]\n");
    watch.stop().expect_code(0);
    let upstream = json!({"got": ["UPSTREAM"], "next.delayedValue": ["UPSTREAM"]});
    wait_for_quality(&domain, "second got next.delayedValue", &upstream);

    let shown = domain.run("show level x late.delayedValue alone.delayedValue").expect_code(0);
    let end_of = |name: &str| {
        let line = shown.stdout.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_once("LREAL").unwrap().1.trim().to_owned()
    };
    assert_eq!(end_of("x "), "not ok, STALE");
    assert_eq!(end_of("late.delayedValue "), "STALE");
    assert_eq!(end_of("alone.delayedValue "), "");
    let got = domain.run("get level ramp.delayedValue alone.delayedValue").expect_code(0);
    assert_eq!(got.stdout, "1.5\n1\n", "a script reads values alone");
    assert_eq!(got.complaints(), "warning: ramp.delayedValue is STALE");
    let quiet = domain.run("get level alone.delayedValue").expect_code(0);
    assert_eq!(quiet.complaints(), "");
}

#[test]
fn an_input_is_marked_by_what_it_is_worth_under_a_force_of_its_ok() {
    let (domain, _first) = tank(GAUGE);
    let sensor = sensor(&domain, "5");
    let wait_for_mark = |is_marked: bool| {
        wait_until("the mark follows the sensor", || {
            let shown = domain.run("show level x").expect_code(0).stdout;
            let line = shown.lines().find(|line| line.starts_with("x ")).unwrap();
            line.contains("not ok") == is_marked
        });
    };
    domain.run("force level x.ok=false --hold").expect_code(0);
    wait_for_mark(false);
    domain.run("force level x.ok=true --hold").expect_code(0);
    sensor.stop().expect_code(0);
    wait_for_mark(true);
}

#[test]
fn a_force_marks_what_it_acts_on_and_leaves_no_mark_behind() {
    let (domain, _first) = tank(GAUGE);
    domain.run("force level alone.value=3 --hold").expect_code(0);
    let forced = json!({"alone.value": ["FORCED"], "alone.delayedValue": ["FORCED"]});
    let names = "level alone.value alone.delayedValue alone.setChangeRate";
    assert_eq!(quality(&domain, names), forced);
    let shown = domain.run("show level alone").expect_code(0).stdout;
    let line = |name: &str| shown.lines().find(|line| line.starts_with(name)).unwrap();
    assert!(line("alone.value").ends_with("forced"), "{shown}");
    assert!(line("alone.delayedValue").ends_with("FORCED"), "{shown}");
    domain.run("release level --all").expect_code(0);
    assert_eq!(quality(&domain, names), json!({}));
    // Without a sample, what is computed from an input is computed from its default.
    let substitute = json!({"late.delayedValue": ["SUBSTITUTE"]});
    wait_for_quality(&domain, "level late.delayedValue", &substitute);
}
