//! A gate: bounds that the result of a bench must keep.

use serde::Deserialize;

use super::compare::{Pairing, TooShort, Verdict, needed, supports};
use super::measured::{Comparison, Measured, PERCENTILES, Percentile};
use super::reported::Reported;
use crate::report::{Report, TaskArm};

/// A gate, as its file has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "WrittenGate")]
pub struct Gate {
    /// The rules; all of them must hold.
    pub rules: Vec<Rule>,
    /// The largest part of an arm's turns, 0 to 1, that may be invalid.
    pub invalid_turns: f64,
}

/// One rule of a gate.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// The arm that must keep it, under all circumstances that were measured.
    pub arm: String,
    /// What of its distribution.
    pub percentile: &'static Percentile,
    /// The bound.
    pub bound: Bound,
}

/// What a rule bounds.
#[derive(Debug, Clone, PartialEq)]
pub enum Bound {
    /// The arm is that many times lower than another of the same run.
    TimesLower {
        /// The other arm.
        than: String,
        /// The least ratio.
        at_least: f64,
    },
    /// An absolute bound, in ns. In a virtual machine it is not judged: there it would say something
    /// of the host.
    AtMostNs(f64),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenGate {
    rule: Vec<WrittenRule>,
    #[serde(default = "a_fifth", alias = "invalid_blocks")]
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
            return Err(RuleError::InvalidTurns { part: gate.invalid_turns.to_string() });
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
        let found = PERCENTILES.iter().find(|percentile| percentile.key == self.percentile);
        let bound = match (self.times_lower_than, self.at_least, self.at_most_ns) {
            (Some(than), Some(at_least), None) => Bound::TimesLower { than, at_least },
            (None, None, Some(at_most_ns)) => Bound::AtMostNs(at_most_ns),
            _ => return Err(RuleError::Bound { number }),
        };
        let (Bound::TimesLower { at_least: value, .. } | Bound::AtMostNs(value)) = bound;
        if !(value.is_finite() && value > 0.0) {
            return Err(RuleError::Value { number });
        }
        if matches!(&bound, Bound::TimesLower { than, .. } if *than == self.arm) {
            return Err(RuleError::Itself { number, arm: self.arm });
        }
        let Some(percentile) = found else {
            return Err(RuleError::Percentile { number, percentile: self.percentile });
        };
        Ok(Rule { arm: self.arm, percentile, bound })
    }
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

/// What became of a rule, for one arm that it is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Judgement {
    /// Whether the rule holds.
    pub outcome: Outcome,
    /// A sentence about it: the arm, the value and the bound, or why it was not judged.
    pub says: String,
}

/// Whose times an absolute bound would judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Platform {
    Metal,
    VirtualMachine,
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
    /// A bound is a number above 0.
    #[error("rule {number}: the bound must be a number greater than 0")]
    Value {
        /// The rule, from 1.
        number: usize,
    },
    /// An arm is as low as itself, so such a rule always fails or always passes.
    #[error(
        "rule {number}: the arm \"{arm}\" is compared with itself; name another in times_lower_than"
    )]
    Itself {
        /// The rule, from 1.
        number: usize,
        /// The arm.
        arm: String,
    },
    /// Invalid turns are a part of all turns.
    #[error("invalid_turns is {part}; it must be from 0 (none may be invalid) to 1 (all may be)")]
    InvalidTurns {
        /// As it was written.
        part: String,
    },
    /// A rule is about arms that the bench measures.
    #[error("rule {number}: there is no arm \"{arm}\"; this bench has: {known}")]
    Arm {
        /// The rule, from 1.
        number: usize,
        /// As it was written.
        arm: String,
        /// The arms that there are.
        known: String,
    },
    /// A rule has one bound.
    #[error("rule {number}: give either times_lower_than and at_least, or at_most_ns")]
    Bound {
        /// The rule, from 1.
        number: usize,
    },
}

impl Gate {
    /// Looks whether every arm that a rule names is one of these, before they are measured.
    ///
    /// # Errors
    /// The first arm that is not.
    pub fn check_arms(&self, arms: &[&str]) -> Result<(), RuleError> {
        for (index, rule) in self.rules.iter().enumerate() {
            let other = match &rule.bound {
                Bound::TimesLower { than, .. } => Some(than),
                Bound::AtMostNs(_) => None,
            };
            let absent = |arm: &&String| !arms.contains(&arm.as_str());
            if let Some(arm) = std::iter::once(&rule.arm).chain(other).find(absent) {
                let (arm, known) = (arm.clone(), arms.join(", "));
                return Err(RuleError::Arm { number: index + 1, arm, known });
            }
        }
        Ok(())
    }

