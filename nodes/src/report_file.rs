//! The file of `--report`.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use isochrone_timing::Report;

use crate::failure::Failure;

/// It is opened before the run, so that a run is not for nothing.
pub(crate) struct ReportFile {
    name: String,
    file: File,
}

impl ReportFile {
    /// Creates the file, or empties it.
    pub(crate) fn create(path: &Path) -> Result<Self, Failure> {
        let name = path.display().to_string();
        match File::create(path) {
            Ok(file) => Ok(Self { name, file }),
            Err(error) => Err(Failure::usage(format!("cannot write {name}: {error}"))),
        }
    }

    /// Writes the report.
    pub(crate) fn write(mut self, report: &Report) -> Result<(), Failure> {
        let failed = |error| Failure::found(format!("cannot write {}: {error}", self.name));
        let text = serde_json::to_string_pretty(report).map_err(|error| failed(error.into()))?;
        self.file.write_all((text + "\n").as_bytes()).map_err(failed)
    }
}
