//! `bench engine`: what it measures, what it refuses, and how it ends. No figure is judged: a machine
//! that is busy with other tests has none to give.

use std::thread;
use std::time::Duration;

use isochrone_blocks::CATALOGUE;
use isochrone_report::{Comparison, Pairing, Report};
use isochrone_testing::{Domain, Ended, Process, assert_says};
use rustix::process::Signal;

const SHORT: &str = "bench engine --seconds 0.02";

fn report(folder: &Domain, args: &str) -> Report {
    let Ended { stdout: out, .. } = folder.run(&format!("{SHORT} --json {args}")).expect_code(0);
    serde_json::from_str(&out).unwrap()
}

#[test]
fn every_arm_has_samples_at_every_size() {
    let report = report(&Domain::new(), "--instances 1,30");
    let measured: Vec<(&str, u64)> =
        report.costs.iter().map(|cost| (cost.name.as_str(), cost.instances)).collect();
    let names = std::iter::once("mixed").chain(CATALOGUE.iter().map(|known| known.name));
    let expected: Vec<(&str, u64)> = names.flat_map(|name| [(name, 1), (name, 30)]).collect();
    assert_eq!(measured, expected);
    for cost in &report.costs {
        assert!(cost.step_ps.min.unwrap() > 0, "{cost:?}");
        assert_eq!(cost.turns.len(), 10, "{}", cost.name);
        let of_turns: u64 = cost.turns.iter().map(|turn| turn.samples).sum();
        assert_eq!(cost.step_ps.count, of_turns, "{}", cost.name);
        assert!(cost.turns.iter().all(|turn| turn.samples > 0), "{}", cost.name);
    }
    assert!(!report.ended_early);
}

#[test]
fn the_warm_up_is_counted_and_in_no_distribution() {
    let report = report(&Domain::new(), "--arms mixed --instances 1000");
    let cost = &report.costs[0];
    assert!(cost.warm_up_cycles > 0 && cost.warm_up_cycles < cost.cycles, "{cost:?}");
    // A sample is a batch of the same number of cycles.
    assert_eq!((cost.cycles - cost.warm_up_cycles) % cost.step_ps.count, 0, "{cost:?}");
}

#[test]
fn one_instance_can_be_measured_alone() {
    let report = report(&Domain::new(), "--arms mixed --instances 1");
    assert_eq!((report.costs.len(), report.costs[0].instances), (1, 1));
    assert!(report.comparisons.is_empty(), "there is nothing to compare it with");
}

#[test]
fn the_report_keeps_the_distribution_for_a_later_comparison() {
    let folder = Domain::new();
    folder.run(&format!("{SHORT} --arms mixed --instances 10 --report a.json")).expect_code(0);
    let report: Report = serde_json::from_str(&folder.read("a.json")).unwrap();
    let measured = report.measured();
    assert_eq!(measured[0].label(), "mixed (10 instances)");
    assert_eq!(measured[0].distribution.count(), report.costs[0].step_ps.count);
}

#[test]
fn an_arm_that_there_is_not_is_refused_with_those_that_there_are() {
    let err = Domain::new().run(&format!("{SHORT} --arms mixed,Sawtooth")).refused(2);
    let names: Vec<&str> = CATALOGUE.iter().map(|known| known.name).collect();
    assert_says(&err, &["Sawtooth".to_owned(), format!("there are: mixed, {}", names.join(", "))]);
}

#[test]
fn a_number_of_instances_that_no_task_has_is_refused() {
    for wrong in ["0", "1000001", "many", "1,,2", "-3"] {
        let err = Domain::new().run(&format!("{SHORT} --instances={wrong}")).refused(2);
        assert_says(&err, &["--instances", "from 1 to 1000000"]);
    }
}

