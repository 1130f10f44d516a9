//! `bench jitter` under load. In a file of its own, so that the load starves no other test.

use std::process::Command;
use std::time::Duration;

use isochrone_testing::{Domain, Process, wait_until};
use rustix::process::{Signal, geteuid};
use serde_json::Value;

fn number(value: &Value) -> u64 {
    value.as_u64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_real_cyclictest_and_a_load_run_beside_the_loops() {
    let missing = |program: &str| Command::new(program).arg("--version").output().is_err();
    if missing("cyclictest") || missing("stress-ng") || !geteuid().is_root() {
        isochrone_testing::not_tested(
            "cyclictest and loads",
            "needs root, cyclictest (rt-tests) and stress-ng",
        );
        return;
    }
    let domain = Domain::new();
    let arms = "--arms sleep,cyclictest --load idle,cpu --seconds 0.4 --turn 0.2";
    domain.run(&format!("bench jitter {arms} --report out.json")).expect_code(0);
    let report = domain.json("out.json");
    let of = |task: &Value| (task["name"].clone(), task["load"].clone());
    let seen: Vec<(Value, Value)> = report["tasks"].as_array().unwrap().iter().map(of).collect();
    let expected =
        [("sleep", "idle"), ("cyclictest", "idle"), ("sleep", "cpu"), ("cyclictest", "cpu")];
    assert_eq!(seen, expected.map(|(name, load)| (name.into(), load.into())));
    for task in report["tasks"].as_array().unwrap() {
        let count = number(&task["release_jitter_ns"]["count"]);
        assert!((1..=400).contains(&count), "{count}");
        // Each of the two turns is whole: what did not run was missed.
        assert_eq!(
            number(&task["release_jitter_corrected_ns"]["count"]),
            count + number(&task["missed"])
        );
        assert!(number(&task["warm_up_cycles"]) > 0);
    }
}

/// Processes that a process started, by id; none of one that has ended.
fn children(process: u32) -> Vec<u32> {
    let Ok(threads) = std::fs::read_dir(format!("/proc/{process}/task")) else { return Vec::new() };
    let of = |path: std::path::PathBuf| std::fs::read_to_string(path.join("children"));
    let texts = threads.filter_map(|thread| of(thread.ok()?.path()).ok());
    texts.flat_map(|text| text.split(' ').flat_map(str::parse).collect::<Vec<_>>()).collect()
}

/// Whether it runs; one that ended and that nobody waited for does not.
fn runs(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    stat.rsplit_once(") ").is_some_and(|(_, state)| !state.starts_with('Z'))
}

#[test]
fn a_second_signal_ends_the_bench_at_once_and_its_load_with_it() {
    if Command::new("stress-ng").arg("--version").output().is_err() {
        isochrone_testing::not_tested("the end of a load", "stress-ng is not installed");
        return;
    }
    let domain = Domain::new();
    let (process, load) = bench_under_load(&domain);
    process.signal(Signal::TERM);
    // Two at once are one.
    std::thread::sleep(Duration::from_millis(50));
    process.signal(Signal::TERM);
    process.finish();
    expect_end(&load);
}

#[test]
fn a_bench_that_is_killed_ends_its_load_too() {
    let can =
        Command::new("setpriv").args(["--pdeathsig", "TERM", "stress-ng", "--version"]).output();
    if !can.is_ok_and(|can| can.status.success()) {
        isochrone_testing::not_tested("the end of a load", "stress-ng or setpriv is not installed");
        return;
    }
    let domain = Domain::new();
    let (process, load) = bench_under_load(&domain);
    process.kill();
    expect_end(&load);
}

/// Starts a long bench, and waits for its load: stress-ng and what that has started.
fn bench_under_load(domain: &Domain) -> (Process, Vec<u32>) {
    let long = "bench jitter --arms sleep --priority 0 --seconds 600 --turn 60 --load vm";
    let mut process = domain.start(long);
    let id = process.id();
    process.wait_until_it("has started the load", |_| {
        children(id).iter().any(|load| !children(*load).is_empty())
    });
    (process, children(id))
}

fn expect_end(load: &[u32]) {
    wait_until(&format!("{load:?} have ended with the bench"), || {
        !load.iter().any(|process| runs(*process))
    });
}
