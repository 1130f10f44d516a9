//! A CSV file of values over time: a column for each name, a row for each cycle.

use std::path::Path;

use isochrone_blocks::PinType;
use isochrone_engine::escaped;

use crate::numbers;

/// The values of a CSV file.
#[derive(Debug, Default)]
pub(crate) struct Recording {
    columns: Vec<String>,
    /// Row by row.
    values: Vec<f64>,
}

/// Why a CSV file could not be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordingError {
    /// The operating system refused.
    #[error("cannot read {path}: {source}")]
    Io { path: String, source: std::io::Error },
    /// Bytes that are no text.
    #[error("{path}:{line}: this is not UTF-8 text; a CSV file is expected")]
    NotText { path: String, line: usize },
    /// Reading failed.
    #[error("cannot read {path}: {source}")]
    Csv { path: String, source: csv::Error },
    /// Nothing in it.
    #[error("{path} has no rows; the first row names the columns, each further row is one cycle")]
    Empty { path: String },
    /// A column that stands for nothing.
    #[error("{path}:{line}: there is no input \"{column}\"; {known}")]
    UnknownColumn { path: String, line: usize, column: String, known: String },
    /// A column that stands twice.
    #[error("{path}:{line}: there are two columns \"{column}\"; name each column once")]
    DuplicateColumn { path: String, line: usize, column: String },
    /// A row with too few or too many values.
    #[error(
        "{path}:{line}: a row has one value for each column; this one has {found} for {expected}"
    )]
    RowLength { path: String, line: usize, found: usize, expected: usize },
    /// Text where a number should be.
    #[error("{path}:{line}: column \"{column}\": \"{text}\" is {expected}")]
    NotANumber { path: String, line: usize, column: String, text: String, expected: &'static str },
}

impl Recording {
    /// Reads a file whose columns are among `known`, in any order; without `known` columns may
    /// have any name and are LREAL.
    pub(crate) fn read(
        path: &Path,
        known: Option<&[(&str, PinType)]>,
    ) -> Result<Self, RecordingError> {
        let name = || path.display().to_string();
        let bytes =
            std::fs::read(path).map_err(|source| RecordingError::Io { path: name(), source })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
            RecordingError::NotText { path: name(), line }
        })?;
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let refused = |source| RecordingError::Csv { path: name(), source };
        let header = reader.headers().map_err(refused)?.clone();
        let line_of = |row: &csv::StringRecord| line_at(text.as_bytes(), start(&text, row));
        let line = line_of(&header);
        let mut columns: Vec<String> = Vec::new();
        let mut types = Vec::new();
        for column in &header {
            if columns.iter().any(|seen| seen == column) {
                return Err(RecordingError::DuplicateColumn {
                    path: name(),
                    line,
                    column: quoted(column),
                });
            }
            types.push(match known {
                None => PinType::Lreal,
                Some(known) => column_type(column, known).ok_or_else(|| {
                    let known = listed(known);
                    RecordingError::UnknownColumn {
                        path: name(),
                        line,
                        column: quoted(column),
                        known,
                    }
                })?,
            });
            columns.push(column.to_owned());
        }
        let mut values = Vec::new();
        for row in reader.records() {
            let row = row.map_err(refused)?;
            if row.len() != types.len() {
                let (found, expected) = (row.len(), types.len());
                let line = line_of(&row);
                return Err(RecordingError::RowLength { path: name(), line, found, expected });
            }
            for ((text, value_type), column) in row.iter().zip(&types).zip(&header) {
                values.push(numbers::parse(text, *value_type).ok_or_else(|| {
                    let (line, column, text) = (line_of(&row), quoted(column), quoted(text));
                    let expected = match value_type {
                        PinType::Bool => "not true, false, 0 or 1",
                        _ => "not a number",
                    };
                    RecordingError::NotANumber { path: name(), line, column, text, expected }
                })?);
            }
        }
        if values.is_empty() {
            return Err(RecordingError::Empty { path: name() });
        }
        Ok(Self { columns, values })
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.values.len().checked_div(self.columns.len()).unwrap_or(0)
    }

    /// Names of the columns.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The values of row `row`, or of the last row after the end.
    pub(crate) fn row(&self, row: u64) -> &[f64] {
        let row = usize::try_from(row).unwrap_or(usize::MAX).min(self.len().saturating_sub(1));
        self.values.chunks(self.columns.len().max(1)).nth(row).unwrap_or_default()
    }

    /// Index of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|known| known == name)
    }
}

/// Text of a file as messages show it, whatever the file may turn out to be.
fn quoted(text: &str) -> String {
    const SHOWN: usize = 40;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", escaped(&text[..end])),
        None => escaped(text).into_owned(),
    }
}

/// The inputs that a column may stand for.
fn listed(known: &[(&str, PinType)]) -> String {
    const SHOWN: usize = 12;
    if known.is_empty() {
        return "the configuration has none".into();
    }
    let mut names: Vec<&str> = known.iter().take(SHOWN).map(|(name, _)| *name).collect();
    if known.len() > SHOWN {
        names.push("…");
    }
    format!("there is: {}", names.join(", "))
}

/// Where a row begins, in bytes. The reader counts from before the empty lines that it skips.
fn start(text: &str, row: &csv::StringRecord) -> usize {
    let skipped_from = row.position().map_or(0, |position| position.byte() as usize);
    let rest = text.get(skipped_from..).unwrap_or_default();
    text.len() - rest.trim_start_matches(['\u{feff}', '\r', '\n']).len()
}

/// Line, from 1, of a byte.
fn line_at(text: &[u8], byte: usize) -> usize {
    text.iter().take(byte).filter(|byte| **byte == b'\n').count() + 1
}

fn column_type(column: &str, known: &[(&str, PinType)]) -> Option<PinType> {
    known.iter().find(|(name, _)| *name == column).map(|(_, value_type)| *value_type)
}
