//! The expressions of an `Expr` as written.

use std::ops::Range;

use isochrone_blocks::expr::{Expression, Mistake};
use toml::Spanned;

use crate::Diagnostic;
use crate::diagnostic::Problem;

/// An output of an `Expr`, or the condition of an alarm. What is `None` could not be read.
#[derive(Debug)]
pub struct Formula {
    /// The output, or the key `when`.
    pub name: Spanned<String>,
    /// What computes it.
    pub text: Option<Text>,
    /// That text, read.
    pub expression: Option<Expression>,
    /// The signals that it names, each once, in the order in which they first stand there. The places are in the file.
    pub names: Vec<Spanned<String>>,
}

/// The text of an expression, with its places in the file.
#[derive(Debug)]
pub struct Text {
    pub(crate) text: Spanned<String>,
    /// The section that it stands in, for messages.
    pub(crate) section: &'static str,
    /// The place in the file of each byte, and of what stands behind the text.
    pub(crate) places: Vec<usize>,
}

impl Text {
    /// The text.
    pub fn as_str(&self) -> &str {
        self.text.get_ref()
    }

    /// The place in the file of a part of the text.
    pub(crate) fn place(&self, part: &Range<usize>) -> Range<usize> {
        let place = |at: usize| self.places.get(at).copied();
        let span = self.text.span();
        place(part.start).unwrap_or(span.start)..place(part.end).unwrap_or(span.end)
    }

    /// The diagnostic of a mistake in it, behind the key of this name.
    pub(crate) fn diagnostic(&self, key: &str, mistake: Mistake) -> Diagnostic {
        let message = format!("{} {key}: {}", self.section, mistake.message);
        let place = self.place(&mistake.span);
        let diagnostic = Diagnostic::new(Problem::BadExpression, place, message);
        match mistake.help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    }
}
