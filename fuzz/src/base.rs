//! The reader of CSV files, by itself: it is a part of the command line, of which all the rest would be built with it.
#![allow(dead_code, reason = "the verbs use more of it")]

#[path = "../../nodes/src/base/columns.rs"]
pub(crate) mod columns;
#[path = "../../nodes/src/base/csv_table/mod.rs"]
pub(crate) mod csv_table;
#[path = "../../nodes/src/base/numbers.rs"]
pub(crate) mod numbers;
#[path = "../../nodes/src/base/suggestion.rs"]
pub(crate) mod suggestion;

pub(crate) mod files {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    /// As that of the command line, for files alone.
    pub(crate) fn open_input(path: &Path) -> io::Result<File> {
        File::open(path)
    }
}
