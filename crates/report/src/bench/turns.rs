//! Turns: stretches of time in which an arm ran, and what disturbed them.

use isochrone_machine::Disturbance;
use isochrone_timing::Distribution;
use serde::{Deserialize, Serialize};

use crate::report::is_zero;

/// One turn of an arm.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TurnReport {
    /// Start of the turn, in seconds since the bench started.
    pub at_s: f64,
    /// Duration after the warm-up, in ns; 0 if the report does not say.
    #[serde(skip_serializing_if = "is_zero")]
    pub elapsed_ns: u64,
    /// Samples after the warm-up; for a loop, including one for each missed release.
    pub samples: u64,
    /// Releases missed, or messages lost, after the warm-up.
    pub missed: u64,
    /// The disturbances of the turn.
    pub disturbance: Disturbance,
    /// Why the turn says little about the arm, by the rule fixed beforehand; absent if it is valid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invalid: Option<String>,
    /// Its samples, encoded like the histograms of a task.
    pub histogram: String,
}

/// Collects the turns of an arm.
#[derive(Debug, Clone, Default)]
pub struct Turns {
    all: Distribution,
    valid: Distribution,
    missed: u64,
    reports: Vec<TurnReport>,
}

impl Turns {
    /// Adds a turn that started `at_s` seconds into the bench and lasted `elapsed_ns`.
    pub fn push(
        &mut self,
        at_s: f64,
        elapsed_ns: u64,
        samples: &Distribution,
        missed: u64,
        disturbance: Disturbance,
    ) {
        let invalid = disturbance.invalidates(elapsed_ns);
        self.all.merge(samples);
        if invalid.is_none() {
            self.valid.merge(samples);
        }
        self.missed += missed;
        self.reports.push(TurnReport {
            at_s,
            elapsed_ns,
            samples: samples.count(),
            missed,
            disturbance,
            invalid,
            histogram: samples.encode(),
        });
    }

    /// Samples of all turns.
    pub fn all(&self) -> &Distribution {
        &self.all
    }

    /// Samples of the valid turns.
    pub fn valid(&self) -> &Distribution {
        &self.valid
    }

    /// Releases missed, or messages lost, in all turns.
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// The turns in order.
    pub fn reports(&self) -> &[TurnReport] {
        &self.reports
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Distribution {
        let mut samples = Distribution::new();
        samples.record_many(90, 1_000);
        samples
    }

    #[test]
    fn a_disturbed_turn_is_shown_and_left_out_of_what_is_valid() {
        for (disturbance, says) in [
            (Disturbance { steal_ns: Some(2_000_000), ..Disturbance::default() }, "0.20 %"),
            (Disturbance { faults: Some(3), ..Disturbance::default() }, "3 page faults"),
            (Disturbance { throttled_ns: Some(50_000_000), ..Disturbance::default() }, "50000 us"),
        ] {
            let mut turns = Turns::default();
            turns.push(0.0, 1_000_000_000, &samples(), 4, disturbance);
            let reason = turns.reports()[0].invalid.clone().unwrap();
            assert!(reason.contains(says), "{reason}");
            assert_eq!((turns.all().count(), turns.valid().count()), (1_000, 0));
            assert_eq!(turns.missed(), 4);
        }
    }
}
