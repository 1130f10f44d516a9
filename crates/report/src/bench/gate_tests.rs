use isochrone_machine::{Disturbance, Environment};
use isochrone_timing::{Distribution, TaskReport};

use super::*;
use crate::bench::Turns;
use crate::report::{CostReport, TaskArm};

const TURNS: u64 = 10;

/// Ten turns of `samples` equal samples each, of which the first `invalid` had page faults.
fn turns(value: u64, samples: u64, invalid: u64) -> Turns {
    let mut turns = Turns::default();
    for turn in 0..TURNS {
        let mut of_turn = Distribution::new();
        of_turn.record_many(value, samples);
        let disturbance =
            Disturbance { faults: u64::from(turn < invalid), ..Disturbance::default() };
        turns.push(turn as f64, 1_000_000_000, &of_turn, 0, disturbance);
    }
    turns
}

fn task_of(name: &str, turns: &Turns) -> TaskArm {
    TaskArm {
        task: TaskReport {
            name: name.into(),
            period_ns: 1_000_000,
            histograms: [("release_jitter_ns".to_owned(), turns.all().encode())].into(),
            ..TaskReport::default()
        },
        turns: turns.reports().to_vec(),
        ..TaskArm::default()
    }
}

/// An arm whose jitter is always the same; below 2048 ns a histogram keeps it exactly.
fn task(name: &str, jitter_ns: u64) -> TaskArm {
    task_of(name, &turns(jitter_ns, 2_000, 0))
}

fn report(tasks: Vec<TaskArm>) -> Report {
    Report { tasks, ..Report::default() }
}

fn in_vm(report: Report) -> Report {
    let environment = Environment { hypervisor: Some("kvm".into()), ..Environment::default() };
    Report { environment, ..report }
}

fn gate(rules: Vec<Rule>) -> Gate {
    Gate { rules, invalid_turns: a_fifth() }
}

/// A rule for `hybrid`.
fn rule(percentile: &str, bound: Bound) -> Gate {
    let percentile = PERCENTILES.iter().find(|known| known.key == percentile).unwrap();
    gate(vec![Rule { arm: "hybrid".into(), percentile, bound }])
}

/// `hybrid` must be this many times lower than `sleep`.
fn ratio_rule(percentile: &str, at_least: f64) -> Gate {
    rule(percentile, Bound::TimesLower { than: "sleep".into(), at_least })
}

fn bound_rule(percentile: &str, at_most_ns: f64) -> Gate {
    rule(percentile, Bound::AtMostNs(at_most_ns))
}

/// A gate as its file has it, in JSON.
fn read(text: &str) -> Result<Gate, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

/// The outcome of a gate's only judgement.
#[track_caller]
fn judge(gate: &Gate, report: &Report) -> Judgement {
    let judged = gate.judge(report);
    assert_eq!(judged.len(), 1, "{judged:?}");
    judged.into_iter().next().unwrap()
}

#[track_caller]
fn assert_judged(gate: &Gate, report: &Report, outcome: Outcome, parts: &[&str]) {
    let Judgement { outcome: judged, says } = judge(gate, report);
    assert_eq!(judged, outcome, "{says}");
    parts.iter().for_each(|part| assert!(says.contains(part), "{part:?} is not in: {says}"));
}

#[test]
fn a_ratio_that_is_kept_passes_and_says_how_well() {
    let report = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    let says = ["hybrid (1 ms)", "p99 4.00 times lower than sleep", "4.00 to 4.00", "at least 3.5"];
    assert_judged(&ratio_rule("p99", 3.5), &report, Outcome::Pass, &says);
}

#[test]
fn a_ratio_that_is_not_kept_fails() {
    let report = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    assert_judged(&ratio_rule("p99", 4.5), &report, Outcome::Fail, &["4.00", "at least 4.5"]);
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
    assert_judged(&ratio_rule("p50", between), &report, Outcome::Invalid, &["as long"]);
    assert_judged(&ratio_rule("p50", comparison.low - 0.1), &report, Outcome::Pass, &[]);
    assert_judged(&ratio_rule("p50", comparison.high + 0.1), &report, Outcome::Fail, &[]);
}

#[test]
fn a_ratio_is_judged_in_a_virtual_machine_too() {
    let report = in_vm(report(vec![task("sleep", 2_000), task("hybrid", 1_900)]));
    assert_judged(&ratio_rule("p50", 2.0), &report, Outcome::Fail, &[]);
}

