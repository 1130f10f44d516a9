//! A gate: bounds that the result of a bench must keep.

use serde::Deserialize;

use super::compare::Verdict;
use super::measured::{Comparison, Measured, PERCENTILES, Percentile};
use crate::report::Report;

/// A gate, as its file has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gate {
    /// The rules; all of them must hold.
    #[serde(rename = "rule")]
    pub rules: Vec<Rule>,
    /// The largest part of an arm's blocks, 0 to 1, that may be invalid.
    #[serde(default = "a_fifth")]
    pub invalid_blocks: f64,
}

/// One rule of a gate: a ratio between arms, or an absolute bound.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rule {
    /// The arm that must keep it, under all circumstances that were measured.
    pub arm: String,
    /// `p50`, `p90`, `p99`, `p99_9` or `p99_99`.
    pub percentile: String,
    /// The arm that the ratio is taken to.
    #[serde(default)]
    pub times_lower_than: Option<String>,
    /// The least ratio.
    #[serde(default)]
    pub at_least: Option<f64>,
    /// The absolute bound, in ns (ps for costs). In a virtual machine it is not judged: there it
    /// would say something of the host.
    #[serde(default)]
    pub at_most_ns: Option<u64>,
}

fn a_fifth() -> f64 {
    0.2
}

/// What became of a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Not judged here.
    Skipped,
    /// The rule holds.
    Pass,
    /// The rule is broken.
    Fail,
    /// The run says too little about it.
    Invalid,
}

impl Outcome {
    /// `skipped`, `pass`, `fail` or `invalid`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Skipped => "skipped",
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Invalid => "invalid",
        }
    }
}

/// A rule that makes no sense.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RuleError {
    /// Name the percentile as in a report.
    #[error(
        "rule {number}: there is no percentile \"{percentile}\"; there are p50, p90, p99, p99_9 and p99_99"
    )]
    Percentile {
        /// The rule, from 1.
        number: usize,
        /// As it was written.
        percentile: String,
    },
    /// A rule has one bound.
    #[error("rule {number}: give either times_lower_than and at_least, or at_most_ns")]
    Bound {
        /// The rule, from 1.
        number: usize,
    },
}

impl Gate {
    /// Looks whether the rules make sense.
    ///
    /// # Errors
    /// The first rule that does not.
    pub fn check(&self) -> Result<(), RuleError> {
        for (index, rule) in self.rules.iter().enumerate() {
            let number = index + 1;
            if rule.find_percentile().is_none() {
                return Err(RuleError::Percentile { number, percentile: rule.percentile.clone() });
            }
            match (&rule.times_lower_than, rule.at_least, rule.at_most_ns) {
                (Some(_), Some(_), None) | (None, None, Some(_)) => (),
                _ => return Err(RuleError::Bound { number }),
            }
        }
        Ok(())
    }

    /// Holds a report against the rules: what became of each, and a sentence about it.
    pub fn judge(&self, report: &Report) -> Vec<(Outcome, String)> {
        let measured = report.measured();
        let in_vm = report.environment.hypervisor.is_some();
        let judge = |rule: &Rule| {
            let arms: Vec<&Measured> = measured.iter().filter(|m| m.arm == rule.arm).collect();
            match arms.is_empty() {
                true => {
                    let known: Vec<&str> = measured.iter().map(|m| m.arm.as_str()).collect();
                    let says = format!("no arm \"{}\"; there are: {}", rule.arm, known.join(", "));
                    vec![(Outcome::Invalid, says)]
                }
                false => {
                    arms.iter().map(|arm| self.judge_arm(rule, arm, &measured, in_vm)).collect()
                }
            }
        };
        self.rules.iter().flat_map(judge).collect()
    }

    fn judge_arm(
        &self,
        rule: &Rule,
        arm: &Measured,
        measured: &[Measured],
        in_vm: bool,
    ) -> (Outcome, String) {
        let label = arm.label();
        let invalid = |why: String| (Outcome::Invalid, format!("{label}: {why}"));
        let Some(percentile) = rule.find_percentile() else {
            return invalid(format!("no percentile \"{}\"", rule.percentile));
        };
        if let Some(why) = self.too_disturbed(arm) {
            return invalid(why);
        }
        if let (Some(name), Some(least)) = (&rule.times_lower_than, rule.at_least) {
            let comparable = |m: &&Measured| m.arm == *name && m.circumstances == arm.circumstances;
            let Some(reference) = measured.iter().find(comparable) else {
                return invalid(format!("no arm \"{name}\" to compare it with"));
            };
            if let Some(why) = self.too_disturbed(reference) {
                return invalid(format!("{name}: {why}"));
            }
            let all = Comparison::all(reference, arm, true);
            let Some(found) = all.iter().find(|c| c.percentile == percentile.key) else {
                return invalid(format!(
                    "too few blocks or samples for {}; run it longer",
                    percentile.name
                ));
            };
            // Only what the whole interval says is said.
            let outcome = if found.high < least { Outcome::Fail } else { Outcome::Pass };
            let Comparison { ratio, low, high, .. } = found;
            return (
                outcome,
                format!(
                    "{label}: {} {ratio:.2} times lower than {name} ({low:.2} to {high:.2}), at least {least}",
                    percentile.name
                ),
            );
        }
        let bound = rule.at_most_ns.unwrap_or(u64::MAX);
        if in_vm {
            let says = "an absolute bound is not judged in a virtual machine";
            return (Outcome::Skipped, format!("{label}: {}: {says}", percentile.name));
        }
        if (arm.distribution.count() as f64) * (1.0 - percentile.quantile) < 10.0 {
            return invalid(format!("too few samples for {}; run it longer", percentile.name));
        }
        let value = arm.distribution.quantile(percentile.quantile);
        let outcome = if value > bound { Outcome::Fail } else { Outcome::Pass };
        let unit = if arm.metric.ends_with("_ps") { "ps" } else { "ns" };
        let says = format!("{label}: {} {value} {unit}, at most {bound} {unit}", percentile.name);
        (outcome, says)
    }

    fn too_disturbed(&self, arm: &Measured) -> Option<String> {
        let part = arm.invalid_part();
        (part > self.invalid_blocks).then(|| {
            format!("{:.0} % of the blocks are invalid; run it on a quieter machine", 100.0 * part)
        })
    }
}

impl Rule {
    fn find_percentile(&self) -> Option<&'static Percentile> {
        PERCENTILES.iter().find(|percentile| percentile.key == self.percentile)
    }
}

/// What two reports say about each other, arm by arm, the second against the first.
///
/// Arms are matched by name, circumstances and metric; what only one of them has is left out.
pub fn compare_reports(first: &Report, second: &Report) -> Vec<Comparison> {
    let (first, second) = (first.measured(), second.measured());
    let pairs = first.iter().filter_map(|reference| {
        let same = |m: &&Measured| m.label() == reference.label() && m.metric == reference.metric;
        Some((reference, second.iter().find(same)?))
    });
    pairs.flat_map(|(reference, candidate)| Comparison::all(reference, candidate, false)).collect()
}

/// The verdict on several comparisons: `worse` if one is, else `better` if one is.
pub fn overall(comparisons: &[Comparison]) -> Verdict {
    let any = |verdict| comparisons.iter().any(|comparison| comparison.verdict == verdict);
    match () {
        () if any(Verdict::Worse) => Verdict::Worse,
        () if any(Verdict::Better) => Verdict::Better,
        () => Verdict::Same,
    }
}

#[cfg(test)]
#[path = "gate_tests.rs"]
mod tests;
