//! The examples beside real nodes.

use std::process::Command;

use isochrone_testing::{Domain, Process, not_tested};

use crate::installed::{Valgrind, command, example, start, workspace};

fn pump() -> String {
    std::fs::read_to_string(workspace().join("examples/cpp/pump.toml")).unwrap()
}

/// Waits until the newest line of a program begins so.
#[track_caller]
fn says(program: &mut Process, beginning: &str) {
    let is_newest =
        |stdout: &str| stdout.lines().last().is_some_and(|line| line.starts_with(beginning));
    program.wait_until(beginning, |stdout, _| is_newest(stdout));
}

#[test]
fn an_actuator_follows_a_sensor_through_a_node_and_closes_when_one_of_them_is_silent() {
    let domain = Domain::new();
    let mut actuator = start(&domain, &example("actuator"), &[]);
    let node = domain.start_node("pump.toml", &pump(), "");
    let mut sensor = start(&domain, &example("sensor"), &[]);
    sensor.wait_for("sends plant/pressure");
    says(&mut actuator, "follows: ");
    // It does not say that it ends: its values become too old, and the node says so.
    sensor.kill();
    says(&mut actuator, "closed: no good value");
    let sensor = start(&domain, &example("sensor"), &[]);
    says(&mut actuator, "follows: ");
    // It says so with its last frame.
    sensor.stop().expect_code(0);
    says(&mut actuator, "closed: no good value");
    let _sensor = start(&domain, &example("sensor"), &[]);
    says(&mut actuator, "follows: ");
    node.kill();
    says(&mut actuator, "closed: no good value");
    actuator.stop().expect_code(0);
}

#[test]
fn a_controller_stands_in_for_the_node_and_commands_its_safe_value_while_it_has_no_good_pressure() {
    let domain = Domain::new();
    let mut actuator = start(&domain, &example("actuator"), &[]);
    let mut controller = start(&domain, &example("controller"), &[]);
    let mut sensor = start(&domain, &example("sensor"), &[]);
    sensor.wait_for("sends plant/pressure");
    says(&mut controller, "controls");
    says(&mut actuator, "follows: ");
    sensor.kill();
    says(&mut controller, "safe: no good pressure");
    says(&mut actuator, "closed: no good value");
    let monitor = start(&domain, &example("monitor"), &["plant/valve", "1"]).finish();
    let printed = monitor.expect_code(0).stdout;
    assert!(printed.contains(": valve.y = 0 % (") && printed.contains("flags 3)"), "{printed}");
    let _sensor = start(&domain, &example("sensor"), &[]);
    says(&mut controller, "controls");
    says(&mut actuator, "follows: ");
    controller.stop().expect_code(0);
    says(&mut actuator, "closed: no good value");
    actuator.stop().expect_code(0);
}

#[test]
fn a_sensor_and_an_actuator_beside_a_node_make_no_error_of_memory() {
    let domain = Domain::new();
    let by_valgrind = |name| Process::start(command(&domain, &example(name), &[], Valgrind::All));
    let _node = domain.start_node("pump.toml", &pump(), "");
    let mut sensor = by_valgrind("sensor");
    sensor.wait_for("sends plant/pressure");
    let monitor = Process::start(command(
        &domain,
        &example("monitor"),
        &["plant/valve", "3", "pump", "valve.y"],
        Valgrind::All,
    ));
    monitor.finish().expect_code(0);
    let mut actuator = by_valgrind("actuator");
    actuator.wait_for("reads plant/valve");
    for program in [actuator, sensor] {
        program.stop().expect_code(0);
    }
}

#[test]
fn a_monitor_prints_names_and_units_and_asks_the_node() {
    let domain = Domain::new();
    let _node = domain.start_node("pump.toml", &pump(), "");
    let mut sensor = start(&domain, &example("sensor"), &[]);
    sensor.wait_for("sends plant/pressure");
    let monitor = |arguments: &[&str]| start(&domain, &example("monitor"), arguments).finish();
    let printed = monitor(&["plant/pressure", "3", "pump", "pressure"]).expect_code(0).stdout;
    let lines: Vec<_> = printed.lines().collect();
    assert_eq!(lines.len(), 4, "{printed}");
    assert!(lines[0].contains(": pressure = ") && lines[0].contains(" bar ("), "{printed}");
    assert!(lines[3].contains("\"values\":{\"pressure\":"), "{printed}");
    let refused = monitor(&["plant/pressure", "1", "pump", "presure"]).expect_code(1);
    let sentence = "presure: there is no signal \"presure\"; did you mean \"pressure\"?\n";
    assert_eq!(refused.stderr, sentence);
    assert!(refused.stdout.contains("\"code\":1,"), "{}", refused.stdout);
    let absent = monitor(&["plant/pressure", "1", "pomp", "x"]).expect_code(1).stderr;
    assert_eq!(absent, "pomp: no node \"pomp\" runs here; did you mean \"pump\"?\n");
}

#[test]
fn an_actuator_in_cpp_follows_a_sensor_in_python_through_a_node() {
    let python = workspace().join("target/python/bin/python3");
    let has_iceoryx2 = Command::new(&python).args(["-c", "import iceoryx2"]).output();
    if !has_iceoryx2.is_ok_and(|output| output.status.success()) {
        assert!(std::env::var_os("CI").is_none(), "{python:?} has no iceoryx2");
        return not_tested(
            "a sensor in Python",
            "target/python has no iceoryx2; bash .ci/run installs it",
        );
    }
    let domain = Domain::new();
    let pump = pump()
        .replace("service = \"plant/pressure\"", "service = \"plant/python\"")
        .replace("signal = \"pressure\"", "signal = \"sine\"")
        .replace("unit = \"bar\"", "unit = \"m\"");
    let _node = domain.start_node("pump.toml", &pump, "");
    let mut actuator = start(&domain, &example("actuator"), &[]);
    let mut writer = Command::new(python);
    writer.arg(workspace().join("examples/python/bare/writer.py")).args([
        "plant/python",
        "100000",
        "200",
    ]);
    writer.env("ICEORYX2_CONFIG", domain.config_file());
    let writer = Process::start(writer);
    says(&mut actuator, "follows: ");
    writer.stop().expect_code(0);
    says(&mut actuator, "closed: no good value");
    actuator.stop().expect_code(0);
}
