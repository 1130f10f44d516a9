//! All that is wrong with a configuration, as people are shown it.

use std::borrow::Cow;
use std::fmt;

use miette::{Diagnostic, LabeledSpan, Severity, SourceCode};

use crate::excerpt::Excerpt;
use crate::printable::escaped;
use crate::{ConfigFinding, Source};

/// Everything that is wrong with one file. Never empty.
///
/// `Display` and `Debug` count them and have a line for each, with its place and its remedy. For
/// excerpts of the file, show its [`Excerpts`] with miette.
#[derive(Clone)]
#[non_exhaustive]
pub struct Findings {
    /// The file.
    pub source: Source,
    /// All findings in the order of the file.
    pub findings: Vec<ConfigFinding>,
}

/// Most findings that are shown with an excerpt: nobody reads more, and a file that is broken all
/// over would fill the terminal for minutes.
pub(crate) const MOST_SHOWN: usize = 20;

impl Findings {
    /// Collects findings on a file.
    pub fn new(source: Source, mut findings: Vec<ConfigFinding>) -> Self {
        findings.sort_by_key(|finding| finding.span.start);
        // A parser that recovers may stumble over one thing again and again.
        findings.dedup_by(|a, b| (&a.span, &a.message) == (&b.span, &b.message));
        Self { source, findings }
    }

    /// How many errors and warnings there are: `level.toml: 2 errors and 1 warning`.
    pub fn summary(&self) -> String {
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
        format!("{}: {}", escaped(&self.source.name), counts.join(" and "))
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.summary())?;
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

isochrone_model::debug_as_display!(Findings);

impl std::error::Error for Findings {}

/// [`Findings`] as miette shows them: each with its part of the file, the first 20 at most.
#[derive(Clone)]
pub struct Excerpts {
    findings: Findings,
    shown: Vec<Shown>,
}

impl Excerpts {
    /// The findings.
    pub fn findings(&self) -> &Findings {
        &self.findings
    }
}

impl From<Findings> for Excerpts {
    fn from(findings: Findings) -> Self {
        let shown = findings.findings.iter().take(MOST_SHOWN).map(|finding| Shown {
            excerpt: Excerpt::new(&findings.source, &finding.span, finding.first.as_ref()),
            finding: finding.clone(),
        });
        Self { shown: shown.collect(), findings }
    }
}

impl fmt::Display for Excerpts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.findings.summary())
    }
}

/// All findings, which `Display` only counts.
impl fmt::Debug for Excerpts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.findings, f)
    }
}

impl std::error::Error for Excerpts {}

impl Diagnostic for Excerpts {
    fn severity(&self) -> Option<Severity> {
        self.findings.findings.iter().map(|finding| finding.problem.severity()).max()
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let shown = self.shown.len();
        let rest = self.findings.findings.len() - shown;
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
    finding: ConfigFinding,
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
