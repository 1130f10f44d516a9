//! The values of a CSV file, once it is read.

use std::collections::HashMap;

use super::error::{CsvError, known, quoted};
use crate::base::columns::name_and_unit;

/// The values of a CSV file.
#[derive(Debug, Default)]
pub(crate) struct CsvTable {
    /// The file, for messages.
    pub(super) path: String,
    pub(super) columns: Vec<String>,
    /// Of each column, its unit; empty for none.
    pub(super) units: Box<[String]>,
    /// Where each column stands.
    pub(super) places: HashMap<String, usize>,
    /// Row by row.
    pub(super) values: Vec<f64>,
    /// Of each row, nanoseconds after the first; empty where the file does not say.
    pub(super) times_ns: Vec<u64>,
    /// Of each row, the cycle that it is for; empty where row k is for cycle k.
    pub(super) cycles: Vec<u64>,
    /// Of each row, how many cycles were missed before it; empty where the file does not say.
    pub(super) missed: Vec<u64>,
    /// The time of the first row, in seconds; 0 where the file does not say.
    pub(super) begin_s: f64,
    pub(super) rows: usize,
}

impl CsvTable {
    /// No rows yet.
    pub(super) fn new(path: String, columns: Vec<String>, units: Box<[String]>) -> Self {
        let places = columns.iter().cloned().zip(0..).collect();
        Self { path, columns, units, places, ..Self::default() }
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows
    }

    /// Names of the columns of values.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Of each of these columns, its unit; empty for none.
    pub(crate) fn units(&self) -> &[String] {
        &self.units
    }

    /// The values of row `row`, or of the last row after the end.
    pub(crate) fn row(&self, row: u64) -> &[f64] {
        let row = usize::try_from(row).unwrap_or(usize::MAX).min(self.rows.saturating_sub(1));
        let first = row * self.columns.len();
        self.values.get(first..first + self.columns.len()).unwrap_or_default()
    }

    /// The values of the row for a cycle, if it has one.
    pub(crate) fn row_of(&self, cycle: u64) -> Option<&[f64]> {
        if self.cycles.is_empty() {
            return (cycle < self.rows as u64).then(|| self.row(cycle));
        }
        // A node that was ended sends its last frame again.
        let row = self.cycles.partition_point(|of| *of <= cycle).checked_sub(1)?;
        (self.cycles.get(row) == Some(&cycle)).then(|| self.row(row as u64))
    }

    /// The first cycle after the last row's.
    pub(crate) fn end(&self) -> u64 {
        self.cycles.last().map_or(self.rows as u64, |last| last.saturating_add(1))
    }

    /// The cycle of a row, if the file says.
    pub(crate) fn cycle(&self, row: usize) -> Option<u64> {
        self.cycles.get(row).copied()
    }

    /// How many cycles were missed before a row, as far as the file says.
    pub(crate) fn missed(&self, row: usize) -> u64 {
        self.missed.get(row).copied().unwrap_or_default()
    }

    /// The time of the first row, in seconds; 0 where the file does not say.
    pub(crate) fn begin_s(&self) -> f64 {
        self.begin_s
    }

    /// Of each row, nanoseconds after the first, if the file says.
    pub(crate) fn times_ns(&self) -> Option<&[u64]> {
        (!self.times_ns.is_empty()).then_some(&self.times_ns)
    }

    /// Index of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    /// The same with these columns only, in this order; each by its name or its header, such as `level [m]`.
    ///
    /// # Errors
    /// One is not there.
    pub(crate) fn select(self, names: &[String]) -> Result<Self, CsvError> {
        let headed = |header: &str| {
            let (name, unit) = name_and_unit(header);
            self.column(name).filter(|place| self.units.get(*place).is_some_and(|it| it == unit))
        };
        let place = |name: &String| {
            self.column(name).or_else(|| headed(name)).ok_or_else(|| CsvError::NoColumn {
                path: self.path.clone(),
                column: quoted(name),
                known: known(name, self.columns.iter().map(String::as_str)),
            })
        };
        let places = names.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let rows = self.values.chunks(self.columns.len().max(1));
        let values = rows.flat_map(|row| places.iter().filter_map(|place| row.get(*place)));
        let values = values.copied().collect();
        let names = places.iter().filter_map(|place| self.columns.get(*place)).cloned().collect();
        let units = places.iter().filter_map(|place| self.units.get(*place)).cloned().collect();
        let selected = Self::new(self.path, names, units);
        Ok(Self {
            values,
            times_ns: self.times_ns,
            cycles: self.cycles,
            missed: self.missed,
            begin_s: self.begin_s,
            rows: self.rows,
            ..selected
        })
    }
}
