//! The check that the arm `sleep` stands for cyclictest.

use isochrone_report::{Measurement, Report, supports};
use isochrone_timing::{Warning, WarningCode};

use super::settings::Loop;

/// How far `sleep` may be from the real cyclictest.
struct Limit {
    percentile: &'static str,
    quantile: f64,
    /// Part of the cyclictest's value.
    part: f64,
}

const LIMITS: [Limit; 2] = [
    Limit { percentile: "p50", quantile: 0.5, part: 0.10 },
    Limit { percentile: "p99", quantile: 0.99, part: 0.25 },
];

/// A warning for each place where the arm `sleep` is not the cyclictest that ran beside it.
pub fn check(report: &Report) -> Vec<Warning> {
    let measured = report.measured();
    let arms = |of: Loop| {
        let name = of.name();
        measured.iter().filter(move |arm| arm.arm == name)
    };
    let pairs = arms(Loop::Sleep).flat_map(|sleep| {
        let beside = |real: &&Measurement| real.circumstances == sleep.circumstances;
        arms(Loop::Cyclictest).find(beside).map(|real| (sleep, real))
    });
    pairs.flat_map(|(sleep, real)| differences(sleep, real)).collect()
}

fn differences(sleep: &Measurement, real: &Measurement) -> Vec<Warning> {
    let supported = |limit: &&Limit| {
        [sleep, real].iter().all(|arm| supports(arm.distribution.count(), limit.quantile))
    };
    let difference = |Limit { percentile, quantile, part: limit }: &Limit| {
        let at = |arm: &Measurement| arm.distribution.quantile(*quantile) as f64;
        let part = at(sleep) / at(real).max(1.0) - 1.0;
        (part.abs() > *limit).then(|| Warning::new(
            WarningCode::SleepDiffers,
            format!(
                "{percentile} of the arm {} is {:.0} % {} that of {} ({}); within {:.0} % it stands for \
                 it",
                Loop::Sleep.name(),
                100.0 * part.abs(),
                if part < 0.0 { "below" } else { "above" },
                Loop::Cyclictest.name(),
                sleep.circumstances,
                100.0 * limit
            ),
        ))
    };
    LIMITS.iter().filter(supported).filter_map(difference).collect()
}

#[cfg(test)]
mod tests {
    use isochrone_report::TaskArm;
    use isochrone_timing::{Distribution, TaskReport};

    use super::*;

    fn report(sleep_ns: u64, cyclictest_ns: u64) -> Report {
        let task = |of: Loop, ns: u64| {
            let mut jitter = Distribution::new();
            jitter.record_many(ns, 1_000);
            TaskArm::from(TaskReport {
                name: of.name(),
                histograms: [("release_jitter_ns".to_owned(), jitter.encode())].into(),
                ..TaskReport::default()
            })
        };
        let tasks = vec![task(Loop::Sleep, sleep_ns), task(Loop::Cyclictest, cyclictest_ns)];
        Report { tasks, ..Report::default() }
    }

    #[test]
    fn a_sleep_within_the_limits_stands_for_cyclictest() {
        assert_eq!(check(&report(14_000, 13_500)), []);
    }

    #[test]
    fn a_sleep_that_differs_is_said_to() {
        let codes = |report| check(&report).into_iter().map(|w| w.message).collect::<Vec<_>>();
        let one = codes(report(16_000, 13_500));
        let says = "p50 of the arm sleep is 19 % above that of cyclictest";
        assert!(one.len() == 1 && one[0].starts_with(says), "{one:?}");
        let below = codes(report(10_800, 13_500));
        assert!(below[0].contains("is 20 % below that of cyclictest"), "{below:?}");
        assert_eq!(codes(report(26_000, 13_500)).len(), 2);
    }

    #[test]
    fn few_samples_say_nothing() {
        let mut few = report(16_000, 13_500);
        for task in &mut few.tasks {
            let mut jitter = Distribution::new();
            let is_sleep = task.task.name == Loop::Sleep.name();
            jitter.record_many(if is_sleep { 90_000 } else { 9_000 }, 19);
            task.task.histograms.insert("release_jitter_ns".into(), jitter.encode());
        }
        assert_eq!(check(&few), []);
    }

    #[test]
    fn without_cyclictest_there_is_nothing_to_say() {
        let mut alone = report(1, 1);
        alone.tasks.pop();
        assert_eq!(check(&alone), []);
    }
}
