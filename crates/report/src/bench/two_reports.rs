//! The comparison of two reports, arm by arm.

use super::compare::{Pairing, Verdict};
use super::measured::{Comparison, INVALID_ALLOWED, Measurement};
use super::reported::Reported;
use crate::report::{Report, TaskArm};

/// An arm of the first report that cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotCompared {
    /// The arm and its conditions.
    pub arm: String,
    /// The missing part, and what to do.
    pub why: String,
}

/// The comparison of two reports.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Compared {
    /// The second report compared with the first, arm by arm.
    pub comparisons: Vec<Comparison>,
    /// Arms of the first report that cannot be compared.
    pub left_out: Vec<NotCompared>,
    /// Other differences between the runs, which may explain those between the arms.
    pub differences: Vec<String>,
}

/// Compares two reports. Arms are matched by name, conditions and metric.
pub fn compare_reports(first: &Report, second: &Report) -> Compared {
    let mut compared = Compared { differences: differences(first, second), ..Compared::default() };
    let candidates = second.measured();
    for reference in first.measured() {
        let label = reference.label();
        let same = |m: &&Measurement| m.label() == label && m.metric == reference.metric;
        let found = candidates.iter().find(same);
        let compared_arm = found
            .ok_or_else(|| "it is not in the second report; measure it in both runs".to_owned())
            .and_then(|candidate| compare_arm(&reference, candidate));
        match compared_arm {
            Ok(comparisons) => compared.comparisons.extend(comparisons),
            Err(why) => compared.left_out.push(NotCompared { arm: label, why }),
        }
    }
    compared
}

fn compare_arm(
    reference: &Measurement,
    candidate: &Measurement,
) -> Result<Vec<Comparison>, String> {
    for (which, measured) in [("first", reference), ("second", candidate)] {
        if let Some(why) = measured.too_disturbed(INVALID_ALLOWED) {
            return Err(format!("in the {which} report, {why}"));
        }
    }
    let each = Comparison::each(reference, candidate, Pairing::Apart);
    let shortest = each.iter().find_map(|(_, compared)| compared.as_ref().err().copied());
    let compared: Vec<Comparison> =
        each.into_iter().filter_map(|(_, compared)| compared.ok()).collect();
    match shortest {
        Some(why) if compared.is_empty() => Err(why.to_string()),
        _ => Ok(compared),
    }
}

/// A field of both reports that should be equal.
struct ComparedField {
    what: String,
    first: String,
    second: String,
}

/// Differences apart from the arms.
fn differences(first: &Report, second: &Report) -> Vec<String> {
    let (a, b) = (&first.environment, &second.environment);
    let said = |what: &str, first: &str, second: &str| ComparedField {
        what: what.to_owned(),
        first: first.to_owned(),
        second: second.to_owned(),
    };
    let known = |what: &str, first: &Option<String>, second: &Option<String>| {
        let [first, second] = [first, second].map(|value| value.as_deref().unwrap_or("none"));
        said(what, first, second)
    };
    let mut pairs = vec![
        said("isochrone", &first.isochrone, &second.isochrone),
        known("kernel", &a.kernel, &b.kernel),
        known("preemption", &a.preempt, &b.preempt),
        said("CPUs", &a.cpus.to_string(), &b.cpus.to_string()),
        known("hypervisor", &a.hypervisor, &b.hypervisor),
        known("clock source", &a.clocksource, &b.clocksource),
        said("isolated CPUs", &a.isolated_cpus, &b.isolated_cpus),
    ];
    for one in &first.tasks {
        let same = |other: &&TaskArm| other.label() == one.label();
        if let Some(other) = second.tasks.iter().find(same) {
            let of = |what: &str| format!("{what} of {}", one.label());
            let (one, other) = (&one.task, &other.task);
            pairs.push(said(&of("scheduler"), &one.scheduler, &other.scheduler));
            let cpu = |cpu: Option<usize>| cpu.map_or("any".to_owned(), |cpu| cpu.to_string());
            pairs.push(said(&of("CPU"), &cpu(one.cpu), &cpu(other.cpu)));
        }
    }
    let differing = pairs.into_iter().filter(|said| said.first != said.second);
    differing
        .map(|ComparedField { what, first, second }| format!("{what}: {first} and {second}"))
        .collect()
}

/// The verdict on several comparisons: `worse` if any is worse, else `better` if any is better.
pub fn overall(comparisons: &[Comparison]) -> Verdict {
    let any = |verdict| comparisons.iter().any(|comparison| comparison.verdict == verdict);
    match () {
        () if any(Verdict::Worse) => Verdict::Worse,
        () if any(Verdict::Better) => Verdict::Better,
        () => Verdict::Same,
    }
}

#[cfg(test)]
mod tests {
    use isochrone_machine::Environment;
    use isochrone_timing::TaskReport;

    use super::*;
    use crate::bench::made_up::{report, task, task_of, turns};

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
        let expected = [
            ("hybrid (1 ms)".to_owned(), Verdict::Same),
            ("sleep (1 ms)".to_owned(), Verdict::Worse),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn one_that_is_worse_makes_all_of_it_worse() {
        let of = |verdicts: &[Verdict]| {
            let comparison =
                |verdict: &Verdict| Comparison { verdict: *verdict, ..Default::default() };
            overall(&verdicts.iter().map(comparison).collect::<Vec<_>>())
        };
        assert_eq!(of(&[Verdict::Better, Verdict::Worse, Verdict::Same]), Verdict::Worse);
        assert_eq!(of(&[Verdict::Same, Verdict::Better]), Verdict::Better);
        assert_eq!(of(&[Verdict::Same]), Verdict::Same);
        assert_eq!(of(&[]), Verdict::Same);
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
        assert!(
            sleep.arm.contains("sleep") && sleep.why.contains("not in the second"),
            "{sleep:?}"
        );
        assert!(spin.arm.contains("spin") && spin.why.contains("30 %"), "{spin:?}");
    }

    #[test]
    fn the_table_of_two_reports_has_one_heading_that_says_which_is_compared_with_which() {
        let first = report(vec![task("sleep", 2_000), task("hybrid", 500)]);
        let second = report(vec![task("sleep", 1_000), task("hybrid", 1_000)]);
        let compared = compare_reports(&first, &second);
        let table = crate::ComparisonTable(&compared.comparisons).to_string();
        assert!(
            table.trim_start().starts_with("second report compared with the first, valid turns"),
            "{table}"
        );
        assert_eq!(table.matches("second report").count(), 1, "{table}");
        assert!(table.contains("2.00 times lower") && table.contains("2.00 times higher"));
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
}
