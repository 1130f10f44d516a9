//! Reading a CSV file.

use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::path::Path;

use isochrone_blocks::PinType;

use super::error::{CsvError, MAX_BYTES, expected, known, quoted};
use super::values::CsvTable;
use crate::base::columns::{CYCLE, MISSED, TIME, name_and_unit};
use crate::base::files::open_input;
use crate::base::numbers;

/// Most columns: as many values as a frame has at most, and two of times.
pub(super) const MAX_COLUMNS: usize = 65_536 + 2;

/// The column that the export of a task of a recorded node has, whatever the task.
const ENTRIES: &str = "journal.entries";

/// The meaning of a column.
enum Column {
    /// Times in seconds.
    Time,
    /// The cycles that the rows are for.
    Cycle,
    /// How many cycles were missed before the row.
    Missed,
    /// Nothing that is a value.
    Ignored,
    /// Values of this type, or of any.
    Values(Option<PinType>),
    /// The same as in the column of this place, which has its name: outputs may share a signal.
    Again(usize),
}

impl CsvTable {
    /// Reads a file whose columns may have any name.
    pub(crate) fn read(path: &Path) -> Result<Self, CsvError> {
        read(path, None, RowsAre::Numbered)
    }

    /// The same, with the cycle of each row where the file says it.
    pub(crate) fn with_cycles(path: &Path) -> Result<Self, CsvError> {
        read(path, None, RowsAre::OfCycles)
    }

    /// Reads a file whose columns are among `inputs`, in any order.
    pub(crate) fn of_inputs(path: &Path, inputs: &[(&str, PinType)]) -> Result<Self, CsvError> {
        read(path, Some(inputs), RowsAre::Numbered)
    }
}

/// Which cycle a row is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RowsAre {
    /// Row k is for cycle k.
    Numbered,
    /// The cycle that the column `cycle` says, if there is one.
    OfCycles,
}

fn read(
    path: &Path,
    inputs: Option<&[(&str, PinType)]>,
    rows: RowsAre,
) -> Result<CsvTable, CsvError> {
    let name = || path.display().to_string();
    let text = text_of(path)?;
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(text.as_bytes());
    let refused = |source| CsvError::Csv { path: name(), source };
    let header = reader.headers().map_err(refused)?.clone();
    // The export of a task says of each row which cycle it is of.
    let is_of_task = inputs.is_some() && header.iter().any(|column| column == ENTRIES);
    let rows = if is_of_task { RowsAre::OfCycles } else { rows };
    let line_of = |row: &csv::StringRecord| line_at(text.as_bytes(), start(&text, row));
    let named = named(&header);
    let bare: csv::StringRecord = named.iter().map(|(name, _)| name).collect();
    let what = TablePurpose { inputs, rows, is_of_task };
    let columns = columns(&bare, &what, &name(), line_of(&header))?;
    let of_values = |column: &Column| matches!(column, Column::Values(_));
    let values = named.iter().zip(&columns).filter(|(_, column)| of_values(column));
    let (names, units): (Vec<_>, Vec<_>) = values
        .map(|((column, unit), _)| {
            (of_input(column, is_of_task).unwrap_or(column).to_owned(), (*unit).to_owned())
        })
        .unzip();
    let mut table = CsvTable::new(name(), names, units.into());
    let mut first_s = None;
    for row in reader.records() {
        let row = row.map_err(refused)?;
        let mut cells = row.iter().zip(&header).zip(&columns);
        let is_header =
            row == header || cells.any(|((cell, name), column)| !of_values(column) && cell == name);
        if is_header {
            return Err(CsvError::SecondHeader { path: name(), line: line_of(&row) });
        }
        if row.len() != columns.len() {
            let (found, expected) = (row.len(), columns.len());
            let line = line_of(&row);
            return Err(CsvError::RowLength { path: name(), line, found, expected });
        }
        for ((cell, column), header) in row.iter().zip(&columns).zip(&header) {
            match column {
                Column::Ignored => {}
                Column::Missed => {
                    let missed = numbers::parse_number(cell).unwrap_or_default();
                    table.missed.push(missed as u64);
                }
                Column::Again(first) if row.get(*first) == Some(cell) => {}
                Column::Again(_) => {
                    let (line, column) = (line_of(&row), quoted(header));
                    return Err(CsvError::DuplicateColumn { path: name(), line, column });
                }
                Column::Cycle => {
                    let before = table.cycles.last();
                    let cycle =
                        cell.parse().ok().filter(|cycle| before.is_none_or(|it| it <= cycle));
                    table.cycles.push(cycle.ok_or_else(|| CsvError::Cycle {
                        path: name(),
                        line: line_of(&row),
                        text: quoted(cell),
                    })?);
                }
                Column::Time => {
                    let before_ns = table.times_ns.last().copied().unwrap_or_default();
                    let after_ns = after_ns(cell, &mut first_s, before_ns);
                    table.times_ns.push(after_ns.ok_or_else(|| CsvError::Time {
                        path: name(),
                        line: line_of(&row),
                        text: quoted(cell),
                    })?);
                }
                Column::Values(value_type) => {
                    // In a column of any type, true and false are values, too.
                    let read = numbers::parse(cell, value_type.unwrap_or(PinType::Bool));
                    table.values.push(read.map_err(|error| CsvError::NotANumber {
                        path: name(),
                        line: line_of(&row),
                        column: quoted(header),
                        text: quoted(cell),
                        expected: expected(error, cell, *value_type),
                    })?);
                }
            }
        }
        table.rows += 1;
    }
    table.begin_s = first_s.unwrap_or_default();
    if table.rows == 0 {
        return Err(CsvError::Empty { path: name() });
    }
    Ok(table)
}

