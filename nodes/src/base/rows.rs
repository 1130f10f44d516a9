//! Writing CSV files of values over time: a row of names, then a row for each cycle or frame.

use std::borrow::Cow;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;

pub(crate) use crate::base::columns::{CYCLE, MISSED, TIME, is_reserved};
use crate::base::columns::{field, with_unit};
use crate::base::failure::Failure;
use crate::base::files::{OutputFile, Unwritable};
use crate::base::numbers;

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
}