#[test]
fn a_ratio_to_an_arm_that_was_not_measured_under_these_circumstances_is_invalid() {
    let slower = TaskArm {
        task: TaskReport { period_ns: 4_000_000, ..task("sleep", 2_000).task },
        ..task("sleep", 2_000)
    };
    let report = report(vec![slower, task("hybrid", 500)]);
    let says = ["hybrid (1 ms)", "no arm \"sleep\""];
    assert_judged(&ratio_rule("p50", 1.0), &report, Outcome::Invalid, &says);
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
    let outcomes: Vec<Outcome> = judged.iter().map(|judged| judged.outcome).collect();
    assert_eq!(outcomes, [Outcome::Pass, Outcome::Fail]);
    assert!(judged[1].says.contains("1 ms, cpu"), "{judged:?}");
}

#[test]
fn an_absolute_bound_is_judged_on_metal() {
    let report = report(vec![task("hybrid", 500)]);
    let says = ["hybrid (1 ms): p99.9 500 ns, at most 600 ns"];
    assert_judged(&bound_rule("p99_9", 600.0), &report, Outcome::Pass, &says);
    assert_judged(&bound_rule("p99_9", 500.0), &report, Outcome::Pass, &[]);
    assert_judged(&bound_rule("p99_9", 499.0), &report, Outcome::Fail, &["at most 499 ns"]);
}

