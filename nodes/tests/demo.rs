//! The demo: three processes, live values, a summary.

mod domain;

use std::process::Command;

use domain::{Process, shared_memory};
use rustix::process::Signal;
use serde_json::Value;

fn demo(arguments: &[&str]) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    command.args(arguments);
    Process::start(command)
}

#[test]
fn the_demo_shows_live_values_and_ends_with_a_summary_of_jitter_and_latency() {
    let mut demo = demo(&["demo", "--seconds", "4"]);
    demo.wait_for("level.y=");
    let ended = demo.finish().expect_code(0);
    for part in ["task fast", "release jitter", "link plant/level", "last hop", "end to end"] {
        assert!(ended.stdout.contains(part), "{part}\n{}", ended.stdout);
    }
    assert!(!ended.stderr.contains("waiting for service"), "{}", ended.stderr);
}

#[test]
fn the_demo_s_json_is_a_report_of_the_node_and_the_link() {
    let ended = demo(&["demo", "--seconds", "3", "--json"]).finish().expect_code(0);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["tasks"][0]["name"], "fast");
    assert!(report["tasks"][0]["cycles"].as_u64() > Some(100));
    assert_eq!(report["links"][0]["service"], "plant/level");
    assert!(report["links"][0]["frames"].as_u64() > Some(100));
    assert!(ended.stderr.contains("level.y="), "live values go to stderr\n{}", ended.stderr);
}

#[test]
fn a_demo_that_is_stopped_while_it_starts_ends_well() {
    for seconds in ["0.001", "0.01", "0.05"] {
        demo(&["demo", "--seconds", seconds]).finish().expect_code(0);
    }
}

#[test]
fn a_signal_ends_the_demo_with_its_summary_and_leaves_nothing() {
    // Without a verb, as a newcomer starts it.
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    let folder = tempfile::tempdir().unwrap();
    command.env("TMPDIR", folder.path());
    let mut demo = Process::start(command);
    demo.wait_for("level.y=");
    let prefix = format!("isodemo{}_", demo.id());
    assert!(!shared_memory(&prefix).is_empty(), "the demo has a domain of its own");
    demo.signal(Signal::TERM);
    let ended = demo.finish().expect_code(0);
    assert!(ended.stdout.contains("last hop"), "{}", ended.stdout);
    assert_eq!(shared_memory(&prefix), Vec::<std::path::PathBuf>::new());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "the folder is gone");
}
