//! `bench jitter`, `compare` and gates, run as a user would. Without a priority, so that no right is
//! needed; how late the releases are is the machine's affair.

use std::cell::Cell;
use std::collections::HashSet;
use std::time::{Duration, Instant};

use isochrone_machine::Disturbance;
use isochrone_report::{LoopArm, Report};
use isochrone_testing::Domain;
use isochrone_testing::plants::SAW;
use isochrone_timing::CycleRecord;
use rustix::process::Signal;
use serde_json::Value;

/// Six turns of each arm: enough for a comparison.
const SIX_TURNS: &str = "--priority 0 --seconds 1.2 --turn 0.2";

fn bench(domain: &Domain, arguments: &str) -> Value {
    domain.run(&format!("bench jitter {arguments} --report out.json")).expect_code(0);
    domain.json("out.json")
}

fn tasks(report: &Value) -> &[Value] {
    report["tasks"].as_array().unwrap()
}

fn number(value: &Value) -> u64 {
    value.as_u64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Whether there are five rounds without an invalid turn. A machine that is busy with other tests
/// may take the CPU away in more of them.
fn can_be_compared(report: &Value) -> bool {
    let is_valid = |task: &Value, turn: usize| task["turns"][turn].get("invalid").is_none();
    let rounds = tasks(report)[0]["turns"].as_array().unwrap().len();
    let valid = |turn: &usize| tasks(report).iter().all(|task| is_valid(task, *turn));
    (0..rounds).filter(valid).count() >= 5
}

#[test]
fn how_the_arms_are_scheduled_is_said_and_a_phase_is_a_part_of_every_period() {
    let domain = Domain::new();
    let ended = domain
        .run("bench jitter --arms hybrid --phase 300us --priority 0 --seconds 0.2 --turn 0.2");
    ended.expect_code(0).says(&["note: normal scheduling, no priority, CPU ", ", phase 300us\n"]);
    let refused =
        domain.run("bench jitter --arms hybrid --phase 2ms --period 5ms,200us").expect_code(2);
    let why = "--phase 2ms is not less than the period of 200us";
    assert!(refused.stderr.contains(why), "{}", refused.stderr);
}

#[test]
fn arms_run_in_turns_without_their_warm_up_and_are_compared_with_the_first() {
    let domain = Domain::new();
    let report = bench(&domain, &format!("--arms sleep,hybrid {SIX_TURNS}"));
    let names: Vec<&Value> = tasks(&report).iter().map(|task| &task["name"]).collect();
    assert_eq!(names, ["sleep", "hybrid"]);
    for task in tasks(&report) {
        let turns = task["turns"].as_array().unwrap();
        assert_eq!(turns.len(), 6);
        let due: u64 = turns.iter().map(|turn| number(&turn["samples"])).sum();
        assert_eq!(due, 1_200, "1.2 s of 1 ms");
        let ran = number(&task["release_jitter_ns"]["count"]);
        assert_eq!(number(&task["cycles"]) - number(&task["warm_up_cycles"]), ran);
        assert_eq!(ran + number(&task["missed"]), due);
        assert_eq!(number(&task["release_jitter_corrected_ns"]["count"]), due);
        assert!(number(&task["warm_up_cycles"]) > 0);
    }
    let began =
        |arm: usize, turn: usize| tasks(&report)[arm]["turns"][turn]["at_s"].as_f64().unwrap();
    assert!(began(0, 0) < began(1, 0) && began(1, 1) < began(0, 1), "forth and back");
    if can_be_compared(&report) {
        let comparisons = report["comparisons"].as_array().unwrap();
        assert!(comparisons.iter().any(|c| {
            c["percentile"] == "p50"
                && c["reference"] == "sleep (1 ms)"
                && c["candidate"] == "hybrid (1 ms)"
                && c["low"].as_f64() <= c["ratio"].as_f64()
        }));
    }
}

/// The thread of the loop that has its turn.
fn loop_thread(bench: &isochrone_testing::Process) -> Option<String> {
    let threads = std::fs::read_dir(format!("/proc/{}/task", bench.id())).unwrap();
    let names = threads.flatten().map(|thread| {
        let name = std::fs::read_to_string(thread.path().join("comm")).unwrap_or_default();
        (thread.file_name().into_string().unwrap(), name)
    });
    let mut of_loop = names.filter(|(_, name)| name.trim() == "bench");
    of_loop.next().map(|(thread, _)| thread)
}

#[test]
fn a_stall_is_counted_as_missed_releases_and_corrected_for_also_across_the_end_of_a_turn() {
    let domain = Domain::new();
    // The turn counts from 0.2 s after its begin to 2.2 s.
    for (begin_ms, end_ms) in [(700, 1_100), (1_500, 2_700)] {
        // On a busy machine the stall may begin or end late, and be none of the turn's.
        let task = (0..10)
            .map(|_| stalled(&domain, begin_ms, end_ms))
            .find(|task| number(&task["missed"]) >= 99)
            .unwrap();
        let count = number(&task["release_jitter_ns"]["count"]);
        let missed = number(&task["missed"]);
        assert_eq!(count + missed, 2_000, "every release that was due in the turn, once");
        assert_eq!(number(&task["release_jitter_corrected_ns"]["count"]), 2_000);
        assert!(number(&task["release_jitter_corrected_ns"]["max"]) >= 99_000_000);
        assert!(number(&task["outliers"][0]["late_ns"]) >= 99_000_000);
    }
}

/// A turn of two seconds in which the bench is stopped for a while; the report of its arm.
fn stalled(domain: &Domain, begin_ms: u64, end_ms: u64) -> Value {
    let run = "bench jitter --arms sleep --priority 0 --seconds 2 --turn 2 --report out.json";
    let mut process = domain.start(run);
    let began = Cell::new(Instant::now());
    // What keeps the turn from its begin is not counted.
    process.wait_until_it("begins its turn", |process| {
        began.set(Instant::now());
        loop_thread(process).is_some()
    });
    let sleep_until = |ms| {
        std::thread::sleep(Duration::from_millis(ms).saturating_sub(began.get().elapsed()));
    };
    sleep_until(begin_ms);
    process.signal(Signal::STOP);
    sleep_until(end_ms);
    process.signal(Signal::CONT);
    process.finish().expect_code(0);
    tasks(&domain.json("out.json"))[0].clone()
}

#[test]
fn periods_and_configurations_are_further_circumstances_and_arms() {
    let domain = Domain::new();
    let report = bench(&domain, "--arms sleep,hybrid --priority 0 --seconds 0.2 --period 1ms,2ms");
    let periods: Vec<u64> = tasks(&report).iter().map(|t| number(&t["period_ns"])).collect();
    assert_eq!(periods, [1_000_000, 1_000_000, 2_000_000, 2_000_000]);

    domain.write("saw.toml", SAW);
    let report = bench(&domain, "--arms sleep --config saw.toml --seconds 0.4 --block 0.2");
    let [sleep, saw] = tasks(&report) else { panic!("{report}") };
    assert_eq!((&sleep["name"], &saw["name"]), (&"sleep".into(), &"saw".into()));
    assert_eq!(number(&sleep["period_ns"]), 2_000_000, "the configuration's");
    assert_eq!(sleep["scheduler"], "other", "the configuration has no priority");
    assert!(number(&saw["release_jitter_ns"]["count"]) > 0);
    assert!(number(&saw["execution_ns"]["p50"]) > 0);
    domain.expect_no_leftovers();
}

#[test]
fn all_arms_run_on_the_chosen_cpu_and_the_report_says_why() {
    let domain = Domain::new();
    let report = bench(&domain, "--arms sleep,hybrid --priority 0 --seconds 0.2 --turn 0.2");
    let [sleep, hybrid] = tasks(&report) else { panic!("{report}") };
    assert!(sleep["cpu"].is_u64() && sleep["cpu_reason"].is_string(), "{sleep}");
    assert_eq!((&sleep["cpu"], &sleep["cpu_reason"]), (&hybrid["cpu"], &hybrid["cpu_reason"]));

    let table = domain.run("bench jitter --arms sleep --priority 0 --seconds 0.2 --turn 0.2");
    let said = table.expect_code(0).stdout;
    assert_eq!(said.matches(" chosen: ").count(), 1, "{said}");
}

#[test]
fn loops_are_compared_on_several_cpus_in_turns() {
    let domain = Domain::new();
    let allowed = isochrone_machine::Machine::here().bindable().unwrap();
    let Some((first, last)) = allowed.first().zip(allowed.last()).filter(|(a, b)| a != b) else {
        return; // This machine has one CPU.
    };
    let report = bench(
        &domain,
        &format!("--arms sleep,hybrid --cpu {first},{last} --priority 0 --seconds 0.4 --turn 0.2"),
    );
    let arm = |task: &Value| (task["name"].as_str().unwrap().to_owned(), number(&task["cpu"]));
    let arms: Vec<_> = tasks(&report).iter().map(arm).collect();
    let expected = ["sleep", "hybrid"]
        .iter()
        .flat_map(|name| [first, last].map(|cpu| (format!("{name}@{cpu}"), *cpu as u64)));
    assert_eq!(arms, expected.collect::<Vec<_>>());
    let chosen: Vec<_> =
        tasks(&report).iter().filter(|task| task["cpu_reason"].is_string()).map(arm).collect();
    let [(sleep, cpu), (hybrid, same)] = &chosen[..] else { panic!("{chosen:?}") };
    assert_eq!((sleep, hybrid), (&format!("sleep@{cpu}"), &format!("hybrid@{cpu}")));
    assert_eq!(cpu, same, "one of them is the better one");
    let refused = domain.run(&format!("bench jitter --arms sleep --cpu {first},{first}"));
    assert!(refused.expect_code(2).stderr.contains("two arms"));
}

#[test]
fn ctrl_c_ends_a_bench_early_with_a_report_that_says_so() {
    let domain = Domain::new();
    let arguments = "bench jitter --arms hybrid --priority 0 --seconds 600 --turn 0.2";
    let mut process = domain.start(&format!("{arguments} --report out.json --html page.html"));
    // Each turn has a thread of its own. On a busy machine a turn may have counted nothing.
    let mut turns = HashSet::new();
    process.wait_until_it("ends some turns", |process| {
        turns.extend(loop_thread(process));
        turns.len() > 5
    });
    process.signal(Signal::INT);
    process.wait_for("hybrid");
    process.finish().expect_code(0);
    let report = domain.json("out.json");
    assert_eq!(report["ended_early"], true);
    assert!(number(&tasks(&report)[0]["release_jitter_ns"]["count"]) > 0);
    assert!(domain.read("page.html").contains("early"), "the page says so too");
}

/// A report of ten turns, whose releases are `factor` times as late as usual: 10 to 20 us.
fn slowed(factor: u64) -> Report {
    of_turns(10, factor)
}

fn of_turns(turns: u64, factor: u64) -> Report {
    let mut arm = LoopArm::new(1_000_000, 0);
    for turn in 0..turns {
        let record = |cycle: u64| {
            let release_ns = (turn * 1_000 + cycle) * 1_000_000;
            // Each turn at a level of its own, as machines have bouts.
            let late_ns = factor * (10_000 + turn * 300 + cycle * 7);
            let start_ns = release_ns + late_ns;
            CycleRecord { cycle, release_ns, start_ns, end_ns: start_ns, missed: 0, overruns: 0 }
        };
        let records: Vec<CycleRecord> = (0..1_000).map(record).collect();
        let none = Disturbance::default();
        arm.turn(&records, &[], 0..u64::MAX, none, |_| none);
    }
    Report { tasks: vec![arm.report("loop")], ..Report::default() }
}

#[test]
fn a_slower_arm_is_found_worse_the_faster_one_better_and_the_same_the_same() {
    let domain = Domain::new();
    for (factor, file) in [(1, "usual.json"), (2, "slowed.json")] {
        domain.write(file, serde_json::to_string(&slowed(factor)).unwrap());
    }
    let _worse = domain.run("compare usual.json slowed.json").expect_code(1).prints(&["worse"]);
    let _better = domain.run("compare slowed.json usual.json").expect_code(0).prints(&["better"]);
    let same = domain.run("compare usual.json usual.json").expect_code(0);
    assert!(!same.stdout.contains("better") && !same.stdout.contains("worse"), "{}", same.stdout);
    let json = domain.run("compare usual.json slowed.json --json").expect_code(1).json();
    assert!(json.as_array().unwrap().iter().any(|c| c["verdict"] == "worse"), "{json}");
}

#[test]
fn reports_that_cannot_be_compared_are_refused() {
    let domain = Domain::new();
    let (usual, few, empty) = (slowed(1), of_turns(1, 1), Report::default());
    for (name, report) in [("usual.json", usual), ("few.json", few), ("empty.json", empty)] {
        domain.write(name, serde_json::to_string(&report).unwrap());
    }
    domain.expect("compare few.json few.json", 4, &["of 5 valid turns"]);
    domain.expect("compare usual.json empty.json", 4, &["not in the second"]);
    domain.expect("compare empty.json usual.json", 2, &["nothing to compare"]);
    domain.write("text.json", "no report");
    for file in ["text.json", "absent.json"] {
        domain.expect(&format!("compare usual.json {file}"), 2, &[file]);
    }
}

#[test]
fn what_is_no_report_and_no_gate_is_refused_at_once_with_what_it_is() {
    let domain = Domain::new();
    domain.write("text.json", "no report");
    domain.write("other.json", "[1, 2]");
    domain.write("empty", "\n");
    for (arguments, says) in [
        ("compare text.json text.json", "text.json is not JSON"),
        ("compare other.json other.json", "other.json is not a report of isochrone"),
        ("compare empty empty", "empty is empty; a report is what"),
        ("compare /dev/zero text.json", "/dev/zero is not a file"),
        ("bench jitter --gate /dev/zero", "write the gate to a file"),
        ("bench jitter --gate empty", "needs at least one [[rule]]"),
    ] {
        domain.expect(arguments, 2, &[says]);
    }
}

#[test]
fn a_gate_passes_fails_or_says_that_the_run_is_invalid() {
    let domain = Domain::new();
    let rule = |at_least: f64| {
        format!(
            "[[rule]]\narm = \"hybrid\"\npercentile = \"p50\"\ntimes_lower_than = \"sleep\"\n\
             at_least = {at_least:?}\n"
        )
    };
    // A machine that is busy with other tests may steal from every turn.
    let any = "invalid_turns = 1.0\n";
    for (gate, seconds, code, says) in [
        (any.to_owned() + &rule(1e-6), 1.2, 0, "gate: pass"),
        (any.to_owned() + &rule(1e9), 1.2, 1, "gate: fail"),
        (any.to_owned() + &rule(1.0), 0.2, 4, "times as long"),
        (rule(1.0).replace("sleep", "absent"), 0.2, 2, "absent"),
        (rule(1.0).replace("p50", "p51"), 0.2, 2, "p51"),
        (rule(1.0).replace("at_least", "at_last"), 0.2, 2, "at_last"),
        (rule(1.0).replace("1.0", "nan"), 0.2, 2, "greater than 0"),
        ("rule = []".to_owned(), 0.2, 2, "no rule"),
    ] {
        domain.write("gate.toml", &gate);
        let arms = "bench jitter --arms sleep,hybrid --priority 0 --turn 0.2";
        let outputs = "--gate gate.toml --report out.json";
        let ended = domain.run(&format!("{arms} --seconds {seconds} {outputs}"));
        let void = code < 2 && !can_be_compared(&domain.json("out.json"));
        let (code, says) = if void { (4, "gate: invalid") } else { (code, says) };
        ended.expect_code(code).says(&[says]);
    }
}

#[test]
fn every_file_that_is_asked_for_is_written() {
    let domain = Domain::new();
    bench(
        &domain,
        "--arms sleep,hybrid --priority 0 --seconds 0.4 --turn 0.2 --html page.html \
         --hgrm tables --hlog turns.hlog --histogram histogram.txt --svg pictures",
    );
    assert!(domain.read("page.html").contains("<svg"));
    assert!(domain.read("tables/hybrid-1-ms.hgrm").contains("Percentile"));
    assert_eq!(domain.read("turns.hlog").matches("Tag=").count(), 4);
    assert!(domain.read("histogram.txt").starts_with("# Histogram"));
    let pictures = std::fs::read_dir(domain.path("pictures")).unwrap().count();
    assert!(pictures >= 3, "{pictures}");
}

#[test]
fn bad_input_is_refused_before_anything_runs() {
    let domain = Domain::with(&[("saw.toml", SAW), ("slow.toml", &SAW.replace("2ms", "3ms"))]);
    for (arguments, says) in [
        ("--arms nap", "possible values"),
        ("--arms sleep,sleep", "two arms"),
        ("--period 1us", "10us to 1s"),
        ("--cpu 4095", "no CPU 4095"),
        ("--priority 95", "0..=89"),
        ("--seconds 0", "greater than 0"),
        ("--seconds 1e300", "a week"),
        ("--turn 61", "10ms to 60s"),
        ("--turn 5ms", "10ms to 60s"),
        ("--period 2h", "10us to 1s"),
        ("--load tea", "possible values"),
        ("--arms cyclictest --priority 0", "with a priority"),
        // Each is taken: what is refused is something else.
        ("--cpu 4095 --period 1 --phase 0.1 --seconds 1s --turn 20ms", "no CPU 4095"),
        ("--config saw.toml --period 1ms", "cannot be given with --config"),
        ("--config saw.toml --config slow.toml", "periods of 2ms and 3ms"),
        ("--config absent.toml", "absent.toml"),
        ("--gate absent.toml", "absent.toml"),
        ("--report nowhere/out.json", "nowhere/out.json"),
    ] {
        domain.expect(&format!("bench jitter {arguments}"), 2, &[says]);
    }
}

#[test]
fn a_file_keeps_what_it_holds_until_the_bench_is_over() {
    let domain = Domain::with(&[("out.json", "the last result")]);
    domain.run("bench jitter --cpu 4095 --report out.json").expect_code(2);
    assert_eq!(domain.read("out.json"), "the last result");
}

#[test]
fn cyclictest_is_not_run_at_a_period_that_it_cannot_have() {
    let domain = Domain::new();
    for (arguments, says) in
        [("--period 1ms,12345ns", "period of 12345ns"), ("--phase 1500ns", "phase of 1500ns")]
    {
        let arguments = format!("bench jitter --arms sleep,cyclictest {arguments}");
        domain.expect(&arguments, 2, &["the arm cyclictest", says]);
    }
}
