//! `bench latency` as a user runs it: every arm between two processes, and nothing left behind.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use isochrone_machine::Environment;
use isochrone_testing::{Domain, Ended, Process, shared_memory, wait_until};
use rustix::process::Signal;
use serde_json::Value;

/// Where real-time priority is allowed, nodes that follow poll at the same one: of two benches at a time, the second
/// may have no CPU for as long as the first runs.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A bench that has a folder for its temporary files.
struct Bench {
    folder: tempfile::TempDir,
    process: Process,
    _alone: MutexGuard<'static, ()>,
}

impl Bench {
    fn start(arguments: &str) -> Self {
        let alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
        command.args(["bench", "latency"]).args(arguments.split_whitespace());
        command.current_dir(folder.path()).env("TMPDIR", folder.path());
        Self { folder, process: Process::start(command), _alone: alone }
    }

    /// Files that the bench has in shared memory.
    fn shared_memory(&self) -> Vec<PathBuf> {
        shared_memory(&format!("isobench{}_", self.process.id()))
    }

    /// Its end; it must have left nothing.
    fn finish(self) -> Ended {
        let prefix = format!("isobench{}_", self.process.id());
        let ended = self.process.finish();
        assert_eq!(shared_memory(&prefix), Vec::<PathBuf>::new());
        assert_eq!(fs::read_dir(self.folder.path()).unwrap().count(), 0, "the folder is gone");
        assert_eq!(processes_in(self.folder.path()), 0, "nobody is left");
        ended
    }
}

/// Processes whose working directory is in a folder: the bench starts its own there.
fn processes_in(folder: &Path) -> usize {
    let cwd = |entry: fs::DirEntry| fs::read_link(entry.path().join("cwd")).ok();
    let all = fs::read_dir("/proc").unwrap().flatten().filter_map(cwd);
    all.filter(|cwd| cwd != folder && cwd.starts_with(folder)).count()
}

#[track_caller]
fn report(arguments: &str) -> Value {
    let ended = Bench::start(&format!("{arguments} --json")).finish().expect_code(0);
    serde_json::from_str(&ended.stdout).unwrap()
}

fn links(report: &Value) -> &Vec<Value> {
    report["links"].as_array().unwrap()
}

const ARMS: [&str; 6] = ["raw", "ports", "unix", "pipe", "tcp", "cache_line"];

#[test]
fn back_to_back_every_arm_has_samples_of_every_size_and_loses_nothing() {
    let report = report(
        "--arms raw,ports,unix,pipe,tcp,cache_line --pace back-to-back --values 1,4096 \
         --seconds 0.1 --turn 0.05",
    );
    let found: Vec<(&str, u64)> = links(&report)
        .iter()
        .map(|link| (link["service"].as_str().unwrap(), link["values"].as_u64().unwrap()))
        .collect();
    let expected: Vec<(&str, u64)> =
        [1, 4096].iter().flat_map(|values| ARMS.map(|arm| (arm, *values))).collect();
    assert_eq!(found, expected);
    for link in links(&report) {
        assert!(link["one_way_ns"]["count"].as_u64() > Some(0), "{link}");
        assert!(link["one_way_ns"]["mean"].as_f64() > Some(0.0), "{link}");
        assert_eq!(link["frames"], link["one_way_ns"]["count"], "{link}");
        assert_eq!(link["lost"], 0, "{link}");
        assert_eq!(link["turns"].as_array().unwrap().len(), 2, "{link}");
        assert!(link["paced_hz"].is_null(), "{link}");
    }
    assert!(report["ended_early"].is_null());
}

#[test]
fn paced_every_arm_has_samples_at_no_more_than_its_pace() {
    let report = report(
        "--arms raw,ports,unix,pipe,tcp,cache_line --pace 500 --values 64 --seconds 0.1 --turn 0.1",
    );
    assert_eq!(links(&report).len(), ARMS.len());
    for link in links(&report) {
        let frames = link["frames"].as_u64().unwrap();
        assert!((1..=45).contains(&frames), "nine tenths of a turn are counted: {link}");
        assert_eq!(link["paced_hz"], 500.0);
        // Shared memory has room for one message: a reader that is late misses one.
        assert!(link["service"] == "cache_line" || link["lost"] == 0, "{link}");
    }
}

