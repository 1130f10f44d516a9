//! Services that were to be recorded and are not, or of which nothing comes: what is said of them, and that the others are
//! recorded all the same.

use std::fs;
use std::process::Command;

use isochrone_ipc::{Depth, FrameSubscriber, ipc};
use isochrone_testing::{Domain, Process, wait_until};
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, prlimit};
use serde_json::Value;

use crate::record_files::{plant, read, recording};

#[test]
fn a_recording_that_lacks_a_service_which_was_named_is_not_complete_and_no_success() {
    let (domain, node) = plant();
    let line = "record plant/saw plant/none -o out.mcap --json";
    let ended = recording(&domain, line, "out.mcap").stop().expect_code(1);
    assert!(ended.stderr.contains("not recorded: \"plant/none\""), "{}", ended.stderr);
    let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
    let left_out = &summary["left_out"][0];
    assert_eq!(left_out["service"], "plant/none");
    assert_eq!(left_out["why"], "no such service or node was found");
    assert_eq!((&summary["is_complete"], &summary["unwritten_frames"]), (&false.into(), &0.into()));
    node.stop().expect_code(0);
}

#[test]
fn with_too_few_descriptors_a_recording_lacks_no_service_unless_it_says_so() {
    let (domain, node) = plant();
    let participant = domain.join("holder");
    let names: Vec<String> = (0..8).map(|number| format!("plant/s{number}")).collect();
    let open =
        |name| FrameSubscriber::<ipc::Service>::open(&participant, name, 1, Depth::Newest).unwrap();
    let _held: Vec<_> = names.iter().map(|name| open(name)).collect();
    for limit in [20, 30, 40, 60] {
        let mut command = Command::new("sh");
        command.args(["-c", "ulimit -n $0; exec \"$@\"", &limit.to_string()]);
        command.arg(env!("CARGO_BIN_EXE_isochrone")).args(["record", "plant/saw"]).args(&names);
        command.args(["-o", "out.mcap", "--json", "--seconds", "1", "--iceoryx2-config"]);
        command.arg(domain.config_file()).current_dir(domain.path(""));
        let ended = Process::start(command).finish();
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
        let is_success = ended.status.success();
        let Ok(summary) = serde_json::from_str::<Value>(&ended.stdout) else {
            // It could not even join the domain.
            assert!(
                !is_success && ended.stderr.contains("(ulimit -n)"),
                "{limit}: {}",
                ended.stderr
            );
            continue;
        };
        for left_out in summary["left_out"].as_array().unwrap() {
            assert!(
                left_out["why"].as_str().unwrap().contains("(ulimit -n)"),
                "{limit}: {summary}"
            );
        }
        let services = summary["services"].as_array().unwrap().len();
        let is_whole = services == 1 + names.len();
        assert_eq!(summary["is_complete"], is_whole, "{limit}: {summary}");
        assert!(is_whole || !is_success, "{limit}: {summary}");
    }
    node.stop().expect_code(0);
}

/// Records `plant/saw`, and `plant/late` once it comes, with so many descriptors.
fn record_with(domain: &Domain, descriptors: u32, more: &str) -> Process {
    let shell = format!("ulimit -n {descriptors}; exec \"$0\" \"$@\"");
    let line = format!("record plant/saw plant/late -o out.mcap --json {more}");
    domain.start_by(&["sh", "-c", &shell], &line)
}

#[test]
fn a_service_that_cannot_be_opened_keeps_a_recording_neither_from_its_frames_nor_from_its_end() {
    let domain = Domain::new();
    let _saw = domain.publish("plant/saw --wave sine --signals y --rate 1000");
    let is_enough = |descriptors: &u32| {
        let ended = record_with(&domain, *descriptors, "--seconds 0.5").finish();
        let summary = serde_json::from_str::<Value>(&ended.stdout);
        let is_recorded = summary.is_ok_and(|summary| summary["frames"].as_u64() > Some(0));
        if !is_recorded {
            return false;
        }
        fs::remove_file(domain.path("out.mcap")).unwrap();
        true
    };
    let least = (12..60).find(is_enough).unwrap();
    let mut recorder = record_with(&domain, least, "");
    recorder.wait_for("recording \"plant/saw\"");
    let _late = domain.publish("plant/late --value 1");
    recorder.wait_for("warning: \"plant/late\" is not recorded");
    let length = || fs::metadata(domain.path("out.mcap")).unwrap().len();
    let before = length();
    wait_until("the recording goes on for some seconds", || length() > before + 200_000);
    let summary = recorder.stop().expect_code(1).json();
    assert_eq!(summary["left_out"][0]["service"], "plant/late");
    assert!(summary["left_out"][0]["why"].as_str().unwrap().contains("(ulimit -n)"), "{summary}");
    let count = |of: &str| summary["services"][0][of].as_u64().unwrap();
    assert!(count("lost") < count("frames"), "{summary}");
}

#[test]
fn services_that_cannot_be_looked_for_for_a_while_end_no_recording() {
    let (domain, node) = plant();
    let mut recorder = recording(&domain, "record -o out.mcap --json", "out.mcap");
    let id = Pid::from_raw(recorder.id() as i32).unwrap();
    let limit = getrlimit(Resource::Nofile);
    let none = Rlimit { current: Some(3), maximum: limit.maximum };
    prlimit(Some(id), Resource::Nofile, none).unwrap();
    recorder.wait_for("warning: services that come now are not found");
    let length = || fs::metadata(domain.path("out.mcap")).unwrap().len();
    let before = length();
    wait_until("the recording goes on", || length() > before);
    prlimit(Some(id), Resource::Nofile, limit).unwrap();
    recorder.wait_for("note: services that come now are found again");
    let ended = recorder.stop().expect_code(0);
    let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(summary["is_complete"], true, "{summary}");
    assert_eq!(summary["frames"], read(domain.path("out.mcap")));
    node.stop().expect_code(0);
}

#[test]
fn a_publisher_that_is_stopped_is_named_to_those_who_wait_for_its_frames() {
    let domain = Domain::new();
    let publisher = domain.publish("plant/level --value 1");
    publisher.signal(Signal::STOP);
    let pid = publisher.id();
    wait_until("it is stopped", || isochrone_ipc::is_stopped(pid));
    let told = format!("its process {pid} is stopped: continue it (kill -CONT {pid})");
    domain.expect("subscribe plant/level --seconds 0.5", 1, &[&told]);
    let ended = domain.expect("record plant/level -o out.mcap --seconds 0.5 --json", 1, &[&told]);
    let summary = ended.json();
    assert_eq!(summary["is_complete"], false);
    assert_eq!(summary["left_out"][0]["service"], "plant/level");
    publisher.signal(Signal::CONT);
    publisher.stop().expect_code(0);
}
