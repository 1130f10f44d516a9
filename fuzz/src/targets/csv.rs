//! CSV files of values over time.

use std::io::{Seek, Write};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use isochrone_blocks::PinType;

use crate::base::columns::{TIME, field, is_reserved, with_unit};
use crate::base::csv_table::CsvTable;
use crate::base::numbers;
use crate::{Target, assert_sentence};

pub(crate) const TARGET: Target = Target { name: "csv", max_bytes: 4096, max_mib: 16, read };

/// A node's inputs.
const INPUTS: [(&str, PinType); 5] = [
    ("level", PinType::Lreal),
    ("stop", PinType::Bool),
    ("pause", PinType::Time),
    ("count", PinType::Int),
    ("mode", PinType::Word),
];

fn read(bytes: &[u8]) {
    let file = in_file(bytes);
    for table in [CsvTable::with_cycles(&file.1), CsvTable::of_inputs(&file.1, &INPUTS)] {
        match table {
            Ok(table) => check(&table),
            Err(refused) => assert_sentence(&refused.to_string()),
        }
    }
    match CsvTable::read(&file.1) {
        Ok(table) => assert_reads_back(&table),
        Err(refused) => assert_sentence(&refused.to_string()),
    }
}

/// A file without a name, and how to open it.
fn in_file(bytes: &[u8]) -> (std::fs::File, PathBuf) {
    let mut file = tempfile::tempfile().expect("there is room for files");
    file.write_all(bytes).and_then(|()| file.rewind()).expect("there is room for files");
    let path = Path::new("/proc/self/fd").join(file.as_raw_fd().to_string());
    (file, path)
}

fn check(table: &CsvTable) {
    let columns = table.columns().len();
    assert!(table.len() > 0 && columns > 0, "accepted without a value");
    assert_eq!(table.units().len(), columns);
    let times = table.times_ns();
    assert!(times.is_none_or(|times| times.len() == table.len() && times.is_sorted()), "{times:?}");
    for row in 0..table.len() {
        assert_eq!(table.row(row as u64).len(), columns, "row {row}");
        let cycle = table.cycle(row).unwrap_or(row as u64);
        assert!(table.row_of(cycle).is_some() && cycle <= table.end(), "cycle {cycle}");
    }
}

/// What is written as the verbs write it reads back to the bit.
fn assert_reads_back(table: &CsvTable) {
    check(table);
    let named = table.columns().iter().zip(table.units());
    let header: Vec<_> =
        named.map(|(name, unit)| field(&with_unit(name.into(), unit)).into_owned()).collect();
    if table.columns().iter().any(|name| is_reserved(name)) {
        // A verb gives such a value another name.
        return;
    }
    let mut text = format!("{TIME},{}\n", header.join(","));
    for row in 0..table.len() {
        let values: Vec<_> = table.row(row as u64).iter().copied().map(numbers::format).collect();
        text += &format!("{row},{}\n", values.join(","));
    }
    let file = in_file(text.as_bytes());
    let again = CsvTable::read(&file.1).unwrap_or_else(|refused| panic!("{refused}\n{text}"));
    assert_eq!((again.columns(), again.units()), (table.columns(), table.units()), "{text}");
    let bits = |table: &CsvTable| -> Vec<u64> {
        let rows = (0..table.len() as u64).flat_map(|row| table.row(row));
        // All NaNs are one.
        rows.map(|value| if value.is_nan() { f64::NAN.to_bits() } else { value.to_bits() })
            .collect()
    };
    assert_eq!(bits(&again), bits(table), "{text}");
}
