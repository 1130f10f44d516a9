//! Judges a report by the rules of a gate.

use super::rules::{Bound, Gate, Rule};
use crate::bench::compare::{Pairing, TooShort, needed, supports};
use crate::bench::measured::{Comparison, Measurement, Percentile};
use crate::bench::wording::{comparison_in_words, interval_in_words, ratio_in_words};
use crate::report::Report;

/// The result of a rule, from the lightest to the gravest: that of a gate is the gravest of its rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RuleOutcome {
    /// The rule is not judged on this machine.
    Skipped,
    /// The rule holds.
    Pass,
    /// The run does not contain enough data to judge the rule.
    Invalid,
    /// The rule is broken. This outweighs every other result: no further data mends it.
    Fail,
}

impl RuleOutcome {
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

/// The result of a rule for one of the arms that it applies to.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Judgement {
    /// Whether the rule holds.
    pub outcome: RuleOutcome,
    /// The arm, its value and the bound, or why the rule was not judged, as a sentence.
    pub says: String,
}

/// The kind of machine, which decides whether absolute bounds are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Platform {
    Metal,
    VirtualMachine,
}

impl Gate {
    /// Judges a report by the rules, with one judgement for each arm that a rule applies to.
    pub fn judge(&self, report: &Report) -> Vec<Judgement> {
        let measured = report.measured();
        let platform = if report.environment.hypervisor.is_some() {
            Platform::VirtualMachine
        } else {
            Platform::Metal
        };
        let judge = |rule: &Rule| {
            let arms: Vec<&Measurement> = measured.iter().filter(|m| m.arm == rule.arm).collect();
            if arms.is_empty() {
                let known: Vec<&str> = measured.iter().map(|m| m.arm.as_str()).collect();
                let says =
                    format!("the report has no arm \"{}\", only: {}", rule.arm, known.join(", "));
                return vec![Judgement { outcome: RuleOutcome::Invalid, says }];
            }
            arms.iter().map(|arm| self.judge_arm(rule, arm, &measured, platform)).collect()
        };
        self.rules.iter().flat_map(judge).collect()
    }

    fn judge_arm(
        &self,
        rule: &Rule,
        arm: &Measurement,
        measured: &[Measurement],
        platform: Platform,
    ) -> Judgement {
        let label = arm.label();
        let invalid = |why: String| Judgement {
            outcome: RuleOutcome::Invalid,
            says: format!("{label}: {why}"),
        };
        let percentile = rule.percentile;
        if let Some(why) = self.too_disturbed(arm) {
            return invalid(why);
        }
        match &rule.bound {
            Bound::TimesLower { than, at_least } => {
                let comparable =
                    |m: &&Measurement| m.arm == *than && m.circumstances == arm.circumstances;
                let Some(reference) = measured.iter().find(comparable) else {
                    return invalid(format!(
                        "no arm \"{than}\" under the same conditions; measure both in one run"
                    ));
                };
                if let Some(why) = self.too_disturbed(reference) {
                    return invalid(format!("{than}: {why}"));
                }
                let each = Comparison::each(reference, arm, Pairing::Paired);
                match each.into_iter().find(|(of, _)| of.key == percentile.key) {
                    Some((_, Ok(found))) => {
                        judge_ratio(&label, percentile, than, *at_least, &found)
                    }
                    Some((_, Err(why))) => invalid(format!("{}: {why}", percentile.name)),
                    None => invalid(format!("no {}", percentile.name)),
                }
            }
            Bound::AtMostNs(_) if platform == Platform::VirtualMachine => {
                let says = format!(
                    "{label}: {}: an absolute bound is not judged in a virtual machine; bound a ratio \
                     with times_lower_than",
                    percentile.name
                );
                Judgement { outcome: RuleOutcome::Skipped, says }
            }
            Bound::AtMostNs(bound_ns) => {
                let valid = arm.valid();
                if !supports(valid.count(), percentile.quantile) {
                    let (found, needed) = (valid.count(), needed(percentile.quantile));
                    let why = TooShort::Samples { found, needed };
                    return invalid(format!("{}: {why}", percentile.name));
                }
                let value_ns = arm.metric.in_ns(valid.quantile(percentile.quantile));
                let outcome =
                    if value_ns > *bound_ns { RuleOutcome::Fail } else { RuleOutcome::Pass };
                let says = format!(
                    "{label}: {} is {value_ns} ns; it may be at most {bound_ns} ns",
                    percentile.name
                );
                Judgement { outcome, says }
            }
        }
    }

    fn too_disturbed(&self, arm: &Measurement) -> Option<String> {
        let why = arm.too_disturbed(self.invalid_turns)?;
        Some(format!("{why}, or raise invalid_turns"))
    }
}

/// Only what the whole interval says is said.
fn judge_ratio(
    label: &str,
    percentile: &Percentile,
    than: &str,
    at_least: f64,
    found: &Comparison,
) -> Judgement {
    let Comparison { ratio, low, high, .. } = found;
    let says = format!(
        "{label}: {} is {} (99 % interval {}); {}",
        percentile.name,
        comparison_in_words(*ratio, than),
        interval_in_words(*ratio, *low, *high),
        bound_in_words(at_least)
    );
    if *low >= at_least {
        Judgement { outcome: RuleOutcome::Pass, says }
    } else if *high < at_least {
        Judgement { outcome: RuleOutcome::Fail, says }
    } else {
        let says = says + "; the bound lies within the interval: run it 4 times as long";
        Judgement { outcome: RuleOutcome::Invalid, says }
    }
}

/// A bound below 1 lets the arm be higher.
fn bound_in_words(at_least: f64) -> String {
    if at_least > 1.0 {
        format!("it must be at least {at_least} times lower")
    } else if at_least < 1.0 {
        let most = ratio_in_words(at_least);
        format!("it may be at most {most} (at_least = {at_least})")
    } else {
        "it must not be higher".to_owned()
    }
}

#[cfg(test)]
#[path = "judge_tests.rs"]
mod tests;
