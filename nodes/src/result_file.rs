//! Files that hold the result of a run.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

use isochrone_report::Report;

use crate::failure::Failure;

/// A file that is opened before the run, so that a run is not for nothing, and keeps what it holds
/// until the run is over.
pub(crate) struct ResultFile {
    name: String,
    file: File,
}

impl ResultFile {
    /// Opens the file, or creates it.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let name = path.display().to_string();
        match OpenOptions::new().write(true).create(true).truncate(false).open(path) {
            Ok(file) => Ok(Self { name, file }),
            Err(error) => Err(Failure::usage(format!("cannot write {name}: {error}"))),
        }
    }

    /// Replaces what the file held.
    pub(crate) fn write(&self, text: &str) -> Result<(), Failure> {
        // A pipe or a device has no length to take away, and needs none.
        let _ = self.file.set_len(0);
        (&self.file)
            .write_all(text.as_bytes())
            .map_err(|error| Failure::found(format!("cannot write {}: {error}", self.name)))
    }

    /// Writes a report as JSON.
    pub(crate) fn write_report(&self, report: &Report) -> Result<(), Failure> {
        match serde_json::to_string_pretty(report) {
            Ok(text) => self.write(&(text + "\n")),
            Err(error) => Err(Failure::found(format!("cannot write {}: {error}", self.name))),
        }
    }
}
