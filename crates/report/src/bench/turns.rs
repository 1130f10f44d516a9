//! Turns: stretches of time in which an arm ran, and what disturbed them.

use isochrone_machine::Disturbance;
use isochrone_timing::Distribution;

use crate::report::TurnReport;

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
