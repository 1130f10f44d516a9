use isochrone_machine::Disturbance;
use isochrone_timing::{LinkReport, TaskReport};

use super::*;
use crate::bench::Turns;
use crate::bench::gate::Bound;
use crate::bench::made_up::rule;
use crate::report::{CostReport, LinkArm, Report, TaskArm};

/// Turns of a thousand equal samples; `None`: the turn is invalid, and full of samples that would
/// show.
fn turns(values: &[Option<u64>]) -> Turns {
    const STRANGE: u64 = 7;
    let mut turns = Turns::default();
    for (index, value) in values.iter().enumerate() {
        let mut samples = Distribution::new();
        samples.record_many(value.unwrap_or(STRANGE), 1_000);
        let disturbance =
            Disturbance { faults: Some(u64::from(value.is_none())), ..Disturbance::default() };
        turns.push(index as f64, 1_000_000_000, &samples, 0, disturbance);
    }
    turns
}

fn task(name: &str, period_ns: u64, load: &str, values: &[Option<u64>]) -> TaskArm {
    let turns = turns(values);
    TaskArm {
        task: TaskReport {
            name: name.into(),
            period_ns,
            histograms: [("release_jitter_ns".to_owned(), turns.all().encode())].into(),
            ..TaskReport::default()
        },
        load: load.into(),
        turns: turns.reports().to_vec(),
        ..TaskArm::default()
    }
}

fn link(service: &str, values: u64, paced_hz: Option<f64>) -> LinkArm {
    let turns = turns(&[Some(900); 6]);
    LinkArm {
        link: LinkReport {
            service: service.into(),
            histograms: [("one_way_ns".to_owned(), turns.all().encode())].into(),
            ..LinkReport::default()
        },
        values,
        paced_hz,
        turns: turns.reports().to_vec(),
        ..LinkArm::default()
    }
}

fn cost(name: &str, instances: u64) -> CostReport {
    let turns = turns(&[Some(900); 6]);
    CostReport {
        name: name.into(),
        instances,
        histograms: [("step_ps".to_owned(), turns.all().encode())].into(),
        turns: turns.reports().to_vec(),
        ..CostReport::default()
    }
}

/// Reference and candidate of the comparisons that a report of these makes, each pair once.
fn pairs(mut report: Report) -> Vec<(String, String)> {
    report.compare_arms();
    let mut pairs: Vec<(String, String)> = Vec::new();
    for Comparison { reference, candidate, .. } in report.comparisons {
        if !pairs.contains(&(reference.clone(), candidate.clone())) {
            pairs.push((reference, candidate));
        }
    }
    pairs
}

#[test]
fn a_label_is_the_arm_and_its_circumstances() {
    let report = Report {
        tasks: vec![
            task("hybrid", 1_000_000, "", &[Some(5)]),
            task("spin", 250_000, "cpu", &[Some(5)]),
        ],
        links: vec![
            link("plant/level", 0, None),
            link("iceoryx2", 64, Some(1_000.0)),
            link("pipe", 64, None),
        ],
        costs: vec![cost("mixed", 10)],
        ..Report::default()
    };
    let labels: Vec<String> = report.measured().iter().map(Measurement::label).collect();
    assert_eq!(
        labels,
        [
            "hybrid (1 ms)",
            "spin (250 us, cpu)",
            "plant/level",
            "iceoryx2 (1000 Hz, 64 values)",
            "pipe (back to back, 64 values)",
            "mixed (10 instances)",
        ]
    );
    let metrics: Vec<&str> = report.measured().iter().map(|measured| measured.metric.key).collect();
    let [jitter, latency, cost] = ["release_jitter_ns", "one_way_ns", "step_ps"];
    assert_eq!(metrics, [jitter, jitter, latency, latency, latency, cost]);
}

#[test]
fn what_has_no_distribution_was_not_measured() {
    let mut without = task("hybrid", 1_000_000, "", &[Some(5)]);
    without.task.histograms.clear();
    let mut broken = cost("mixed", 10);
    broken.histograms.insert("step_ps".into(), "no histogram".into());
    let report = Report { tasks: vec![without], costs: vec![broken], ..Report::default() };
    assert!(report.measured().is_empty());
}

#[test]
fn arms_are_compared_with_the_first_under_the_same_circumstances_and_no_other() {
    let of = |name: &str, period_ns, load: &str| task(name, period_ns, load, &[Some(900); 6]);
    let tasks = vec![
        of("sleep", 1_000_000, "idle"),
        of("sleep", 250_000, "idle"),
        of("sleep", 1_000_000, "cpu"),
        of("hybrid", 1_000_000, "cpu"),
        of("hybrid", 1_000_000, "idle"),
        of("spin", 1_000_000, "idle"),
    ];
    let expected = [
        ("sleep (1 ms, cpu)", "hybrid (1 ms, cpu)"),
        ("sleep (1 ms, idle)", "hybrid (1 ms, idle)"),
        ("sleep (1 ms, idle)", "spin (1 ms, idle)"),
    ];
    let found = pairs(Report { tasks, ..Report::default() });
    assert_eq!(found, expected.map(|(a, b)| (a.to_owned(), b.to_owned())));
}

