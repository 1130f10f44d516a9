//! What tasks get of the scheduling that they ask for.

use std::process::Command;
use std::thread;

use isochrone_machine::Machine;
use isochrone_testing::{Domain, Ended, Plant, not_tested};
use rustix::thread::{CpuSet, sched_setaffinity};
use serde_json::Value;

/// A node whose first task has these keys.
fn node(keys: &str) -> String {
    let fast = format!("[[task]]\nname = \"fast\"\nperiod = \"1ms\"\n{keys}\n");
    let slow = "[[task]]\nname = \"slow\"\nperiod = \"5ms\"\n";
    format!("[node]\nname = \"clock\"\n{fast}{slow}")
}

#[test]
fn a_task_with_a_priority_runs_on_a_chosen_cpu_and_everybody_says_why() {
    let domain = Domain::new();
    let node = domain.start_node("rt.toml", &node("priority = 50"), "--report rt.json");
    // A node that does not answer in time is listed without its tasks.
    let placement = |_| {
        let list = domain.answer("list --json");
        Some(list["control_nodes"][0]["tasks"][0]["placement"].clone()).filter(|p| p.is_object())
    };
    let task = (0..20).find_map(placement).unwrap();
    if task["scheduler"] == "other" {
        node.stop().expect_code(0);
        return not_tested(
            "a CPU that is chosen for a priority",
            "the kernel refuses the priority",
        );
    }
    let (cpu, reason) = (task["cpu"].as_u64().unwrap(), task["cpu_reason"].as_str().unwrap());
    let chosen = format!("CPU of fast: {reason}");
    assert!((0..20).any(|_| domain.run("list").expect_code(0).stdout.contains(&chosen)));
    let ended = node.stop().expect_code(0);
    for (text, part) in [
        (&ended.stderr, format!("task \"fast\": CPU {cpu}: {reason}")),
        (&ended.stdout, format!("CPU chosen: {reason}")),
    ] {
        assert!(text.contains(&part), "{part}: {text}");
    }
    let report = domain.json("rt.json");
    let fast = &report["tasks"][0];
    assert_eq!((fast["cpu"].as_u64(), fast["cpu_reason"].as_str()), (Some(cpu), Some(reason)));
    assert!(report["tasks"][1].get("cpu_reason").is_none(), "it may move: {report}");
}

/// A task that follows another one of the same priority.
fn follows() -> Plant {
    Plant::new("n")
        .task("source", "10ms")
        .with("priority = 5")
        .task("follower", "10ms")
        .with("priority = 5\nfollow = { service = \"plant/saw\", within = \"1ms\" }")
        .on("source")
        .saw("saw", "incrementRange = 1")
        .output("plant/saw", &["saw.value"])
        .on("follower")
        .input("in", "plant/saw", "type = \"INT\"\nsignal = \"saw.value\"\nmax_age = \"1s\"")
        .output("plant/after", &["in"])
}

/// Runs the program on these CPUs.
fn run_on(domain: &Domain, cpus: &[usize], arguments: &[&str]) -> Ended {
    let mut set = CpuSet::new();
    cpus.iter().for_each(|cpu| set.set(*cpu));
    // What a thread starts has the thread's CPUs.
    thread::scope(|scope| {
        let run = || {
            sched_setaffinity(None, &set).unwrap();
            domain.start_with(arguments).finish()
        };
        scope.spawn(run).join().unwrap()
    })
}

#[test]
fn check_warns_of_a_source_that_its_follower_would_starve_on_the_cpu_that_is_chosen_for_both() {
    let domain = Domain::with(&[("n.toml", &follows())]);
    let cpu = *Machine::here().bindable().unwrap().first().unwrap();
    let said = "which has priority 5 and would run on the same CPU";
    run_on(&domain, &[cpu], &["check", "n.toml"]).expect_code(0).says(&[said]);
    run_on(&domain, &[cpu], &["check", "n.toml", "--strict"]).expect_code(2);
    let json = run_on(&domain, &[cpu], &["check", "n.toml", "--json"]).expect_code(0).json();
    assert_eq!(json["warnings"][0]["code"], "starved_source", "{json}");
}

#[test]
fn a_task_and_its_source_get_different_cpus_where_there_are_two() {
    let domain = Domain::with(&[("n.toml", &follows())]);
    let allowed: Vec<usize> = Machine::here().bindable().unwrap().into_iter().take(2).collect();
    if allowed.len() < 2 {
        return not_tested("two CPUs", "this machine has one");
    }
    let json = run_on(&domain, &allowed, &["check", "n.toml", "--json"]).expect_code(0).json();
    assert_ne!(json["tasks"][0]["cpu"], json["tasks"][1]["cpu"], "{json}");
    assert_eq!(json["warnings"], serde_json::json!([]), "{json}");
}

/// Runs a node without the right to a priority, and returns its first task and what it said.
fn run_without_right(domain: &Domain, file: &str) -> (Value, String) {
    let mut words = vec!["prlimit", "--rtprio=0"];
    if rustix::process::getuid().is_root() {
        words.extend(["setpriv", "--bounding-set", "-sys_nice", "--inh-caps", "-sys_nice"]);
    }
    let run = format!("run {file} --cycles 20 --report rt.json");
    let ended = domain.start_by(&words, &run).finish().expect_code(0);
    (domain.json("rt.json")["tasks"][0].clone(), ended.stderr)
}

#[test]
fn a_task_whose_priority_is_refused_leaves_a_cpu_that_was_chosen_and_stays_on_one_that_is_named() {
    for program in ["prlimit", "setpriv"] {
        if Command::new(program).arg("--version").output().is_err() {
            return not_tested("a refused priority", &format!("{program} is not installed"));
        }
    }
    let domain = Domain::new();
    let allowed = Machine::here().bindable().unwrap();
    domain.write("chosen.toml", node("priority = 50"));
    let (task, said) = run_without_right(&domain, "chosen.toml");
    assert_eq!(task["scheduler"], "other", "{said}");
    if allowed.len() > 1 {
        assert_eq!(task["cpu"], Value::Null, "{task}");
        assert!(task.get("cpu_reason").is_none(), "{task}");
        assert!(said.contains("task \"fast\": not pinned to CPU"), "{said}");
    }
    let cpu = *allowed.first().unwrap();
    domain.write("named.toml", node(&format!("priority = 50\ncpu = {cpu}")));
    let (task, said) = run_without_right(&domain, "named.toml");
    assert_eq!((&task["scheduler"], &task["cpu"]), (&"other".into(), &cpu.into()), "{said}");
    assert!(!said.contains("not pinned"), "{said}");
}

#[test]
fn strict_refuses_to_start_without_the_scheduling_that_was_asked_for() {
    let domain = Domain::with(&[("rt.toml", &node("priority = 50\ncpu = 1000"))]);
    // No machine that runs this has a CPU 1000, whoever runs it.
    domain.expect("run rt.toml --strict", 1, &["1000", "remedy"]);
    domain.expect("run rt.toml --cycles 20 --report rt.json", 0, &["warning"]);
    let warnings = &domain.json("rt.json")["warnings"];
    assert!(warnings.as_array().unwrap().iter().any(|w| w["code"] == "cpu_denied"), "{warnings}");
    domain.expect_no_leftovers();
}
