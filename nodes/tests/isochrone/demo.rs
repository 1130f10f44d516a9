//! The demo: three processes, live values, a summary.

use std::path::{Path, PathBuf};
use std::process::Command;

use isochrone_ipc::{FrameLayout, FramePublisher, SignalSpec};
use isochrone_testing::{Domain, Ended, Process, shared_memory, wait_until};
use rustix::process::Signal;

fn demo(arguments: &[&str]) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    command.args(arguments);
    Process::start(command)
}

/// A demo that ran for as long as it was told to. On a busy machine most of the time may be over before its
/// processes run.
fn ended(arguments: &[&str], has_run: impl Fn(&Ended) -> bool) -> Ended {
    let has_run = |ended: &Ended| {
        let gave_up = ended.stderr.contains("gave up waiting for");
        assert_eq!(ended.status.code(), Some(i32::from(gave_up)), "{}", ended.stderr);
        let has_measured = !ended.stderr.contains("stopped before anything was measured");
        !gave_up && has_measured && has_run(ended)
    };
    (0..10).map(|_| demo(arguments).finish()).find(has_run).unwrap()
}

#[test]
fn the_demo_shows_live_values_and_ends_with_a_summary_of_jitter_and_latency() {
    let has_shown_frames =
        |ended: &Ended| ended.stdout.contains("last hop") && ended.stdout.contains("level.y=");
    let ended = ended(&["demo", "--seconds", "4"], has_shown_frames);
    for part in ["task fast", "release jitter", "link plant/level", "last hop", "end to end"] {
        assert!(ended.stdout.contains(part), "{part}\n{}", ended.stdout);
    }
    assert!(!ended.stderr.contains("waiting for service"), "{}", ended.stderr);
}

#[test]
fn the_json_of_the_demo_is_a_report_of_the_node_and_the_link_and_live_values_go_to_stderr() {
    let report = |ended: &Ended| ended.json();
    let has_shown_frames = |ended: &Ended| {
        let frames = report(ended)["links"][0]["frames"].as_u64();
        frames > Some(100) && ended.stderr.contains("level.y=")
    };
    let ended = ended(&["demo", "--seconds", "3", "--json"], has_shown_frames);
    let report = report(&ended);
    assert_eq!(report["tasks"][0]["name"], "fast");
    assert!(report["tasks"][0]["cycles"].as_u64() > Some(100));
    assert_eq!(report["links"][0]["service"], "plant/level");
}

#[test]
fn a_subscriber_with_patience_as_that_of_the_demo_takes_a_late_first_frame_for_no_failure() {
    let domain = Domain::new();
    let participant = domain.join("late");
    let layout = FrameLayout { signals: vec![SignalSpec::new("x", "LREAL")], period_ns: None };
    let _silent = FramePublisher::open(&participant, "plant/late", &layout).unwrap();
    domain.expect(
        "subscribe plant/late --seconds 1.5 --patience 1h",
        3,
        &["\"plant/late\" sent nothing"],
    );
}

#[test]
fn a_demo_that_is_stopped_while_it_starts_ends_well() {
    for seconds in ["0.001", "0.01", "0.05"] {
        demo(&["demo", "--seconds", seconds]).finish().expect_code(0);
    }
}

/// A demo with its files in this folder.
fn demo_in(folder: &Path, arguments: &[&str]) -> (Process, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    command.args(arguments).env("TMPDIR", folder);
    let demo = Process::start(command);
    let prefix = format!("isodemo{}_", demo.id());
    (demo, prefix)
}

#[test]
fn a_signal_ends_the_demo_with_its_summary_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut demo, prefix) = demo_in(folder.path(), &["demo", "--seconds", "1h"]);
    demo.wait_for("level.y=");
    assert!(!shared_memory(&prefix).is_empty(), "the demo has a domain of its own");
    demo.signal(Signal::TERM);
    demo.finish().expect_code(0).prints(&["last hop"]);
    assert_eq!(shared_memory(&prefix), Vec::<PathBuf>::new());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "the folder is gone");
}

#[test]
fn without_a_verb_as_a_newcomer_starts_it_the_demo_runs() {
    let folder = tempfile::tempdir().unwrap();
    let (demo, prefix) = demo_in(folder.path(), &[]);
    wait_until("it has a domain", || !shared_memory(&prefix).is_empty());
    demo.signal(Signal::TERM);
    demo.finish().expect_code(0);
}

#[test]
fn a_node_in_two_processes_goes_on_whichever_of_them_is_killed() {
    let domain = Domain::new();
    let takeover = "the other one has taken over";
    let demo = domain.start_until("demo --redundant --seconds 600", takeover);
    let ended = demo.stop().expect_code(0);
    ended.prints(&["is killed", takeover, "takeovers, at most"]);
}
