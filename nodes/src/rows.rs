//! Writing CSV files of values over time: a row of names, then a row for each cycle or frame.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::Path;

use crate::failure::Failure;
use crate::numbers;

/// The column of times in seconds.
pub(crate) const TIME: &str = "time_s";
/// The column of cycles.
pub(crate) const CYCLE: &str = "cycle";

/// A CSV file that is being written. Numbers are the shortest decimals that read back to the same
/// value.
pub(crate) struct Rows {
    name: String,
    out: BufWriter<Box<dyn Write>>,
    row: String,
}

impl Rows {
    /// Creates the file; `-` is stdout.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let (name, out): (_, Box<dyn Write>) = if path == Path::new("-") {
            ("to stdout".into(), Box::new(io::stdout().lock()))
        } else {
            let name = path.display().to_string();
            let file = File::create(path)
                .map_err(|error| Failure::usage(format!("cannot write {name}: {error}")))?;
            (name, Box::new(file))
        };
        Ok(Self { name, out: BufWriter::with_capacity(1 << 16, out), row: String::new() })
    }

    /// Writes the names of the columns.
    pub(crate) fn header<'a>(
        &mut self,
        columns: impl IntoIterator<Item = &'a str>,
    ) -> Result<(), Failure> {
        columns.into_iter().for_each(|column| self.field(&field(column)));
        self.end_row()
    }

    /// Writes a row: the time where it has one, the cycle, the values.
    pub(crate) fn row(
        &mut self,
        time_s: Option<f64>,
        cycle: u64,
        values: impl IntoIterator<Item = f64>,
    ) -> Result<(), Failure> {
        if let Some(time_s) = time_s {
            self.field(&numbers::format(time_s));
        }
        self.field(&cycle.to_string());
        values.into_iter().for_each(|value| self.field(&numbers::format(value)));
        self.end_row()
    }

    /// Hands everything on to whoever reads along.
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
    fn a_name_stays_one_field_of_a_csv_file() {
        assert_eq!(field("level.y"), "level.y");
        assert_eq!(field("a,b"), "\"a,b\"");
        assert_eq!(field("a\"b"), "\"a\"\"b\"");
    }
}