#[test]
fn arms_are_compared_with_the_first_one() {
    let report =
        report("--arms raw,ports --pace back-to-back --values 1 --seconds 0.5 --turn 0.05");
    // Left out where there is nothing to compare.
    let comparisons = report["comparisons"].as_array().into_iter().flatten();
    let medians = comparisons.filter(|comparison| comparison["percentile"] == "p50");
    let pairs: Vec<_> = medians.map(|c| (c["reference"].clone(), c["candidate"].clone())).collect();
    // Where too many turns were disturbed there is nothing to compare.
    let valid = |link: &Value| {
        link["turns"].as_array().unwrap().iter().filter(|b| b["invalid"].is_null()).count()
    };
    if links(&report).iter().all(|link| valid(link) == 10) {
        assert_eq!(
            pairs,
            [("raw (back to back, 1 value)".into(), "ports (back to back, 1 value)".into())]
        )
    } else {
        assert!(pairs.len() <= 1)
    }
}

#[test]
fn receivers_that_block_get_the_same_messages() {
    let report = report(
        "--arms unix,pipe,tcp --wait block --pace 500,back-to-back --values 1,4096 --seconds 0.3 \
         --turn 0.1",
    );
    assert_eq!(links(&report).len(), 3 * 2 * 2);
    for link in links(&report) {
        assert!(link["one_way_ns"]["count"].as_u64() > Some(0), "{link}");
        assert_eq!(link["lost"], 0, "{link}");
    }
}

#[test]
fn through_a_node_the_value_has_an_age_at_every_stage() {
    let report =
        report("--arms ports,node --pace back-to-back --values 64 --seconds 0.4 --turn 0.2");
    let node = links(&report).iter().find(|link| link["service"] == "node").unwrap();
    assert_eq!((&node["paced_hz"], &node["values"]), (&1000.0.into(), &1.into()));
    let min = |stage: &str| node[stage]["min"].as_u64().unwrap_or_else(|| panic!("{stage} {node}"));
    assert!(min("one_way_ns") > 0);
    assert!(min("end_to_end_ns") > min("age_at_publish_ns"), "{node}");
    for stage in ["one_way_ns", "age_at_release_ns", "age_at_publish_ns", "end_to_end_ns"] {
        assert!(node["histograms"][stage].as_str().unwrap().starts_with("HISTFAAA"), "{stage}");
    }
    assert_eq!(node["turns"].as_array().unwrap().len(), 2);
}

#[test]
fn through_nodes_that_follow_a_value_comes_back_at_every_pace_that_they_can_have() {
    let arguments = "--arms ports,follow,chain --pace 500,2000,back-to-back --values 1,64 \
                     --seconds 0.2 --turn 0.1";
    let through = |report: &Value| -> Vec<Value> {
        let is_followed = |link: &&Value| link["service"] == "follow" || link["service"] == "chain";
        links(report).iter().filter(is_followed).cloned().collect()
    };
    // Where something else has the CPUs for a whole turn, nothing comes back in it.
    let has_samples = |link: &Value| link["one_way_ns"]["count"].as_u64() > Some(0);
    let mut reports = (0..20).map(|_| report(arguments));
    let report = reports.find(|report| through(report).iter().all(has_samples)).unwrap();
    let found: Vec<(Value, Value, Value)> = through(&report)
        .iter()
        .map(|link| (link["service"].clone(), link["paced_hz"].clone(), link["values"].clone()))
        .collect();
    let expected = [("follow", 500.0), ("chain", 500.0), ("follow", 2000.0), ("chain", 2000.0)]
        .map(|(arm, hz)| (arm.into(), hz.into(), 1.into()));
    assert_eq!(found, expected);
    for link in through(&report) {
        assert_eq!(link["frames"], link["one_way_ns"]["count"], "{link}");
        assert!(link["timed_out"].is_u64(), "{link}");
        let min =
            |stage: &str| link[stage]["min"].as_u64().unwrap_or_else(|| panic!("{stage} {link}"));
        assert!(min("one_way_ns") >= min("end_to_end_ns"), "{link}");
        assert!(min("end_to_end_ns") > min("age_at_publish_ns"), "{link}");
        assert_eq!(link["age_at_release_ns"]["count"], 0, "{link}");
    }
    let others = links(&report).iter().filter(|link| link["service"] == "ports");
    assert!(others.clone().count() == 6 && others.clone().all(|link| link["timed_out"].is_null()));
    let cpus = report["environment"]["cpus"].as_u64().unwrap();
    let warnings = report["warnings"].as_array().unwrap();
    let is_shared = warnings.iter().any(|warning| warning["code"] == "chain_shares_cpu");
    assert!(is_shared || cpus > 2, "{warnings:?}");
}

