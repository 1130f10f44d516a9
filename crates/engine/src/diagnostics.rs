//! All diagnostics of a configuration, and how they are shown.

use std::borrow::Cow;
use std::fmt;

use miette::{LabeledSpan, Severity, SourceCode};

use crate::excerpt::Excerpt;
use crate::{Diagnostic, Source};
use isochrone_model::escaped;

/// Everything that is wrong with one file. Never empty.
///
/// `Display` and `Debug` count them and have a line for each, with its place and its remedy. For
/// excerpts of the file, show its [`Excerpts`] with miette.
#[derive(Clone)]
#[non_exhaustive]
pub struct Diagnostics {
    /// The file.
    pub source: Source,
    /// All diagnostics in the order of the file.
    pub all: Vec<Diagnostic>,
}

/// Most diagnostics that are shown with an excerpt: nobody reads more, and a file that is broken all
/// over would fill the terminal for minutes.
pub(crate) const MOST_SHOWN: usize = 20;

impl Diagnostics {
    /// Collects the diagnostics of a file.
    pub fn new(source: Source, mut all: Vec<Diagnostic>) -> Self {
        all.sort_by_key(|diagnostic| diagnostic.span.start);
        // A parser that recovers may stumble over one thing again and again.
        all.dedup_by(|a, b| (&a.span, &a.message) == (&b.span, &b.message));
        Self { source, all }
    }

    /// How many errors and warnings there are: `level.toml: 2 errors and 1 warning`.
    pub fn summary(&self) -> String {
        let warnings = self.all.iter().filter(|diagnostic| diagnostic.is_warning()).count();
        let count = |n: usize, what: &str| match n {
            0 => None,
            1 => Some(format!("1 {what}")),
            n => Some(format!("{n} {what}s")),
        };
        let counts: Vec<String> =
            [count(self.all.len() - warnings, "error"), count(warnings, "warning")]
                .into_iter()
                .flatten()
                .collect();
        format!("{}: {}", escaped(&self.source.name), counts.join(" and "))
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.summary())?;
        let starts = self.all.iter().map(|diagnostic| diagnostic.span.start);
        let places = self.source.positions(starts);
        for (diagnostic, (line, column)) in self.all.iter().zip(places) {
            write!(f, "\n{}:{line}:{column}: {diagnostic}", escaped(&self.source.name))?;
            if let Some(help) = &diagnostic.help {
                write!(f, " ({help})")?;
            }
        }
        Ok(())
    }
}

isochrone_model::debug_as_display!(Diagnostics);

impl std::error::Error for Diagnostics {}

/// [`Diagnostics`] as miette shows them: each with its part of the file, the first 20 at most.
#[derive(Clone)]
pub struct Excerpts {
    diagnostics: Diagnostics,
    shown: Vec<ShownDiagnostic>,
}

impl Excerpts {
    /// The diagnostics.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }
}

impl From<Diagnostics> for Excerpts {
    fn from(diagnostics: Diagnostics) -> Self {
        let shown = diagnostics.all.iter().take(MOST_SHOWN).map(|diagnostic| ShownDiagnostic {
            excerpt: Excerpt::new(&diagnostics.source, &diagnostic.span, diagnostic.first.as_ref()),
            diagnostic: diagnostic.clone(),
        });
        Self { shown: shown.collect(), diagnostics }
    }
}

impl fmt::Display for Excerpts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.diagnostics.summary())
    }
}

/// All diagnostics, which `Display` only counts.
impl fmt::Debug for Excerpts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.diagnostics, f)
    }
}

impl std::error::Error for Excerpts {}

impl miette::Diagnostic for Excerpts {
    fn severity(&self) -> Option<Severity> {
        self.diagnostics.all.iter().map(|diagnostic| diagnostic.problem.severity()).max()
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let shown = self.shown.len();
        let rest = self.diagnostics.all.len() - shown;
        (rest > 0).then(|| {
            let help = format!(
                "the first {shown} are shown, and {rest} more are not; `check --json` lists all"
            );
            Box::new(help) as Box<dyn fmt::Display>
        })
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn miette::Diagnostic> + 'a>> {
        Some(Box::new(self.shown.iter().map(|shown| shown as &dyn miette::Diagnostic)))
    }
}

/// A diagnostic and the part of the file that it is about.
#[derive(Clone, Debug)]
struct ShownDiagnostic {
    diagnostic: Diagnostic,
    excerpt: Excerpt,
}

impl fmt::Display for ShownDiagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shortened(&self.diagnostic.message))
    }
}

impl std::error::Error for ShownDiagnostic {}

impl miette::Diagnostic for ShownDiagnostic {
    fn severity(&self) -> Option<Severity> {
        Some(self.diagnostic.problem.severity())
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let help = self.diagnostic.help.as_ref();
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