/// The names and units of the columns. What would give two columns one name is part of the name, and no unit.
fn named(header: &csv::StringRecord) -> Vec<(&str, &str)> {
    let mut columns: HashMap<&str, &str> = HashMap::new();
    let mut shared = HashSet::new();
    for column in header {
        let name = name_and_unit(column).0;
        if columns.insert(name, column).is_some_and(|other| other != column) {
            shared.insert(name);
        }
    }
    let parts = |column| match name_and_unit(column) {
        (name, _) if shared.contains(name) => (column, ""),
        parts => parts,
    };
    header.iter().map(parts).collect()
}

/// The purpose that a table is read for.
struct TablePurpose<'a> {
    /// The inputs that it may have columns of; `None`: any values.
    inputs: Option<&'a [(&'a str, PinType)]>,
    rows: RowsAre,
    /// It is an export of a node's recording, with more columns than those of inputs.
    is_of_task: bool,
}

/// The input that a column of such an export is of.
fn of_input(column: &str, is_of_task: bool) -> Option<&str> {
    column.strip_prefix("in.").filter(|_| is_of_task)
}

/// The meanings of the columns; refuses unknown ones.
fn columns(
    header: &csv::StringRecord,
    &TablePurpose { inputs, rows, is_of_task }: &TablePurpose<'_>,
    path: &str,
    line: usize,
) -> Result<Vec<Column>, CsvError> {
    let path = || path.to_owned();
    if let Some(column) = header.get(0).filter(|it| header.len() == 1 && it.contains(';')) {
        let header = quoted(column);
        return Err(CsvError::Semicolons { path: path(), line, header });
    }
    if header.len() > MAX_COLUMNS {
        let found = header.len();
        return Err(CsvError::TooManyColumns { path: path(), line, found });
    }
    let is_number = |cell: &str| numbers::parse(cell, PinType::Bool).is_ok();
    if inputs.is_none() && !header.is_empty() && header.iter().all(is_number) {
        let names = (0..header.len().min(3)).map(|index| format!("signal{index}"));
        let example = names.collect::<Vec<_>>().join(",");
        return Err(CsvError::NoHeader { path: path(), line, example });
    }
    let types: HashMap<&str, PinType> = inputs.unwrap_or_default().iter().copied().collect();
    let mut columns = Vec::new();
    let mut seen = HashMap::new();
    for (index, column) in header.iter().enumerate() {
        if column.is_empty() {
            let number = index + 1;
            return Err(CsvError::NoName { path: path(), line, number });
        }
        if let Some(first) = seen.get(column) {
            columns.push(Column::Again(*first));
            continue;
        }
        seen.insert(column, index);
        let input = of_input(column, is_of_task);
        let value_type = match input {
            None if is_of_task => None,
            input => types.get(input.unwrap_or(column)),
        };
        columns.push(match (column, inputs, value_type) {
            (_, _, Some(value_type)) => Column::Values(Some(*value_type)),
            (TIME, None, _) => Column::Time,
            (CYCLE, ..) if rows == RowsAre::OfCycles => Column::Cycle,
            (MISSED, None, _) if rows == RowsAre::OfCycles => Column::Missed,
            // An export's, whose rows have their cycles.
            (MISSED, None, _) if header.iter().any(|column| column == CYCLE) => Column::Ignored,
            // An input has its row at each cycle, whenever that was recorded.
            (TIME | CYCLE, _, _) | (MISSED, Some(_), _) => Column::Ignored,
            // Values that the task computed, and values that it read from other tasks.
            _ if is_of_task && input.is_none() => Column::Ignored,
            (_, None, _) => Column::Values(None),
            (_, Some(inputs), None) => {
                // `ok` and `age` of inputs may have columns, too; the inputs themselves are sufficient.
                let names = inputs.iter().map(|(name, _)| *name);
                let names: Vec<&str> = names.filter(|name| !name.contains('.')).collect();
                let known = known(input.unwrap_or(column), names.iter().copied());
                let column = quoted(column);
                return Err(CsvError::UnknownColumn { path: path(), line, column, known });
            }
        });
    }
    if !columns.is_empty() && !columns.iter().any(|column| matches!(column, Column::Values(_))) {
        // There are three of times and cycles at most, unless it is the export of a task.
        let found = header.iter().take(3).map(quoted).collect::<Vec<_>>().join(" and ");
        return Err(CsvError::NoValues { path: path(), line, found });
    }
    Ok(columns)
}

