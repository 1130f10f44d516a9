//! What is wrong with a configuration, where, and what would be right.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, Severity, SourceCode};

/// Kind of a finding, for programs; people read the message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Problem {
    /// The file is not TOML.
    Syntax,
    /// A key that this section does not have.
    UnknownKey,
    /// A key or section that must be there is not.
    MissingKey,
    /// A value of another type than the key takes.
    WrongType,
    /// A value of the right type that the key does not take.
    OutOfRange,
    /// A name that the rules for names, or iceoryx2, do not allow.
    BadName,
    /// A name, OB number or service that is taken already.
    Duplicate,
    /// A task that is not configured.
    UnknownTask,
    /// A block type that the catalogue does not have.
    UnknownBlockType,
    /// A pin that the block type does not have.
    UnknownPin,
    /// A wire from something that does not exist.
    UnknownSource,
    /// A pin without a default that nothing is connected to.
    MissingPin,
    /// A wire or constant of another type than the pin's.
    TypeMismatch,
    /// Blocks that wait for each other's outputs.
    Loop,
    /// A constant makes a block report an error from its first call (a warning).
    ConstantError,
    /// Something that has no effect (a warning).
    NoEffect,
}

impl Problem {
    /// Stable name, as JSON shows it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Syntax => "syntax",
            Self::UnknownKey => "unknown_key",
            Self::MissingKey => "missing_key",
            Self::WrongType => "wrong_type",
            Self::OutOfRange => "out_of_range",
            Self::BadName => "bad_name",
            Self::Duplicate => "duplicate",
            Self::UnknownTask => "unknown_task",
            Self::UnknownBlockType => "unknown_block_type",
            Self::UnknownPin => "unknown_pin",
            Self::UnknownSource => "unknown_source",
            Self::MissingPin => "missing_pin",
            Self::TypeMismatch => "type_mismatch",
            Self::Loop => "loop",
            Self::ConstantError => "constant_error",
            Self::NoEffect => "no_effect",
        }
    }

    fn severity(self) -> Severity {
        match self {
            Self::ConstantError | Self::NoEffect => Severity::Warning,
            _ => Severity::Error,
        }
    }
}

/// One thing that is wrong.
#[derive(Clone, Debug)]
pub struct Finding {
    /// What kind it is of.
    pub problem: Problem,
    /// What is wrong, in a sentence that names the thing.
    pub message: String,
    /// Where in the file, in bytes.
    pub span: Range<usize>,
    /// Another place that has to do with it, in bytes: where a name stands for the first time.
    pub first: Option<Range<usize>>,
    /// What would be right.
    pub help: Option<String>,
}

impl Finding {
    /// A finding without help.
    pub fn new(problem: Problem, span: Range<usize>, message: impl Into<String>) -> Self {
        Self { problem, message: message.into(), span, first: None, help: None }
    }

    /// Says what would be right.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Proposes the name nearest to what was written, or else lists those that exist.
    pub(crate) fn did_you_mean<'a>(
        self,
        written: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        const NEAR: f64 = 0.75;
        const LISTED: usize = 12;
        let known: Vec<&str> = known.into_iter().collect();
        let nearest = known
            .iter()
            .map(|name| (nearness(&written.to_lowercase(), &name.to_lowercase()), name))
            .filter(|(nearness, _)| *nearness > NEAR)
            .max_by(|(a, _), (b, _)| a.total_cmp(b));
        match nearest {
            Some((_, name)) => self.help(format!("did you mean \"{name}\"?")),
            None if known.is_empty() => self.help("there is none"),
            None if known.len() > LISTED => {
                let first = known.get(..LISTED).unwrap_or_default().join(", ");
                self.help(format!("there are {}: {first}, …", known.len()))
            }
            None => self.help(format!("there is: {}", known.join(", "))),
        }
    }

    /// Whether it is only a warning.
    pub fn is_warning(&self) -> bool {
        self.problem.severity() == Severity::Warning
    }
}

/// How alike two names are, from 0 to 1. Jaro-Winkler finds long names that begin alike, and the
/// edit distance short ones with a slip.
fn nearness(a: &str, b: &str) -> f64 {
    strsim::jaro_winkler(a, b).max(strsim::normalized_damerau_levenshtein(a, b) + 0.1)
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Finding {}

impl Diagnostic for Finding {
    fn severity(&self) -> Option<Severity> {
        Some(self.problem.severity())
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let first = self.first.clone();
        let first = first.map(|span| LabeledSpan::new_with_span(Some("the first".into()), span));
        let here = LabeledSpan::new_primary_with_span(None, self.span.clone());
        Some(Box::new(std::iter::once(here).chain(first)))
    }
}

/// The text of a configuration and the name to show for it.
#[derive(Clone, Debug)]
pub struct Source {
    /// Path of the file, or what stands in its place.
    pub name: String,
    /// Content.
    pub text: Arc<str>,
}

impl Source {
    /// A configuration that is in memory.
    pub fn new(name: impl Into<String>, text: impl Into<Arc<str>>) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// Line and column, both from 1, of a byte offset; columns count characters.
    pub fn position(&self, offset: usize) -> (usize, usize) {
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let column = before.get(line_start..).unwrap_or_default().chars().count() + 1;
        (before.matches('\n').count() + 1, column)
    }
}

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
    code: Box<NamedSource<Arc<str>>>,
}

impl Findings {
    /// Collects findings on a file.
    pub fn new(source: Source, mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| finding.span.start);
        let code = NamedSource::new(&source.name, source.text.clone()).with_language("toml");
        Self { source, findings, code: Box::new(code) }
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
        write!(f, "{}: {}", self.source.name, counts.join(" and "))
    }
}

impl fmt::Debug for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")?;
        for finding in &self.findings {
            let (line, column) = self.source.position(finding.span.start);
            write!(f, "\n{}:{line}:{column}: {finding}", self.source.name)?;
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

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&*self.code)
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        Some(Box::new(self.findings.iter().map(|finding| finding as &dyn Diagnostic)))
    }
}