    /// Holds a report against the rules: what became of each.
    pub fn judge(&self, report: &Report) -> Vec<Judgement> {
        let measured = report.measured();
        let platform = if report.environment.hypervisor.is_some() {
            Platform::VirtualMachine
        } else {
            Platform::Metal
        };
        let judge = |rule: &Rule| {
            let arms: Vec<&Measured> = measured.iter().filter(|m| m.arm == rule.arm).collect();
            if arms.is_empty() {
                let known: Vec<&str> = measured.iter().map(|m| m.arm.as_str()).collect();
                let says = format!("no arm \"{}\"; there are: {}", rule.arm, known.join(", "));
                return vec![Judgement { outcome: Outcome::Invalid, says }];
            }
            arms.iter().map(|arm| self.judge_arm(rule, arm, &measured, platform)).collect()
        };
        self.rules.iter().flat_map(judge).collect()
    }

    fn judge_arm(
        &self,
        rule: &Rule,
        arm: &Measured,
        measured: &[Measured],
        platform: Platform,
    ) -> Judgement {
        let label = arm.label();
        let invalid =
            |why: String| Judgement { outcome: Outcome::Invalid, says: format!("{label}: {why}") };
        let percentile = rule.percentile;
        if let Some(why) = self.too_disturbed(arm) {
            return invalid(why);
        }
        match &rule.bound {
            Bound::TimesLower { than, at_least } => {
                let comparable =
                    |m: &&Measured| m.arm == *than && m.circumstances == arm.circumstances;
                let Some(reference) = measured.iter().find(comparable) else {
                    return invalid(format!("no arm \"{than}\" to compare it with"));
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
                    "{label}: {}: an absolute bound is not judged in a virtual machine",
                    percentile.name
                );
                Judgement { outcome: Outcome::Skipped, says }
            }
            Bound::AtMostNs(bound_ns) => {
                let valid = arm.valid();
                if !supports(valid.count(), percentile.quantile) {
                    let (found, needed) = (valid.count(), needed(percentile.quantile));
                    let why = TooShort::Samples { found, needed };
                    return invalid(format!("{}: {why}", percentile.name));
                }
                let value_ns = arm.metric.in_ns(valid.quantile(percentile.quantile));
                let outcome = if value_ns > *bound_ns { Outcome::Fail } else { Outcome::Pass };
                let says =
                    format!("{label}: {} {value_ns} ns, at most {bound_ns} ns", percentile.name);
                Judgement { outcome, says }
            }
        }
    }

    fn too_disturbed(&self, arm: &Measured) -> Option<String> {
        let part = arm.invalid_part();
        (part > self.invalid_turns).then(|| {
            format!("{:.0} % of the turns are invalid; run it on a quieter machine", 100.0 * part)
        })
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
        "{label}: {} {ratio:.2} times lower than {than} ({low:.2} to {high:.2}), at least {at_least}",
        percentile.name
    );
    if *low >= at_least {
        Judgement { outcome: Outcome::Pass, says }
    } else if *high < at_least {
        Judgement { outcome: Outcome::Fail, says }
    } else {
        let says = says + ": the bound lies in the interval; run it 4 times as long";
        Judgement { outcome: Outcome::Invalid, says }
    }
}

/// An arm of the first report that cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotCompared {
    /// The arm and its circumstances.
    pub arm: String,
    /// What is missing.
    pub why: String,
}

/// What two reports say about each other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Compared {
    /// The second against the first, arm by arm.
    pub comparisons: Vec<Comparison>,
    /// Arms of the first that cannot be compared.
    pub left_out: Vec<NotCompared>,
    /// What else differs, so that the arms may not be to blame.
    pub differences: Vec<String>,
}

/// Compares two reports. Arms are matched by name, circumstances and metric.
pub fn compare_reports(first: &Report, second: &Report) -> Compared {
    let mut compared = Compared { differences: differences(first, second), ..Compared::default() };
    let candidates = second.measured();
    for reference in first.measured() {
        let label = reference.label();
        let same = |m: &&Measured| m.label() == label && m.metric == reference.metric;
        let found = candidates.iter().find(same);
        let compared_arm = found
            .ok_or_else(|| "it is not in the second report".to_owned())
            .and_then(|candidate| compare_arm(&reference, candidate));
        match compared_arm {
            Ok(comparisons) => compared.comparisons.extend(comparisons),
            Err(why) => compared.left_out.push(NotCompared { arm: label, why }),
        }
    }
    compared
}

fn compare_arm(reference: &Measured, candidate: &Measured) -> Result<Vec<Comparison>, String> {
    for (which, measured) in [("first", reference), ("second", candidate)] {
        let part = measured.invalid_part();
        if part > a_fifth() {
            return Err(format!("{:.0} % of its turns are invalid in the {which}", 100.0 * part));
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

/// Something that both reports say, and that should be alike.
struct Said {
    what: String,
    first: String,
    second: String,
}

/// What differs beside the arms.
fn differences(first: &Report, second: &Report) -> Vec<String> {
    let (a, b) = (&first.environment, &second.environment);
    let said = |what: &str, first: &str, second: &str| Said {
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
    differing.map(|Said { what, first, second }| format!("{what}: {first} and {second}")).collect()
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