/// Reads the time of a row in nanoseconds after the first one.
fn after_ns(cell: &str, first_s: &mut Option<f64>, before_ns: u64) -> Option<u64> {
    /// A year; so far apart no two frames are.
    const MOST_S: f64 = 31_536_000.0;
    let time_s = numbers::parse_number(cell).ok().filter(|time_s| time_s.is_finite())?;
    let after_s = time_s - *first_s.get_or_insert(time_s);
    let after_ns = (0.0..=MOST_S).contains(&after_s).then(|| (after_s * 1e9).round() as u64)?;
    (after_ns >= before_ns).then_some(after_ns)
}

/// The text of a file. One without end is read only until that is clear.
fn text_of(path: &Path) -> Result<String, CsvError> {
    let name = || path.display().to_string();
    let io = |source| CsvError::Io { path: name(), source };
    let mut file = open_input(path).map_err(io)?;
    let mut bytes = Vec::new();
    loop {
        const CHUNK_BYTES: u64 = 1 << 20;
        let known = bytes.len();
        (&mut file).take(CHUNK_BYTES).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() == known {
            break;
        }
        // Text has no NUL, and most binary files soon have one.
        if let Some(place) = bytes[known..].iter().position(|byte| *byte == 0) {
            let line = line_at(&bytes, known + place);
            return Err(CsvError::NotText { path: name(), line });
        }
        if bytes.len() as u64 > MAX_BYTES {
            return Err(CsvError::TooLarge { path: name() });
        }
    }
    String::from_utf8(bytes).map_err(|error| {
        let line = line_at(error.as_bytes(), error.utf8_error().valid_up_to());
        CsvError::NotText { path: name(), line }
    })
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