#[test]
fn an_absolute_bound_is_skipped_in_a_virtual_machine() {
    let report = in_vm(report(vec![task("hybrid", 500)]));
    for at_most_ns in [1.0, 1e6] {
        let gate = bound_rule("p50", at_most_ns);
        assert_judged(&gate, &report, Outcome::Skipped, &["hybrid", "virtual machine"]);
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
    let says = ["hybrid (10 instances): p50 1.5 ns, at most 1.4 ns"];
    assert_judged(&bound_rule("p50", 1.4), &report, Outcome::Fail, &says);
}

#[test]
fn an_arm_that_was_not_measured_is_invalid_and_those_that_were_are_named() {
    let gate = bound_rule("p50", 5.0);
    let others = report(vec![task("sleep", 2_000), task("spin", 9)]);
    assert_judged(&gate, &others, Outcome::Invalid, &["no arm \"hybrid\"", "sleep, spin"]);
    assert_judged(&gate, &report(vec![]), Outcome::Invalid, &["no arm \"hybrid\""]);
}

#[test]
fn too_few_samples_are_invalid() {
    // 10 turns of 99 samples: fewer than ten lie beyond p99.
    let few = |name: &str| task_of(name, &turns(500, 99, 0));
    let report = report(vec![few("sleep"), few("hybrid")]);
    for gate in [ratio_rule("p99", 1.0), bound_rule("p99", 1.0)] {
        assert_judged(&gate, &report, Outcome::Invalid, &["hybrid", "p99", "990 of 1000 samples"]);
    }
    assert_judged(&ratio_rule("p90", 1.0), &report, Outcome::Pass, &[]);
    assert_judged(&bound_rule("p90", 500.0), &report, Outcome::Pass, &[]);
}

#[test]
fn an_arm_with_too_many_invalid_turns_is_invalid() {
    let disturbed = report(vec![task("sleep", 2_000), task_of("hybrid", &turns(500, 2_000, 3))]);
    for gate in [ratio_rule("p50", 1.0), bound_rule("p50", 1.0)] {
        assert_judged(&gate, &disturbed, Outcome::Invalid, &["30 %", "quieter machine"]);
    }
    let a_fifth = report(vec![task("sleep", 2_000), task_of("hybrid", &turns(500, 2_000, 2))]);
    assert_judged(&ratio_rule("p50", 1.0), &a_fifth, Outcome::Pass, &[]);
}

#[test]
fn a_reference_with_too_many_invalid_turns_is_invalid() {
    let report = report(vec![task_of("sleep", &turns(2_000, 2_000, 3)), task("hybrid", 500)]);
    assert_judged(&ratio_rule("p50", 1.0), &report, Outcome::Invalid, &["sleep", "30 %"]);
}

#[test]
fn a_gate_may_allow_more_invalid_turns_but_five_must_be_left() {
    let of = |invalid| {
        report(vec![task("sleep", 2_000), task_of("hybrid", &turns(500, 2_000, invalid))])
    };
    let gate = Gate { invalid_turns: 1.0, ..ratio_rule("p50", 1.0) };
    assert_judged(&gate, &of(5), Outcome::Pass, &[]);
    assert_judged(&gate, &of(6), Outcome::Invalid, &["4 of 5 valid turns", "2 times as long"]);
}

#[test]
fn all_rules_are_judged_in_their_order() {
    let report = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    let rules = [bound_rule("p50", 1.0), ratio_rule("p50", 3.0), bound_rule("p50", 501.0)];
    let gate = gate(rules.into_iter().flat_map(|gate| gate.rules).collect());
    let outcomes: Vec<Outcome> = gate.judge(&report).iter().map(|judged| judged.outcome).collect();
    assert_eq!(outcomes, [Outcome::Fail, Outcome::Pass, Outcome::Pass]);
}

#[test]
fn the_worst_outcome_is_the_largest() {
    let all = [Outcome::Skipped, Outcome::Pass, Outcome::Fail, Outcome::Invalid];
    assert!(all.is_sorted());
    assert_eq!(all.map(Outcome::as_str), ["skipped", "pass", "fail", "invalid"]);
}

#[test]
fn a_percentile_that_there_is_not_is_an_error_that_names_the_rule() {
    let rule = |percentile: &str| {
        format!(r#"{{ "arm": "hybrid", "percentile": "{percentile}", "at_most_ns": 1 }}"#)
    };
    let error =
        read(&format!(r#"{{ "rule": [{}, {}] }}"#, rule("p50"), rule("p99.9"))).unwrap_err();
    assert!(error.contains("rule 2: there is no percentile \"p99.9\""), "{error}");
    assert!(error.contains("p99_9"), "{error}");
}

#[test]
fn a_rule_has_exactly_one_bound() {
    let of = |bound: &str| {
        read(&format!(r#"{{ "rule": [{{ "arm": "hybrid", "percentile": "p50"{bound} }}] }}"#))
    };
    let (sleep, least, most) =
        (r#", "times_lower_than": "sleep""#, r#", "at_least": 2"#, r#", "at_most_ns": 5"#);
    for bound in [
        String::new(),
        sleep.to_owned(),
        least.to_owned(),
        [sleep, least, most].concat(),
        [sleep, most].concat(),
        [least, most].concat(),
    ] {
        let error = of(&bound).unwrap_err();
        assert!(error.contains("rule 1: give either"), "{bound}: {error}");
    }
    assert_eq!(of(&[sleep, least].concat()), Ok(ratio_rule("p50", 2.0)));
    assert_eq!(of(most), Ok(bound_rule("p50", 5.0)));
    assert!(of(r#", "at_most_ns": 0"#).unwrap_err().contains("greater than 0"));
}

#[test]
fn an_arm_that_will_not_be_measured_is_found_beforehand() {
    let gate =
        gate([bound_rule("p50", 1.0), ratio_rule("p50", 1.0)].map(|g| g.rules[0].clone()).into());
    assert_eq!(gate.check_arms(&["sleep", "hybrid"]), Ok(()));
    let error = gate.check_arms(&["hybrid", "spin"]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "rule 2: there is no arm \"sleep\"; this bench has: hybrid, spin"
    );
    assert!(gate.check_arms(&["sleep"]).unwrap_err().to_string().contains("rule 1"));
}

#[test]
fn a_file_says_rules_and_how_many_turns_may_be_invalid_and_nothing_else() {
    let rule = r#"{ "arm": "hybrid", "percentile": "p50", "at_most_ns": 7 }"#;
    assert_eq!(read(&format!(r#"{{ "rule": [{rule}] }}"#)).unwrap(), bound_rule("p50", 7.0));
    let lenient = read(&format!(r#"{{ "rule": [{rule}], "invalid_turns": 0.5 }}"#)).unwrap();
    assert_eq!(lenient.invalid_turns, 0.5);
    assert!(read(r#"{ "rule": [], "rules": [] }"#).is_err());
    assert!(read(&format!(r#"{{ "rule": [{}] }}"#, rule.replace("at_most_ns", "atmost"))).is_err());
}

#[test]
fn reports_are_compared_arm_by_arm_under_the_same_circumstances() {
    let first = report(vec![task("hybrid", 500), task("sleep", 1_000), task("gone", 5)]);
    let other_load = TaskArm { load: "cpu".into(), ..task("hybrid", 1) };
    let second = report(vec![other_load, task("sleep", 2_000), task("hybrid", 500)]);
    let found: Vec<(String, Verdict)> = compare_reports(&first, &second)
        .comparisons
        .into_iter()
        .filter(|comparison| comparison.percentile == "p50")
        .map(|comparison| (comparison.candidate, comparison.verdict))
        .collect();
    let expected =
        [("hybrid (1 ms)".to_owned(), Verdict::Same), ("sleep (1 ms)".to_owned(), Verdict::Worse)];
    assert_eq!(found, expected);
}

#[test]
fn one_that_is_worse_makes_all_of_it_worse() {
    let of = |verdicts: &[Verdict]| {
        let comparison = |verdict: &Verdict| Comparison { verdict: *verdict, ..Default::default() };
        overall(&verdicts.iter().map(comparison).collect::<Vec<_>>())
    };
    assert_eq!(of(&[Verdict::Better, Verdict::Worse, Verdict::Same]), Verdict::Worse);
    assert_eq!(of(&[Verdict::Same, Verdict::Better]), Verdict::Better);
    assert_eq!(of(&[Verdict::Same]), Verdict::Same);
    assert_eq!(of(&[]), Verdict::Same);
}

#[test]
fn a_bound_that_is_no_number_above_0_makes_no_sense() {
    let ratio = |at_least| WrittenRule {
        times_lower_than: Some("sleep".into()),
        at_least: Some(at_least),
        ..written()
    };
    let bound = |at_most_ns| WrittenRule { at_most_ns: Some(at_most_ns), ..written() };
    for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for rule in [ratio(value), bound(value)] {
            assert_eq!(rule.checked(3), Err(RuleError::Value { number: 3 }));
        }
    }
}

#[test]
fn invalid_turns_are_a_part_of_all_turns_from_0_to_1() {
    let gate = |invalid_turns| Gate::try_from(WrittenGate { rule: vec![], invalid_turns });
    for part in [-0.1, 1.1, 20.0, f64::NAN, f64::INFINITY] {
        let error = gate(part).unwrap_err();
        assert_eq!(error, RuleError::InvalidTurns { part: part.to_string() });
    }
    for part in [0.0, 0.2, 1.0] {
        assert!(gate(part).is_ok());
    }
}

#[test]
fn an_arm_is_not_compared_with_itself() {
    let rule =
        WrittenRule { times_lower_than: Some("hybrid".into()), at_least: Some(1.0), ..written() };
    assert_eq!(rule.checked(2), Err(RuleError::Itself { number: 2, arm: "hybrid".into() }));
}

fn written() -> WrittenRule {
    WrittenRule {
        arm: "hybrid".into(),
        percentile: "p50".into(),
        times_lower_than: None,
        at_least: None,
        at_most_ns: None,
    }
}

#[test]
fn reports_are_compared_arm_by_arm_and_what_cannot_be_is_left_out_with_the_reason() {
    let disturbed = task_of("spin", &turns(500, 2_000, 3));
    let first = report(vec![task("sleep", 2_000), task("hybrid", 500), disturbed.clone()]);
    let second = report(vec![task("hybrid", 1_000), disturbed]);
    let compared = compare_reports(&first, &second);
    assert!(compared.comparisons.iter().all(|c| c.candidate == "hybrid (1 ms)"));
    assert_eq!(overall(&compared.comparisons), Verdict::Worse);
    let [sleep, spin] = &compared.left_out[..] else { panic!("{compared:?}") };
    assert!(sleep.arm.contains("sleep") && sleep.why.contains("not in the second"), "{sleep:?}");
    assert!(spin.arm.contains("spin") && spin.why.contains("30 %"), "{spin:?}");
}

#[test]
fn the_table_of_two_reports_has_one_heading_that_says_which_is_compared_with_which() {
    let first = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
    let second = report(vec![task("sleep", 1_000), task("hybrid", 1_000)]);
    let compared = compare_reports(&first, &second);
    let table = crate::ComparisonTable(&compared.comparisons).to_string();
    assert!(
        table.trim_start().starts_with("second report against the first: times lower"),
        "{table}"
    );
    assert_eq!(table.matches("times lower").count(), 1, "{table}");
    assert!(table.contains("  sleep (1 ms)") && table.contains("  hybrid (1 ms)"), "{table}");
}

#[test]
fn what_else_differs_between_two_reports_is_said() {
    let ran = |scheduler: &str, kernel: &str| {
        let task = TaskArm {
            task: TaskReport { scheduler: scheduler.into(), ..task("hybrid", 500).task },
            ..task("hybrid", 500)
        };
        let environment = Environment { kernel: Some(kernel.into()), ..Environment::default() };
        Report { environment, ..report(vec![task]) }
    };
    let (fifo, other) = (ran("fifo:80", "6.18"), ran("other", "6.19"));
    assert_eq!(compare_reports(&fifo, &fifo).differences, Vec::<String>::new());
    let differences = compare_reports(&fifo, &other).differences;
    let said = ["kernel: 6.18 and 6.19", "scheduler of hybrid (1 ms): fifo:80 and other"];
    assert_eq!(differences, said);
}