#[test]
fn where_the_ends_and_the_nodes_run_is_said() {
    let arguments = "--arms follow,chain,node,raw --pace 1000 --values 1 --seconds 0.1 --turn 0.1";
    let ended = Bench::start(arguments).finish().expect_code(0).says(&[
        "note: follow sends and reads on CPU ",
        "; node on CPU ",
        "note: chain sends and reads on CPU ",
        "; nodes on CPU ",
        "note: node sends on CPU ",
    ]);
    assert!(!ended.stderr.contains("raw"), "{}", ended.stderr);
    assert!(ended.stdout.contains("lost  timed out  invalid turns"), "{}", ended.stdout);
}

#[test]
fn a_wrong_command_line_is_refused_with_the_way_out() {
    for (arguments, says) in [
        ("--values 0", "from 1 to 4096"),
        ("--values 5000", "from 1 to 4096"),
        ("--values -1", "from 1 to 4096"),
        ("--arms carrier_pigeon", "cache_line"),
        ("--arms raw,ports,raw", "lists raw twice"),
        ("--pace 0", "or back-to-back"),
        ("--pace -5", "or back-to-back"),
        ("--pace fast", "or back-to-back"),
        ("--pace 1", "give --turn 10"),
        ("--seconds 0", "greater than 0"),
        ("--turn nan", "greater than 0"),
        ("--cpu 0", "such as 0,1"),
        ("--cpu 0,0", "a CPU each"),
        ("--cpu 0,900", "CPU 900 is not one"),
        ("--priority 90", "1..=89"),
        ("--gate nowhere.toml", "nowhere.toml"),
    ] {
        let ended = Bench::start(arguments).finish().expect_code(2).says(&[says]);
        assert_eq!(ended.stdout, "", "{arguments}");
    }
}

#[test]
fn a_real_time_receiver_that_polls_is_refused_where_the_kernel_throttles() {
    if Environment::read().fifo_throttling().is_none() {
        return;
    }
    let arguments = "--arms tcp,raw --priority 10 --wait block --seconds 0.05 --turn 0.05";
    Bench::start(&format!("{arguments} --pace 1000")).finish().expect_code(1).says(&[
        "\"raw\"",
        "polls",
        "sched_rt_runtime_us",
    ]);
}

#[test]
fn a_signal_ends_the_bench_early_with_a_report_that_says_so() {
    for (arms, signal) in [
        ("raw,pipe,cache_line", Signal::INT),
        ("tcp,node", Signal::TERM),
        ("follow,chain", Signal::INT),
    ] {
        let arguments =
            format!("--arms {arms} --pace 1000 --values 1 --seconds 60 --turn 0.1 --json");
        let bench = Bench::start(&arguments);
        wait_until("the peer runs", || processes_in(bench.folder.path()) > 0);
        assert!(!bench.shared_memory().is_empty());
        // Some turns; were there none, the report would have no arms and still be valid.
        thread::sleep(Duration::from_millis(500));
        bench.process.signal(signal);
        let ended = bench.finish().expect_code(0);
        let report = ended.json();
        assert_eq!(report["ended_early"], true);
        for link in links(&report) {
            assert!(link["turns"].as_array().unwrap().len() < 600, "{link}");
        }
    }
}

#[test]
fn a_bench_that_is_killed_takes_its_peer_along() {
    for arms in ["--arms ports", "--arms pipe --wait block"] {
        let bench = Bench::start(&format!("{arms} --pace 1000 --values 1 --seconds 600"));
        wait_until("the peer runs", || processes_in(bench.folder.path()) > 0);
        thread::sleep(Duration::from_millis(300));
        let prefix = format!("isobench{}_", bench.process.id());
        bench.process.kill();
        wait_until("the peer has ended", || processes_in(bench.folder.path()) == 0);
        // What the killed process itself had stays: it could not clean up.
        shared_memory(&prefix).iter().for_each(|file| fs::remove_file(file).unwrap());
    }
}

#[test]
fn the_peer_says_who_starts_it_and_is_no_verb_for_people() {
    let domain = Domain::new();
    domain.expect("bench latency-peer", 2, &["isochrone bench latency"]);
    let help = domain.run("bench --help").expect_code(0).stdout;
    assert!(help.contains("latency") && !help.contains("latency-peer"), "{help}");
}
