//! Telemetry: what an observer of a node sees of it.

use std::collections::HashMap;

use isochrone_testing::{Domain, Plant};

fn seen() -> Plant {
    Plant::new("seen")
        .task("t", "5ms")
        .input("x", "seen/in", "default = -1.0")
        .times(2.0, "double", "\"x\"")
        .saw("saw", "incrementRange = 1, numberSteps = 30000")
}

/// The columns of a recording by name.
fn columns(recording: &str) -> HashMap<&str, Vec<f64>> {
    let mut rows = recording.lines().map(|row| row.split(','));
    let names: Vec<&str> = rows.next().unwrap().collect();
    let mut columns: HashMap<&str, Vec<f64>> = HashMap::new();
    for row in rows {
        for (name, value) in names.iter().zip(row) {
            columns.entry(name).or_default().push(value.parse().unwrap());
        }
    }
    columns
}

#[test]
fn an_observer_sees_the_signals_of_a_task_and_the_timing_of_its_cycles() {
    let domain = Domain::new();
    let node = domain.start_node("node.toml", &seen(), "--report node.json");
    let mut observer = domain.start_until("subscribe isochrone/seen/telemetry", "double.y=-2.0");
    let publisher = domain.start("publish seen/in --value 7.5 --rate 100");
    observer.wait_for("double.y=15.0");
    domain.run("subscribe isochrone/seen/telemetry --csv seen.csv --count 30").expect_code(0);
    for process in [publisher, observer, node] {
        process.stop().expect_code(0);
    }

    let recording = domain.read("seen.csv");
    let seen = columns(&recording);
    assert!(seen["x"].iter().all(|x| *x == 7.5), "{recording}");
    assert!(seen["double.y"].iter().all(|y| *y == 15.0), "{recording}");
    assert!(seen["saw.value"].is_sorted() && seen["task.t.cycle"].is_sorted(), "{recording}");
    assert!(seen["saw.value"].first() < seen["saw.value"].last(), "{recording}");
    assert!(seen["task.t.cycle"].first() < seen["task.t.cycle"].last(), "{recording}");
    let times = seen["task.t.execution_ns"].iter().zip(&seen["task.t.response_ns"]);
    assert!(times.clone().all(|(execution, response)| 0.0 < *execution && execution <= response));
    let report = domain.json("node.json");
    assert_eq!(report["warnings"].as_array().unwrap().len(), 0, "{report}");
    assert!(report["tasks"][0]["lost_snapshots"].is_u64(), "{report}");
}

#[test]
fn a_task_with_more_signals_than_telemetry_shows_is_told_so_and_runs() {
    let domain = Domain::new();
    let many = seen().replace("type = \"SawTooth\"", "type = \"SawTooth\"\ncount = 2000");
    let node = domain.start_node("node.toml", &many, "--strict --report node.json");
    domain.run("subscribe isochrone/seen/telemetry --csv seen.csv --count 3").expect_code(0);
    let ended = node.stop().expect_code(0);
    // One input with its ok and age, three outputs of the scale, and the saws.
    let told = "task \"t\" has 2006 signals, and isochrone/seen/telemetry shows the first 1024";
    assert!(ended.stderr.contains(told), "{}", ended.stderr);
    assert_eq!(domain.json("node.json")["warnings"][0]["code"], "telemetry_cut");
    let recording = domain.read("seen.csv");
    // Time and cycle of the frame, six times of the task, and the signals.
    assert_eq!(recording.lines().next().unwrap().split(',').count(), 2 + 6 + 1024);
    assert!(recording.lines().next().unwrap().ends_with(",saw.1017.value"), "{recording}");
}
