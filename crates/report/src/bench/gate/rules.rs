//! The file of a gate: rules, each with one bound, checked as they are read.

use serde::Deserialize;

use crate::bench::measured::{INVALID_ALLOWED, PERCENTILES, Percentile};

/// A gate, as its file defines it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "WrittenGate")]
pub struct Gate {
    /// The rules; all must hold.
    pub rules: Vec<Rule>,
    /// Largest fraction of an arm's turns that may be invalid, 0 to 1.
    pub invalid_turns: f64,
}

/// One rule of a gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// The arm that the rule applies to, under all conditions that were measured.
    pub arm: String,
    /// The percentile that it bounds.
    pub percentile: &'static Percentile,
    /// The bound.
    pub bound: Bound,
}

/// The bound of a rule.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Bound {
    /// The arm must be a number of times lower than another arm of the same run.
    TimesLower {
        /// The other arm.
        than: String,
        /// The smallest ratio; below 1 it allows the arm to be higher.
        at_least: f64,
    },
    /// An absolute bound, in ns. It is not judged in a virtual machine, where it would depend on
    /// the host.
    AtMostNs(f64),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenGate {
    rule: Vec<WrittenRule>,
    #[serde(default = "invalid_allowed", alias = "invalid_blocks")]
    invalid_turns: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenRule {
    arm: String,
    percentile: String,
    times_lower_than: Option<String>,
    at_least: Option<f64>,
    at_most_ns: Option<f64>,
}

impl TryFrom<WrittenGate> for Gate {
    type Error = RuleError;

    fn try_from(gate: WrittenGate) -> Result<Self, RuleError> {
        if !(0.0..=1.0).contains(&gate.invalid_turns) {
            return Err(RuleError(format!(
                "invalid_turns is {}; it must be from 0 (no turn may be invalid) to 1 (all may be)",
                gate.invalid_turns
            )));
        }
        let rules = gate.rule.into_iter().enumerate();
        Ok(Self {
            rules: rules.map(|(index, rule)| rule.checked(index + 1)).collect::<Result<_, _>>()?,
            invalid_turns: gate.invalid_turns,
        })
    }
}

impl WrittenRule {
    fn checked(self, number: usize) -> Result<Rule, RuleError> {
        let refused = |why: String| Err(RuleError(format!("rule {number}: {why}")));
        let found = PERCENTILES.iter().find(|percentile| percentile.key == self.percentile);
        let bound = match (self.times_lower_than, self.at_least, self.at_most_ns) {
            (Some(than), Some(at_least), None) => Bound::TimesLower { than, at_least },
            (None, None, Some(at_most_ns)) => Bound::AtMostNs(at_most_ns),
            _ => {
                return refused("give either times_lower_than and at_least, or at_most_ns".into());
            }
        };
        let (key, value) = match bound {
            Bound::TimesLower { at_least, .. } => ("at_least", at_least),
            Bound::AtMostNs(at_most_ns) => ("at_most_ns", at_most_ns),
        };
        if !(value.is_finite() && value > 0.0) {
            return refused(format!("{key} is {value}; it must be a number greater than 0"));
        }
        if matches!(&bound, Bound::TimesLower { than, .. } if *than == self.arm) {
            return refused(format!(
                "the arm \"{}\" is compared with itself; name another arm in times_lower_than",
                self.arm
            ));
        }
        let Some(percentile) = found else {
            return refused(format!(
                "there is no percentile \"{}\"; use p50, p90, p99, p99_9 or p99_99",
                self.percentile
            ));
        };
        Ok(Rule { arm: self.arm, percentile, bound })
    }
}

fn invalid_allowed() -> f64 {
    INVALID_ALLOWED
}

/// A rule that makes no sense: which one, why, and what to write instead.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RuleError(String);

impl Gate {
    /// Checks that `arms`, which are about to be measured, include every arm that a rule names.
    ///
    /// # Errors
    /// A rule names an arm that is not among them.
    pub fn check_arms(&self, arms: &[&str]) -> Result<(), RuleError> {
        for (index, rule) in self.rules.iter().enumerate() {
            let other = match &rule.bound {
                Bound::TimesLower { than, .. } => Some(than),
                Bound::AtMostNs(_) => None,
            };
            let absent = |arm: &&String| !arms.contains(&arm.as_str());
            if let Some(arm) = std::iter::once(&rule.arm).chain(other).find(absent) {
                let (number, known) = (index + 1, arms.join(", "));
                return Err(RuleError(format!(
                    "rule {number}: this bench has no arm \"{arm}\", only {known}; change the rule or --arms"
                )));
            }
        }
        Ok(())
    }
}

isochrone_model::debug_as_display!(RuleError);

#[cfg(test)]
#[path = "rules_tests.rs"]
mod tests;
