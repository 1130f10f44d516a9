use isochrone_machine::{Disturbance, Environment};
use isochrone_timing::{Distribution, TaskReport};

use super::*;
use crate::bench::Turns;
use crate::bench::made_up::{TURNS, bound_rule, gate, ratio_rule, report, task, task_of, turns};
use crate::report::{CostReport, TaskArm};

fn in_vm(report: Report) -> Report {
    let environment = Environment { hypervisor: Some("kvm".into()), ..Environment::default() };
    Report { environment, ..report }
}

/// The outcome of a gate's only judgement.
#[track_caller]
fn judge(gate: &Gate, report: &Report) -> Judgement {
    let judged = gate.judge(report);
    assert_eq!(judged.len(), 1, "{judged:?}");
    judged.into_iter().next().unwrap()
}

#[track_caller]
fn assert_judged(gate: &Gate, report: &Report, outcome: RuleOutcome, parts: &[&str]) {
    let Judgement { outcome: judged, says } = judge(gate, report);
    assert_eq!(judged, outcome, "{says}");
    parts.iter().for_each(|part| assert!(says.contains(part), "{part:?} is not in: {says}"));
}

#[test]
fn a_ratio_that_is_kept_passes_and_says_how_well() {
    let report = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    let says = [
        "hybrid (1 ms): p99 is 4.00 times lower than sleep (99 % interval 4.00 to 4.00); ",
        "it must be at least 3.5 times lower",
    ];
    assert_judged(&ratio_rule("p99", 3.5), &report, RuleOutcome::Pass, &says);
}

#[test]
fn a_ratio_that_is_not_kept_fails() {
    let report = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    assert_judged(&ratio_rule("p99", 4.5), &report, RuleOutcome::Fail, &["4.00", "at least 4.5"]);
}

#[test]
fn a_ratio_passes_or_fails_only_with_its_whole_interval() {
    let mut wavering = Turns::default();
    for turn in 0..TURNS {
        let mut of_turn = Distribution::new();
        of_turn.record_many(if turn % 2 == 0 { 400 } else { 1_600 }, 2_000);
        wavering.push(turn as f64, 1_000_000_000, &of_turn, 0, Disturbance::default());
    }
    let report = report(vec![task("sleep", 1_600), task_of("hybrid", &wavering)]);
    let comparison =
        &Comparison::all(&report.measured()[0], &report.measured()[1], Pairing::Paired)[0];
    assert!(comparison.low < comparison.high, "{comparison:?}");
    let between = 0.5 * (comparison.low + comparison.high);
    assert_judged(&ratio_rule("p50", between), &report, RuleOutcome::Invalid, &["as long"]);
    assert_judged(&ratio_rule("p50", comparison.low - 0.1), &report, RuleOutcome::Pass, &[]);
    assert_judged(&ratio_rule("p50", comparison.high + 0.1), &report, RuleOutcome::Fail, &[]);
}

#[test]
fn an_arm_that_is_higher_is_said_to_be_so_and_so_is_a_bound_that_allows_it() {
    let report = report(vec![task("sleep", 500), task("hybrid", 2_000)]);
    let higher = "p50 is 4.00 times higher than sleep (99 % interval 4.00 to 4.00); ";
    for (at_least, outcome, bound) in [
        (2.0, RuleOutcome::Fail, "it must be at least 2 times lower"),
        (1.0, RuleOutcome::Fail, "it must not be higher"),
        (0.5, RuleOutcome::Fail, "it may be at most 2.00 times higher (at_least = 0.5)"),
        (0.2, RuleOutcome::Pass, "it may be at most 5.00 times higher (at_least = 0.2)"),
    ] {
        assert_judged(&ratio_rule("p50", at_least), &report, outcome, &[higher, bound]);
    }
}

#[test]
fn a_ratio_is_judged_in_a_virtual_machine_too() {
    let report = in_vm(report(vec![task("sleep", 2_000), task("hybrid", 1_900)]));
    assert_judged(&ratio_rule("p50", 2.0), &report, RuleOutcome::Fail, &[]);
}

#[test]
fn a_ratio_to_an_arm_that_was_not_measured_under_these_circumstances_is_invalid() {
    let slower = TaskArm {
        task: TaskReport { period_ns: 4_000_000, ..task("sleep", 2_000).task },
        ..task("sleep", 2_000)
    };
    let report = report(vec![slower, task("hybrid", 500)]);
    let says = ["hybrid (1 ms)", "no arm \"sleep\""];
    assert_judged(&ratio_rule("p50", 1.0), &report, RuleOutcome::Invalid, &says);
}

#[test]
fn an_arm_is_judged_under_all_circumstances_that_were_measured() {
    let other = |task: TaskArm| TaskArm { load: "cpu".into(), ..task };
    let report = report(vec![
        task("sleep", 2_000),
        task("hybrid", 500),
        other(task("sleep", 2_000)),
        other(task("hybrid", 1_900)),
    ]);
    let judged = ratio_rule("p50", 2.0).judge(&report);
    let outcomes: Vec<RuleOutcome> = judged.iter().map(|judged| judged.outcome).collect();
    assert_eq!(outcomes, [RuleOutcome::Pass, RuleOutcome::Fail]);
    assert!(judged[1].says.contains("1 ms, cpu"), "{judged:?}");
}

