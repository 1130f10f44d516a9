//! A CSV file of values over time: a column for each name, a row for each cycle.

use std::path::Path;

use isochrone_blocks::PinType;

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
    /// It is no CSV text, or reading failed.
    #[error("cannot read {path}: {source}")]
    Csv { path: String, source: csv::Error },
    /// Nothing in it.
    #[error("{path} has no rows; the first row names the columns, each further row is one cycle")]
    Empty { path: String },
    /// A column that stands for nothing.
    #[error("{path}:1: column \"{column}\" is none of: {known}")]
    UnknownColumn { path: String, column: String, known: String },
    /// A column that stands twice.
    #[error("{path}:1: column \"{column}\" stands twice")]
    DuplicateColumn { path: String, column: String },
    /// A row with too few or too many values.
    #[error("{path}:{line}: the row has {found} values, but there are {expected} columns")]
    RowLength { path: String, line: u64, found: usize, expected: usize },
    /// Text where a number should be.
    #[error("{path}:{line}: column \"{column}\": \"{text}\" is not a number")]
    NotANumber { path: String, line: u64, column: String, text: String },
}

impl Recording {
    /// Reads a file whose columns are among `known`, in any order; without `known` columns may
    /// have any name and are LREAL.
    pub(crate) fn read(path: &Path, known: Option<&[(&str, PinType)]>) -> Result<Self, RecordingError> {
        let name = || path.display().to_string();
        let file = std::fs::File::open(path)
            .map_err(|source| RecordingError::Io { path: name(), source })?;
        let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(file);
        let refused = |source| RecordingError::Csv { path: name(), source };
        let header = reader.headers().map_err(refused)?.clone();
        let mut columns: Vec<String> = Vec::new();
        let mut types = Vec::new();
        for column in &header {
            if columns.iter().any(|seen| seen == column) {
                return Err(RecordingError::DuplicateColumn { path: name(), column: column.into() });
            }
            types.push(match known {
                None => PinType::Lreal,
                Some(known) => column_type(column, known).ok_or_else(|| {
                    let known = known.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
                    RecordingError::UnknownColumn { path: name(), column: column.into(), known }
                })?,
            });
            columns.push(column.to_owned());
        }
        let mut values = Vec::new();
        for row in reader.records() {
            let row = row.map_err(refused)?;
            let line = row.position().map_or(0, csv::Position::line);
            if row.len() != types.len() {
                let (found, expected) = (row.len(), types.len());
                return Err(RecordingError::RowLength { path: name(), line, found, expected });
            }
            for ((text, value_type), column) in row.iter().zip(&types).zip(&header) {
                values.push(numbers::parse(text, *value_type).ok_or_else(|| {
                    let (column, text) = (column.to_owned(), text.to_owned());
                    RecordingError::NotANumber { path: name(), line, column, text }
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

    /// Whether there is a column of this name.
    pub(crate) fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|known| known == column)
    }

    /// The value of a column in row `row`, or in the last row after the end.
    pub(crate) fn sample(&self, column: &str, row: u64) -> Option<f64> {
        let column = self.columns.iter().position(|known| known == column)?;
        self.row(row).get(column).copied()
    }
}

fn column_type(column: &str, known: &[(&str, PinType)]) -> Option<PinType> {
    known.iter().find(|(name, _)| *name == column).map(|(_, value_type)| *value_type)
}
