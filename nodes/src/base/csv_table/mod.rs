//! A CSV file of values over time: a column for each name, a row for each cycle or frame.

mod error;
mod read;
mod values;

pub(crate) use values::CsvTable;