#[test]
fn an_absolute_bound_is_judged_on_metal() {
    let report = report(vec![task("hybrid", 500)]);
    let says = ["hybrid (1 ms): p99.9 is 500 ns; it may be at most 600 ns"];
    assert_judged(&bound_rule("p99_9", 600.0), &report, RuleOutcome::Pass, &says);
    assert_judged(&bound_rule("p99_9", 500.0), &report, RuleOutcome::Pass, &[]);
    assert_judged(&bound_rule("p99_9", 499.0), &report, RuleOutcome::Fail, &["at most 499 ns"]);
}

#[test]
fn an_absolute_bound_is_skipped_in_a_virtual_machine() {
    let report = in_vm(report(vec![task("hybrid", 500)]));
    for at_most_ns in [1.0, 1e6] {
        let gate = bound_rule("p50", at_most_ns);
        assert_judged(&gate, &report, RuleOutcome::Skipped, &["hybrid", "virtual machine"]);
    }
}

#[test]
fn a_bound_on_a_cost_is_in_nanoseconds_and_their_parts() {
    let turns = turns(1_500, 2_000, 0);
    let cost = CostReport {
        name: "hybrid".into(),
        instances: 10,
        histograms: [("step_ps".to_owned(), turns.all().encode())].into(),
        turns: turns.reports().to_vec(),
        ..CostReport::default()
    };
    let report = Report { costs: vec![cost], ..Report::default() };
    let says = ["hybrid (10 instances): p50 is 1.5 ns; it may be at most 1.4 ns"];
    assert_judged(&bound_rule("p50", 1.4), &report, RuleOutcome::Fail, &says);
}

#[test]
fn an_arm_that_was_not_measured_is_invalid_and_those_that_were_are_named() {
    let gate = bound_rule("p50", 5.0);
    let others = report(vec![task("sleep", 2_000), task("spin", 9)]);
    assert_judged(&gate, &others, RuleOutcome::Invalid, &["no arm \"hybrid\"", "sleep, spin"]);
    assert_judged(&gate, &report(vec![]), RuleOutcome::Invalid, &["no arm \"hybrid\""]);
}

#[test]
fn too_few_samples_are_invalid() {
    // 10 turns of 99 samples: fewer than ten lie beyond p99.
    let few = |name: &str| task_of(name, &turns(500, 99, 0));
    let report = report(vec![few("sleep"), few("hybrid")]);
    for gate in [ratio_rule("p99", 1.0), bound_rule("p99", 1.0)] {
        assert_judged(
            &gate,
            &report,
            RuleOutcome::Invalid,
            &["hybrid", "p99", "990 of 1000 samples"],
        );
    }
    assert_judged(&ratio_rule("p90", 1.0), &report, RuleOutcome::Pass, &[]);
    assert_judged(&bound_rule("p90", 500.0), &report, RuleOutcome::Pass, &[]);
}

#[test]
fn an_arm_with_too_many_invalid_turns_is_invalid() {
    let disturbed = report(vec![task("sleep", 2_000), task_of("hybrid", &turns(500, 2_000, 3))]);
    for gate in [ratio_rule("p50", 1.0), bound_rule("p50", 1.0)] {
        assert_judged(&gate, &disturbed, RuleOutcome::Invalid, &["30 %", "quieter machine"]);
    }
    let a_fifth = report(vec![task("sleep", 2_000), task_of("hybrid", &turns(500, 2_000, 2))]);
    assert_judged(&ratio_rule("p50", 1.0), &a_fifth, RuleOutcome::Pass, &[]);
}

#[test]
fn a_reference_with_too_many_invalid_turns_is_invalid() {
    let report = report(vec![task_of("sleep", &turns(2_000, 2_000, 3)), task("hybrid", 500)]);
    assert_judged(&ratio_rule("p50", 1.0), &report, RuleOutcome::Invalid, &["sleep", "30 %"]);
}

#[test]
fn a_gate_may_allow_more_invalid_turns_but_five_must_be_left() {
    let of = |invalid| {
        report(vec![task("sleep", 2_000), task_of("hybrid", &turns(500, 2_000, invalid))])
    };
    let gate = Gate { invalid_turns: 1.0, ..ratio_rule("p50", 1.0) };
    assert_judged(&gate, &of(5), RuleOutcome::Pass, &[]);
    assert_judged(&gate, &of(6), RuleOutcome::Invalid, &["4 of 5 valid turns", "2 times as long"]);
}

#[test]
fn all_rules_are_judged_in_their_order() {
    let report = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    let rules = [bound_rule("p50", 1.0), ratio_rule("p50", 3.0), bound_rule("p50", 501.0)];
    let gate = gate(rules.into_iter().flat_map(|gate| gate.rules).collect());
    let outcomes: Vec<RuleOutcome> =
        gate.judge(&report).iter().map(|judged| judged.outcome).collect();
    assert_eq!(outcomes, [RuleOutcome::Fail, RuleOutcome::Pass, RuleOutcome::Pass]);
}

#[test]
fn a_broken_rule_outweighs_one_that_nobody_can_decide() {
    let all = [RuleOutcome::Skipped, RuleOutcome::Pass, RuleOutcome::Invalid, RuleOutcome::Fail];
    assert!(all.is_sorted());
    assert_eq!(all.map(RuleOutcome::as_str), ["skipped", "pass", "invalid", "fail"]);
}
