//! Building the result of a check: severity, finding, source, consequence.

use super::finding::{CheckResult, Severity};

/// A finding that does not have its code yet.
#[derive(Debug)]
pub(super) struct Verdict(CheckResult);

impl Verdict {
    pub(super) fn new(severity: Severity, value: impl Into<String>) -> Self {
        Self(CheckResult {
            code: String::new(),
            severity,
            value: value.into(),
            details: Vec::new(),
            source: String::new(),
            effect: String::new(),
            fix: None,
            inert: false,
            inert_why: None,
        })
    }

    pub(super) fn ok(value: impl Into<String>) -> Self {
        Self::new(Severity::Ok, value)
    }

    pub(super) fn note(value: impl Into<String>) -> Self {
        Self::new(Severity::Note, value)
    }

    pub(super) fn warning(value: impl Into<String>) -> Self {
        Self::new(Severity::Warning, value)
    }

    pub(super) fn problem(value: impl Into<String>) -> Self {
        Self::new(Severity::Problem, value)
    }

    /// Values that could not be read are not guessed, and are no reason to fail.
    pub(super) fn unknown(why: &str) -> Self {
        Self::note(format!("unknown: {why}"))
    }

    pub(super) fn details(self, details: impl IntoIterator<Item = String>) -> Self {
        Self(CheckResult { details: details.into_iter().collect(), ..self.0 })
    }

    pub(super) fn from(self, source: impl Into<String>) -> Self {
        Self(CheckResult { source: source.into(), ..self.0 })
    }

    pub(super) fn effect(self, effect: impl Into<String>) -> Self {
        Self(CheckResult { effect: effect.into(), ..self.0 })
    }

    pub(super) fn fix(self, fix: impl Into<String>) -> Self {
        Self(CheckResult { fix: Some(fix.into()), ..self.0 })
    }

    /// The way out, if there is one.
    pub(super) fn maybe_fix(self, fix: Option<String>) -> Self {
        Self(CheckResult { fix, ..self.0 })
    }

    pub(super) fn inert(self, why: impl Into<String>) -> Self {
        Self(CheckResult { inert: true, inert_why: Some(why.into()), ..self.0 })
    }

    pub(super) fn named(self, code: &str) -> CheckResult {
        CheckResult { code: code.to_owned(), ..self.0 }
    }
}
