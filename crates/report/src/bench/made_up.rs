//! Arms and gates for the tests of comparisons.

use isochrone_machine::Disturbance;
use isochrone_timing::{Distribution, TaskReport};

use super::gate::{Bound, Gate, Rule};
use super::measured::{INVALID_ALLOWED, PERCENTILES};
use super::turns::Turns;
use crate::report::{Report, TaskArm};

pub(in crate::bench) const TURNS: u64 = 10;

/// Ten turns of `samples` equal samples each, of which the first `invalid` had page faults.
pub(in crate::bench) fn turns(value: u64, samples: u64, invalid: u64) -> Turns {
    let mut turns = Turns::default();
    for turn in 0..TURNS {
        let mut of_turn = Distribution::new();
        of_turn.record_many(value, samples);
        let disturbance =
            Disturbance { faults: Some(u64::from(turn < invalid)), ..Disturbance::default() };
        turns.push(turn as f64, 1_000_000_000, &of_turn, 0, disturbance);
    }
    turns
}

pub(in crate::bench) fn task_of(name: &str, turns: &Turns) -> TaskArm {
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
pub(in crate::bench) fn task(name: &str, jitter_ns: u64) -> TaskArm {
    task_of(name, &turns(jitter_ns, 2_000, 0))
}

pub(in crate::bench) fn report(tasks: Vec<TaskArm>) -> Report {
    Report { tasks, ..Report::default() }
}

pub(in crate::bench) fn gate(rules: Vec<Rule>) -> Gate {
    Gate { rules, invalid_turns: INVALID_ALLOWED }
}

/// A rule for `hybrid`.
pub(in crate::bench) fn rule(percentile: &str, bound: Bound) -> Gate {
    let percentile = PERCENTILES.iter().find(|known| known.key == percentile).unwrap();
    gate(vec![Rule { arm: "hybrid".into(), percentile, bound }])
}

/// `hybrid` must be this many times lower than `sleep`.
pub(in crate::bench) fn ratio_rule(percentile: &str, at_least: f64) -> Gate {
    rule(percentile, Bound::TimesLower { than: "sleep".into(), at_least })
}

pub(in crate::bench) fn bound_rule(percentile: &str, at_most_ns: f64) -> Gate {
    rule(percentile, Bound::AtMostNs(at_most_ns))
}
