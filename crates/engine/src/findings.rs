//! All that is wrong with a configuration, as people are shown it.

use std::borrow::Cow;
use std::fmt;

use miette::{Diagnostic, LabeledSpan, Severity, SourceCode};

use crate::excerpt::Excerpt;
use crate::printable::escaped;
use crate::{Finding, Source};

/// Everything that is wrong with one file. Never empty.
///
/// `Display` counts them; `Debug`, which a `main` that returns them prints, has a line for each.
/// For excerpts of the file, show them with miette.
#[derive(Clone)]
pub struct Findings {
    /// The file.
    pub source: Source,
    /// All findings in the order of the file.
    pub findings: Vec<Finding>,
    shown: Vec<Shown>,
}

/// Most findings that are shown with an excerpt: nobody reads more, and a file that is broken all
/// over would fill the terminal for minutes.
pub(crate) const MOST_SHOWN: usize = 20;

impl Findings {
    /// Collects findings on a file.
    pub fn new(source: Source, mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| finding.span.start);
        // A parser that recovers may stumble over one thing again and again.
        findings.dedup_by(|a, b| (&a.span, &a.message) == (&b.span, &b.message));
        let shown = findings.iter().take(MOST_SHOWN).map(|finding| Shown {
            excerpt: Excerpt::new(&source, &finding.span, finding.first.as_ref()),
            finding: finding.clone(),
        });
        Self { shown: shown.collect(), source, findings }
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let warnings = self.findings.iter().filter(|finding| finding.is_warning()).count();
        let count = |n: usize, what: &str| match n {
            0 => None,
            1 => Some(format!("1 {what}")),
            n => Some(format!("{n} {what}s")),
        };
        let counts: Vec<String> =
            [count(self.findings.len() - warnings, "error"), count(warnings, "warning")]
                .into_iter()
                .flatten()
                .collect();
        write!(f, "{}: {}", escaped(&self.source.name), counts.join(" and "))
    }
}

impl fmt::Debug for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")?;
        let starts = self.findings.iter().map(|finding| finding.span.start);
        let places = self.source.positions(starts);
        for (finding, (line, column)) in self.findings.iter().zip(places) {
            write!(f, "\n{}:{line}:{column}: {finding}", escaped(&self.source.name))?;
            if let Some(help) = &finding.help {
                write!(f, " ({help})")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Findings {}

impl Diagnostic for Findings {
    fn severity(&self) -> Option<Severity> {
        self.findings.iter().map(|finding| finding.problem.severity()).max()
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let shown = self.shown.len();
        let rest = self.findings.len() - shown;
        (rest > 0).then(|| {
            let help = format!(
                "the first {shown} are shown, and {rest} more are not; `check --json` lists all"
            );
            Box::new(help) as Box<dyn fmt::Display>
        })
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        Some(Box::new(self.shown.iter().map(|shown| shown as &dyn Diagnostic)))
    }
}

/// A finding and the part of the file that it is about.
#[derive(Clone, Debug)]
struct Shown {
    finding: Finding,
    excerpt: Excerpt,
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shortened(&self.finding.message))
    }
}

impl std::error::Error for Shown {}

impl Diagnostic for Shown {
    fn severity(&self) -> Option<Severity> {
        Some(self.finding.problem.severity())
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let help = self.finding.help.as_ref();
        help.map(|help| Box::new(shortened(help)) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.excerpt)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.excerpt.labels("the first")))
    }
}

/// A sentence that may quote the file, whatever stands there: of a long one its beginning and its end.
fn shortened(text: &str) -> Cow<'_, str> {
    const KEPT: usize = 300;
    let beginning = text.char_indices().nth(KEPT).map(|(byte, _)| byte);
    let end = text.char_indices().rev().nth(KEPT).map(|(byte, _)| byte);
    match (beginning, end) {
        (Some(beginning), Some(end)) if beginning < end => {
            format!("{} … {}", &text[..beginning], &text[end..]).into()
        }
        _ => text.into(),
    }
}
