//! All that is wrong with a request.

use std::fmt;

use super::{Refusal, RefusalKind};

/// Everything that is wrong with a request. Nothing has happened. Never empty.
#[derive(Clone, PartialEq)]
pub struct Refusals {
    findings: Vec<Refusal>,
}

impl Refusals {
    /// `Err` if there are findings.
    pub(crate) fn check(findings: Vec<Refusal>) -> Result<(), Self> {
        if findings.is_empty() { Ok(()) } else { Err(Self { findings }) }
    }

    /// All findings, in the order of the request.
    pub fn findings(&self) -> &[Refusal] {
        &self.findings
    }

    /// The kind of the first finding.
    pub fn kind(&self) -> RefusalKind {
        self.findings.first().map_or(RefusalKind::WrongValue, Refusal::kind)
    }
}

impl From<Refusal> for Refusals {
    fn from(refusal: Refusal) -> Self {
        Self { findings: vec![refusal] }
    }
}

impl fmt::Display for Refusals {
    /// One sentence for each of the first 20 findings.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 20;
        for (index, finding) in self.findings.iter().take(SHOWN).enumerate() {
            let separator = if index == 0 { "" } else { "; " };
            write!(f, "{separator}{finding} ({})", finding.help())?;
        }
        match self.findings.len().checked_sub(SHOWN) {
            Some(more @ 1..) => write!(f, "; and {more} more"),
            _ => Ok(()),
        }
    }
}

impl std::error::Error for Refusals {}

isochrone_quality::debug_as_display!(Refusals);