#[test]
fn a_latency_is_not_compared_with_another_size_and_turn_types_not_with_each_other() {
    let links = vec![link("iceoryx2", 1, None), link("pipe", 64, None), link("tcp", 64, Some(1e3))];
    let costs = vec![cost("mixed", 1), cost("mixed", 10), cost("SawTooth", 10)];
    let found = pairs(Report { links, costs, ..Report::default() });
    assert_eq!(found, []);
}

#[test]
fn comparing_again_replaces_what_was_found() {
    let links = vec![link("raw", 64, None), link("ports", 64, None)];
    let mut report = Report { links, ..Report::default() };
    report.compare_arms();
    let once = report.comparisons.clone();
    report.compare_arms();
    assert!(!once.is_empty());
    assert_eq!(report.comparisons, once);
}

#[test]
fn an_invalid_turn_is_left_out_together_with_its_neighbour() {
    // Where one side was disturbed, the other side's turn is far off; neither may show.
    let sleep = [Some(1_000), None, Some(1_000), Some(1_000), Some(9), Some(1_000), Some(1_000)];
    let hybrid = [Some(500), Some(9), Some(500), Some(500), None, Some(500), Some(500)];
    let mut report = Report {
        tasks: vec![task("sleep", 1_000_000, "", &sleep), task("hybrid", 1_000_000, "", &hybrid)],
        ..Report::default()
    };
    report.compare_arms();
    let p50 = &report.comparisons[0];
    assert_eq!((p50.percentile.as_str(), p50.metric.as_str()), ("p50", "release_jitter_ns"));
    assert_eq!((p50.reference_value, p50.candidate_value), (1_000, 500));
    assert_eq!((p50.ratio, p50.low, p50.high), (2.0, 2.0, 2.0));
    assert_eq!(p50.verdict, Verdict::Better);
    let p99 = report.comparisons.iter().find(|found| found.percentile == "p99").unwrap();
    assert_eq!((p99.reference_value, p99.candidate_value), (1_000, 500));
}

#[test]
fn too_few_turns_without_disturbance_compare_nothing() {
    let (four, three) = ([Some(5), Some(5), Some(5), Some(5), None], [Some(9); 5]);
    let tasks = vec![task("a", 1_000_000, "", &four), task("b", 1_000_000, "", &three)];
    assert_eq!(pairs(Report { tasks, ..Report::default() }), []);
}

#[test]
fn what_a_disturbed_machine_leaves_out_asks_for_a_quieter_one_as_a_gate_does_and_not_for_longer() {
    let why = |hybrid: &[Option<u64>]| {
        let sleep = vec![Some(1_000); hybrid.len()];
        let tasks =
            vec![task("sleep", 1_000_000, "", &sleep), task("hybrid", 1_000_000, "", hybrid)];
        let mut report = Report { tasks, ..Report::default() };
        report.compare_arms();
        assert_eq!(report.comparisons, []);
        let rule = rule("p50", Bound::TimesLower { than: "sleep".into(), at_least: 1.0 });
        (report.left_out.remove(0).why, rule.judge(&report).remove(0).says)
    };
    let (table, gate) = why(&[None; 6]);
    assert_eq!(
        table,
        "100 % of the turns are invalid, and 20 % are allowed; run it on a quieter machine"
    );
    assert_eq!(gate, format!("hybrid (1 ms): {table}, or raise invalid_turns"));
    let (table, gate) = why(&[Some(500); 3]);
    assert_eq!(table, "3 of 5 valid turns; run it 2 times as long");
    assert!(gate.contains(&table), "{gate}");
}

#[test]
fn turns_that_took_no_turns_are_left_out_each_for_itself() {
    let side = |name, values: &[Option<u64>]| {
        let tasks = vec![task(name, 1_000_000, "", values)];
        Report { tasks, ..Report::default() }.measured().remove(0)
    };
    let first = side("a", &[None, Some(600), Some(600), Some(600), Some(600), Some(600)]);
    let second =
        side("a", &[Some(300), Some(300), Some(300), Some(300), Some(300), None, None, None]);
    assert_eq!((first.valid_turns().len(), second.valid_turns().len()), (5, 5));
    assert_eq!((first.invalid_part(), second.invalid_part()), (1.0 / 6.0, 3.0 / 8.0));
    let found = Comparison::all(&first, &second, Pairing::Apart);
    assert_eq!((found[0].reference_value, found[0].candidate_value), (600, 300));
    assert!(
        Comparison::all(&first, &second, Pairing::Paired).is_empty(),
        "only four turns are left"
    );
}

#[test]
fn the_report_of_a_run_has_no_turns_and_none_of_them_is_invalid() {
    let mut run = task("fast", 1_000_000, "", &[Some(5)]);
    run.turns.clear();
    let measured = Report { tasks: vec![run], ..Report::default() }.measured().remove(0);
    assert_eq!(measured.invalid_part(), 0.0);
    assert!(measured.valid_turns().is_empty());
    assert_eq!(measured.distribution.count(), 1_000);
}
