//! The measurements of a report, arm by arm, and how the arms compare.

use isochrone_timing::{Distribution, Metric};
use serde::{Deserialize, Serialize};

use super::compare::{Pairing, TooShort, Verdict, ratio};
use super::reported::{Reported, label};
use super::samples::TurnSamples;
use crate::report::TurnReport;

/// A percentile that is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Percentile {
    /// Key in reports and gates: `p99_9`.
    pub key: &'static str,
    /// Name in tables: `p99.9`.
    pub name: &'static str,
    /// Fraction of the samples below it, 0 to 1.
    pub quantile: f64,
}

/// All percentiles that are compared.
pub const PERCENTILES: [Percentile; 5] = [
    Percentile { key: "p50", name: "p50", quantile: 0.5 },
    Percentile { key: "p90", name: "p90", quantile: 0.9 },
    Percentile { key: "p99", name: "p99", quantile: 0.99 },
    Percentile { key: "p99_9", name: "p99.9", quantile: 0.999 },
    Percentile { key: "p99_99", name: "p99.99", quantile: 0.9999 },
];

/// Largest fraction of an arm's turns that may be invalid, unless a gate sets another.
pub(super) const INVALID_ALLOWED: f64 = 0.2;

/// More of an arm's turns are invalid than are allowed.
#[derive(Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "{:.0} % of the turns are invalid, and {:.0} % are allowed; run it on a quieter machine",
    100.0 * .part,
    100.0 * .allowed
)]
pub(super) struct TooDisturbed {
    part: f64,
    allowed: f64,
}

isochrone_model::debug_as_display!(TooDisturbed);

/// One measurement of a report.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Measurement {
    /// The arm: `hybrid`, `iceoryx2`, `mixed`.
    pub arm: String,
    /// The conditions: `1 ms, idle`. Within a report, only arms under the same conditions are
    /// compared.
    pub circumstances: String,
    /// Key of the compared metric in reports: [`Metric::key`].
    pub metric: Metric,
    /// All samples.
    pub distribution: Distribution,
    /// The turns one by one; empty in the report of a run.
    pub turns: Vec<TurnReport>,
}

impl Measurement {
    /// What a part of a report measured, if it holds the distribution.
    pub(crate) fn of<R: Reported>(part: &R) -> Option<Self> {
        let found = [R::COMPARED, R::METRIC]
            .into_iter()
            .find_map(|metric| Some((metric, part.distribution(metric)?)));
        let (metric, distribution) = found?;
        Some(Self {
            arm: part.arm().to_owned(),
            circumstances: part.circumstances(),
            metric,
            distribution,
            turns: part.turns().to_vec(),
        })
    }

    /// Arm and conditions.
    pub fn label(&self) -> String {
        label(&self.arm, &self.circumstances)
    }

    /// The valid turns, which comparisons use.
    pub fn valid_turns(&self) -> Vec<TurnSamples> {
        self.turns.iter().filter_map(valid).map(|samples| TurnSamples::of(&samples)).collect()
    }

    /// The samples of all valid turns.
    pub fn valid(&self) -> Distribution {
        let mut all = Distribution::new();
        self.turns.iter().filter_map(valid).for_each(|samples| all.merge(&samples));
        all
    }

    /// Fraction of the turns that are invalid, 0 to 1.
    pub fn invalid_part(&self) -> f64 {
        let invalid = self.turns.iter().filter(|turn| turn.invalid.is_some()).count();
        invalid as f64 / self.turns.len().max(1) as f64
    }

    /// Whether more than this fraction of the turns is invalid, 0 to 1. A longer run on such a
    /// machine is as disturbed.
    pub(super) fn too_disturbed(&self, allowed: f64) -> Option<TooDisturbed> {
        let part = self.invalid_part();
        (part > allowed).then_some(TooDisturbed { part, allowed })
    }
}

/// How an arm compares with another at one percentile.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Comparison {
    /// Key of the metric in reports: [`Metric::key`].
    pub metric: String,
    /// `p50` to `p99_99`.
    pub percentile: String,
    /// The arm compared with, and its conditions.
    pub reference: String,
    /// The arm that is compared, and its conditions; lower is better.
    pub candidate: String,
    /// Percentile of the reference over its valid turns, in the unit of the metric.
    pub reference_value: u64,
    /// Percentile of the candidate over its valid turns, in the unit of the metric.
    pub candidate_value: u64,
    /// Reference divided by candidate: above 1 the candidate is lower, below 1 it is higher.
    pub ratio: f64,
    /// Lower bound of the interval that contains 99 % of the ratios obtained by resampling the
    /// turns.
    pub low: f64,
    /// Upper bound of that interval.
    pub high: f64,
    /// `better`, `same` or `worse`.
    pub verdict: Verdict,
}

impl Comparison {
    /// Compares two arms at every percentile that the samples of both support.
    pub fn all(reference: &Measurement, candidate: &Measurement, pairing: Pairing) -> Vec<Self> {
        let each = Self::each(reference, candidate, pairing);
        each.into_iter().filter_map(|(_, compared)| compared.ok()).collect()
    }

    /// Compares two arms at every percentile; an error means that a run was too short for it.
    pub fn each(
        reference: &Measurement,
        candidate: &Measurement,
        pairing: Pairing,
    ) -> Vec<(&'static Percentile, Result<Self, TooShort>)> {
        let (first, second) = match pairing {
            Pairing::Paired => valid_pairs(reference, candidate),
            Pairing::Apart => (reference.valid_turns(), candidate.valid_turns()),
        };
        let compare = |percentile: &'static Percentile| {
            let found =
                ratio(&first, &second, percentile.quantile, pairing, reference.metric.resolution);
            let compared = found.map(|found| Self {
                metric: reference.metric.key.to_owned(),
                percentile: percentile.key.to_owned(),
                reference: reference.label(),
                candidate: candidate.label(),
                reference_value: found.reference,
                candidate_value: found.candidate,
                ratio: found.ratio,
                low: found.low,
                high: found.high,
                verdict: found.verdict,
            });
            (percentile, compared)
        };
        PERCENTILES.iter().map(compare).collect()
    }
}

/// A comparison that the samples do not support.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LeftOut {
    /// What was measured, as the report's key: [`Metric::key`].
    pub metric: String,
    /// `p50` to `p99_99`; empty if it applies to all percentiles.
    pub percentile: String,
    /// The arm to compare with, and its conditions.
    pub reference: String,
    /// The arm to compare, and its conditions.
    pub candidate: String,
    /// What is missing, and how much longer to run.
    pub why: String,
}

/// The turns of rounds in which neither arm's is invalid.
fn valid_pairs(
    reference: &Measurement,
    candidate: &Measurement,
) -> (Vec<TurnSamples>, Vec<TurnSamples>) {
    let turns = reference.turns.iter().zip(&candidate.turns);
    let both = turns.filter_map(|(first, second)| Some((valid(first)?, valid(second)?)));
    both.map(|(first, second)| (TurnSamples::of(&first), TurnSamples::of(&second))).unzip()
}

/// The samples of a turn, if it is valid.
fn valid(turn: &TurnReport) -> Option<Distribution> {
    match turn.invalid {
        Some(_) => None,
        None => Distribution::decode(&turn.histogram).ok(),
    }
}

#[cfg(test)]
#[path = "measured_tests.rs"]
mod tests;
