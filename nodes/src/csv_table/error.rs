//! Why a CSV file could not be used.

use isochrone_blocks::PinType;
use isochrone_engine::escaped;

use crate::numbers::{self, NumberError};
use crate::suggestion;

/// Largest file: hours of many signals, and an end to what has none.
pub(super) const MAX_BYTES: u64 = 1 << 30;

/// Why a CSV file could not be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CsvError {
    /// The operating system refused.
    #[error("cannot read {path}: {source}")]
    Io { path: String, source: std::io::Error },
    /// It has no end, or as good as none.
    #[error("{path} is larger than {} MiB; publish or simulate it in parts", MAX_BYTES >> 20)]
    TooLarge { path: String },
    /// Bytes that are not text.
    #[error("{path}:{line}: this is not text (UTF-8); a CSV file is expected")]
    NotText { path: String, line: usize },
    /// Reading failed.
    #[error("cannot read {path}: {source}")]
    Csv { path: String, source: csv::Error },
    /// Nothing in it.
    #[error("{path} has no rows; the first row names the columns, each further row is one cycle")]
    Empty { path: String },
    /// Values where the names should be: the first row would be lost.
    #[error(
        "{path}:{line}: the first row names the columns, and this one has numbers only; put a row of names before it, such as {example}"
    )]
    NoHeader { path: String, line: usize, example: String },
    /// The names of the columns once more: the writer changed its layout while it was recorded.
    #[error(
        "{path}:{line}: another header: what was recorded has changed here; make a file of each part"
    )]
    SecondHeader { path: String, line: usize },
    /// Columns of times only.
    #[error("{path}:{line}: there is no column of values beside {found}")]
    NoValues { path: String, line: usize, found: String },
    /// A column of an unknown name.
    #[error("{path}:{line}: there is no input \"{column}\"; {known}")]
    UnknownColumn { path: String, line: usize, column: String, known: String },
    /// A column that was asked for and is not there.
    #[error("{path} has no column \"{column}\"; {known}")]
    NoColumn { path: String, column: String, known: String },
    /// Columns that are separated by something else.
    #[error("{path}:{line}: \"{header}\": columns are separated by commas, not by semicolons")]
    Semicolons { path: String, line: usize, header: String },
    /// More columns than a frame has values.
    #[error(
        "{path}:{line}: there are {found} columns; a frame has at most 65536 values; make several files of it"
    )]
    TooManyColumns { path: String, line: usize, found: usize },
    /// A column without a name.
    #[error(
        "{path}:{line}: column {number} has no name; name every column, or remove the comma that is too many"
    )]
    NoName { path: String, line: usize, number: usize },
    /// A column that stands twice.
    #[error(
        "{path}:{line}: there are two columns \"{column}\", and here they differ; rename one of them"
    )]
    DuplicateColumn { path: String, line: usize, column: String },
    /// A row with too few or too many values.
    #[error(
        "{path}:{line}: a row has one value for each column; this one has {found} for {expected}"
    )]
    RowLength { path: String, line: usize, found: usize, expected: usize },
    /// Text where a number should be.
    #[error("{path}:{line}: column \"{column}\": \"{text}\" is {expected}")]
    NotANumber { path: String, line: usize, column: String, text: String, expected: &'static str },
    /// A cycle before that of the row before, or none that a row can have.
    #[error(
        "{path}:{line}: column \"cycle\": \"{text}\" is no cycle, or one before that of the row before; with --journal it says which cycle of a run a row is for"
    )]
    Cycle { path: String, line: usize, text: String },
    /// A time before that of the row before, or none that a row can have.
    #[error(
        "{path}:{line}: column \"time_s\": \"{text}\" is no time after that of the row before; times are seconds, and never go back (--rate publishes without them)"
    )]
    Time { path: String, line: usize, text: String },
}

/// The expected contents of a cell.
pub(super) fn expected(
    error: NumberError,
    text: &str,
    value_type: Option<PinType>,
) -> &'static str {
    match (error, value_type) {
        (NumberError::Text, None | Some(PinType::Time)) if numbers::is_like_time(text) => {
            "not a number; a TIME is a number of milliseconds, such as 200"
        }
        (NumberError::TooLarge, _) => "beyond what a value can be, which is 1.8e308 at most",
        (NumberError::Text, Some(PinType::Bool)) => "not true, false, 0 or 1",
        _ => "not a number",
    }
}

/// Text of a file as messages show it, whatever the file may turn out to be.
pub(super) fn quoted(text: &str) -> String {
    const SHOWN: usize = 40;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", escaped(&text[..end])),
        None => escaped(text).into_owned(),
    }
}

/// The possible columns, and a suggestion.
pub(super) fn known<'a>(
    written: &str,
    known: impl ExactSizeIterator<Item = &'a str> + Clone,
) -> String {
    const SHOWN: usize = 12;
    let is_cut = known.len() > SHOWN;
    if known.len() == 0 {
        return "the configuration has none".into();
    }
    let question = escaped(&suggestion::question(written, known.clone())).into_owned();
    let mut names: Vec<String> = known.take(SHOWN).map(quoted).collect();
    if is_cut {
        names.push("…".into());
    }
    format!("there is: {}{question}", names.join(", "))
}
