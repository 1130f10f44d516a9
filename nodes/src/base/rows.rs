//! Writing CSV files of values over time: a row of names, then a row for each cycle or frame.

use std::borrow::Cow;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;

use crate::base::failure::Failure;
use crate::base::files::{OutputFile, Unwritable};
use crate::base::numbers;

/// The column of times in seconds.
pub(crate) const TIME: &str = "time_s";
/// The column of cycles.
pub(crate) const CYCLE: &str = "cycle";
/// The column of cycles that were missed before a row.
pub(crate) const MISSED: &str = "missed_cycles";

/// Whether a column of this name has no values of signals.
pub(crate) fn is_reserved(name: &str) -> bool {
    [TIME, CYCLE].contains(&name)
}

/// A CSV file that is being written. Numbers are the shortest decimals that read back to the same
/// value.
pub(crate) struct Rows {
    name: String,
    out: BufWriter<Box<dyn Write>>,
    row: String,
}

impl Rows {
    /// Creates the file; `-` is stdout. One that is there keeps what it holds until the first rows
    /// are written.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let (name, out): (_, Box<dyn Write>) = if path == Path::new("-") {
            ("to stdout".into(), Box::new(io::stdout().lock()))
        } else {
            let opened = OutputFile::open(path);
            let file = opened.map_err(|error| Failure::usage(Unwritable::new(path, error)))?;
            (path.display().to_string(), Box::new(file))
        };
        Ok(Self { name, out: BufWriter::with_capacity(1 << 16, out), row: String::new() })
    }

    /// Writes the names of the columns: those of times and cycles and whatever else is no value, and those
    /// of the values, each with its unit. A value with the name of one of those gets another, so that the file can be
    /// read again.
    pub(crate) fn header(&mut self, own: &[&str], values: &[(&str, &str)]) -> Result<(), Failure> {
        own.iter().for_each(|column| self.field(column));
        for (name, unit) in values {
            let mut name = Cow::from(*name);
            let is_taken = |name: &str| is_reserved(name) || own.contains(&name);
            if is_taken(&name) {
                while is_taken(&name) || values.iter().any(|(other, _)| *other == name) {
                    name.to_mut().push('_');
                }
            }
            self.field(&field(&with_unit(name, unit)));
        }
        self.end_row()
    }

    /// Writes a row: the time where it has one, the cycle, the values. The field of a value that is
    /// not there is empty.
    pub(crate) fn row(
        &mut self,
        time_s: Option<f64>,
        cycle: u64,
        values: impl IntoIterator<Item = Option<f64>>,
    ) -> Result<(), Failure> {
        self.row_with(time_s, cycle, &[], values)
    }

    /// As [`row`](Self::row), with fields between the cycle and the values.
    pub(crate) fn row_with(
        &mut self,
        time_s: Option<f64>,
        cycle: u64,
        further: &[String],
        values: impl IntoIterator<Item = Option<f64>>,
    ) -> Result<(), Failure> {
        if let Some(time_s) = time_s {
            self.field(&numbers::format(time_s));
        }
        self.field(&cycle.to_string());
        further.iter().for_each(|text| self.field(text));
        for value in values {
            self.field(&value.map_or_else(String::new, numbers::format));
        }
        self.end_row()
    }

    /// Flushes everything for a program that reads the file meanwhile.
    pub(crate) fn flush(&mut self) -> Result<(), Failure> {
        self.out.flush().map_err(|error| self.cannot_write(&error))
    }

    fn field(&mut self, text: &str) {
        self.row += text;
        self.row.push(',');
    }

    fn end_row(&mut self) -> Result<(), Failure> {
        self.row.pop();
        self.row.push('\n');
        let written = self.out.write_all(self.row.as_bytes());
        self.row.clear();
        written.map_err(|error| self.cannot_write(&error))
    }

    fn cannot_write(&self, error: &io::Error) -> Failure {
        match error.kind() {
            ErrorKind::BrokenPipe => Failure::reader_left(),
            _ => Failure::found(format!("cannot write {}: {error}", self.name)),
        }
    }
}

/// The header of a column: `level [m]`, or the name alone. A name that looks like that has ` []` behind it where it has no
/// unit, and a unit that would be read as a part of the name is left out.
fn with_unit<'a>(name: Cow<'a, str>, unit: &str) -> Cow<'a, str> {
    let unit = if unit.contains(" [") { "" } else { unit };
    let is_plain = unit.is_empty() && name_and_unit(&name).0 == name;
    if is_plain { name } else { format!("{name} [{unit}]").into() }
}

/// The name and the unit of such a header; the unit is empty if it has none.
pub(crate) fn name_and_unit(header: &str) -> (&str, &str) {
    let parts = header.strip_suffix(']').and_then(|header| header.rsplit_once(" ["));
    parts.filter(|(name, _)| !name.is_empty()).unwrap_or((header, ""))
}

/// A name as a field of a CSV file.
fn field(name: &str) -> Cow<'_, str> {
    if name.contains([',', '"', '\n', '\r']) || name.trim() != name {
        return format!("\"{}\"", name.replace('"', "\"\"")).into();
    }
    name.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_not_there_is_an_empty_field_and_nan_is_a_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let mut rows = Rows::create(&path).unwrap();
        rows.header(&[CYCLE], &[("a", "m"), ("b", ""), ("c", "a,b")]).unwrap();
        rows.row(None, 7, [Some(1.5), None, Some(f64::NAN)]).unwrap();
        rows.flush().unwrap();
        assert_eq!(
            std::fs::read_to_string(path).unwrap(),
            "cycle,a [m],b,\"c [a,b]\"\n7,1.5,,NaN\n"
        );
    }

    #[test]
    fn a_header_reads_back_as_name_and_unit() {
        for (name, unit, header) in [
            ("level.y", "m", "level.y [m]"),
            ("level.y", "", "level.y"),
            ("a", "[x]", "a [[x]]"),
            ("a [m]", "", "a [m] []"),
            ("a [m]", "cm", "a [m] [cm]"),
            ("a []", "", "a [] []"),
            (" [m]", "", " [m]"),
        ] {
            assert_eq!(with_unit(name.into(), unit), header);
            assert_eq!(name_and_unit(header), (name, unit));
        }
        assert_eq!(with_unit("a".into(), "m [x]"), "a");
        assert_eq!(name_and_unit("a[0]"), ("a[0]", ""));
    }

    #[test]
    fn a_name_stays_one_field_of_a_csv_file() {
        assert_eq!(field("level.y"), "level.y");
        assert_eq!(field("a,b"), "\"a,b\"");
        assert_eq!(field("a\"b"), "\"a\"\"b\"");
    }
}