#[test]
fn no_seconds_and_no_such_priority_are_refused() {
    let err = Domain::new().run("bench engine --seconds 0").refused(2);
    assert_says(&err, &["greater than 0"]);
    let err = Domain::new().run(&format!("{SHORT} --priority 99")).refused(2);
    assert_says(&err, &["--priority", "99"]);
}

#[test]
fn a_cpu_that_there_is_not_is_a_warning_in_the_report() {
    let report = report(&Domain::new(), "--arms mixed --instances 1 --cpu 4096");
    assert!(report.costs[0].step_ps.count > 0);
    let says = |part| report.warnings.iter().any(|warning| warning.message.contains(part));
    assert!(says("4096"), "{:?}", report.warnings);
}

#[test]
fn a_signal_ends_it_early_with_a_report_that_says_so() {
    let folder = Domain::new();
    let args = ["bench", "engine", "--seconds", "600", "--instances", "10", "--json"];
    // On a busy machine it may take long until there is something to report.
    for wait_ms in [0, 100, 400, 1_600, 6_400, 25_600] {
        let mut bench = Process::start(folder.command(&args));
        bench.wait_for("Press Ctrl-C to end it");
        thread::sleep(Duration::from_millis(wait_ms));
        bench.signal(Signal::INT);
        let ended = bench.finish().expect_code(0);
        let report: Report = serde_json::from_str(&ended.stdout).unwrap();
        assert!(report.ended_early);
        assert!(report.costs.iter().all(|cost| cost.step_ps.count > 0), "{:?}", report.costs);
        if !report.costs.is_empty() {
            return;
        }
    }
    panic!("nothing is measured in 25 s");
}

#[test]
fn a_bench_that_was_ended_early_is_no_result_for_a_gate() {
    let folder = Domain::with(&[("gate.toml", &gate(1.0))]);
    let args = ["bench", "engine", "--seconds", "600", "--gate", "gate.toml"];
    let mut bench = Process::start(folder.command(&args));
    bench.wait_for("Press Ctrl-C to end it");
    bench.signal(Signal::TERM);
    let ended = bench.finish().expect_code(4);
    assert_says(&ended.stderr, &["ended early"]);
}

fn gate(at_least: f64) -> String {
    format!(
        "invalid_turns = 1.0\n[[rule]]\narm = \"SawTooth\"\npercentile = \"p50\"\n\
         times_lower_than = \"mixed\"\nat_least = {at_least:?}\n"
    )
}

#[test]
fn a_gate_that_nothing_can_pass_fails_and_one_that_everything_does_passes() {
    for (at_least, code, says) in [(1e6, 1, "gate: fail"), (1e-6, 0, "gate: pass")] {
        let folder = Domain::with(&[("gate.toml", &gate(at_least))]);
        let command = "bench engine --seconds 0.2 --arms mixed,SawTooth --instances 10";
        let ran = folder.run(&format!("{command} --gate gate.toml --report a.json"));
        let report: Report = serde_json::from_str(&folder.read("a.json")).unwrap();
        // A machine that takes the CPU away all the time makes the run invalid, and that is right.
        let [mixed, saw] = &report.measured()[..] else { panic!("{report}") };
        let found = Comparison::all(mixed, saw, Pairing::Paired);
        let undisturbed = found.iter().any(|found| found.percentile == "p50");
        let (code, says) = if undisturbed { (code, says) } else { (4, "gate: invalid") };
        assert_eq!(ran.code(), code, "{}", ran.stderr);
        assert_says(&ran.stderr, &[says, "SawTooth (10 instances)"]);
    }
}

#[test]
fn a_gate_that_makes_no_sense_is_refused_before_anything_is_measured() {
    let rule = "[[rule]]\narm = \"mixed\"\npercentile = \"p51\"\nat_most_ns = 5\n";
    let folder = Domain::with(&[("gate.toml", rule)]);
    let err = folder.run("bench engine --seconds 600 --gate gate.toml").refused(2);
    assert_says(&err, &["gate.toml", "p51", "p50, p90"]);
}
