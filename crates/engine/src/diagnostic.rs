//! A diagnostic of a configuration: what is wrong, where, and what would be right.

use std::fmt;
use std::ops::Range;

use miette::Severity;

use crate::nearest::KnownNames;
use isochrone_model::escaped;

/// Kind of a diagnostic, for programs; its message is for people.
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
    /// An expression, or a condition, that cannot be read, or whose types do not fit.
    BadExpression,
    /// Keys of one section that exclude each other.
    Conflict,
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
    /// A task that keeps the task that it follows from sending (a warning).
    StarvedSource,
    /// A task that follows its own output (a warning).
    FollowsItself,
    /// A wire to a pin that is read at certain times only (a note).
    Latched,
    /// An input that is never stale (a note).
    NoMaxAge,
    /// An input that is read from no service, so that `run` needs a program that feeds it (a note).
    NoService,
    /// Constants lead a block to where people should know of it, though it reports no error (a note).
    Caution,
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
            Self::BadExpression => "bad_expression",
            Self::Conflict => "conflict",
            Self::UnknownTask => "unknown_task",
            Self::UnknownBlockType => "unknown_block_type",
            Self::UnknownPin => "unknown_pin",
            Self::UnknownSource => "unknown_source",
            Self::MissingPin => "missing_pin",
            Self::TypeMismatch => "type_mismatch",
            Self::Loop => "loop",
            Self::ConstantError => "constant_error",
            Self::NoEffect => "no_effect",
            Self::StarvedSource => "starved_source",
            Self::FollowsItself => "follows_itself",
            Self::Latched => "latched",
            Self::NoMaxAge => "no_max_age",
            Self::NoService => "no_service",
            Self::Caution => "caution",
        }
    }

    pub(crate) fn severity(self) -> Severity {
        match self {
            Self::Latched | Self::NoMaxAge | Self::NoService | Self::Caution => Severity::Advice,
            Self::ConstantError | Self::NoEffect | Self::StarvedSource | Self::FollowsItself => {
                Severity::Warning
            }
            _ => Severity::Error,
        }
    }
}

/// One error, warning or note about a configuration, with its place in the text in bytes.
///
/// A node that refuses a configuration answers with an `isochrone_model::Finding` for each: that is what requests and
/// answers carry, about signals and parameters too, with line and column instead of a kind.
#[derive(Clone)]
pub struct Diagnostic {
    /// Its kind.
    pub problem: Problem,
    /// What is wrong, in a sentence that names the thing. Control characters are escaped.
    pub message: String,
    /// The place in the file, in bytes.
    pub span: Range<usize>,
    /// A related place, in bytes: where a name is used for the first time.
    pub first: Option<Range<usize>>,
    /// What would be right.
    pub help: Option<String>,
    /// A name that does not exist, until the help suggests one.
    pub(crate) sought: Option<Box<(String, Among)>>,
}

/// Names of a file, of which there may be very many. Those of variables are among those of inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Among {
    Tasks,
    Inputs,
    Blocks,
    TasksAndInputs,
    InputsAndBlocks,
}

impl Diagnostic {
    /// A diagnostic without help.
    pub fn new(problem: Problem, span: Range<usize>, message: impl Into<String>) -> Self {
        Self {
            problem,
            message: escaped(&message.into()).into_owned(),
            span,
            first: None,
            help: None,
            sought: None,
        }
    }

    /// Says what would be right.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(escaped(&help.into()).into_owned());
        self
    }

    /// Suggests the name nearest to the written one, or else lists those that exist.
    pub(crate) fn did_you_mean<'a>(
        self,
        written: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        self.help(KnownNames::new(known).suggestion(written))
    }

    /// Leaves the suggestion of a name to the end, when all diagnostics and all names are known.
    pub(crate) fn seek(mut self, written: &str, among: Among) -> Self {
        self.sought = Some(Box::new((written.into(), among)));
        self
    }

    /// Whether it is only a warning.
    pub fn is_warning(&self) -> bool {
        self.problem.severity() == Severity::Warning
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Diagnostic {}

/// The message and what would be right, as [`Diagnostics`](crate::Diagnostics) show it.
impl fmt::Debug for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.help {
            Some(help) => write!(f, "{self} ({help})"),
            None => write!(f, "{self}"),
        }
    }
}
