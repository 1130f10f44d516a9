//! Files that hold the result of a run.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use isochrone_runtime::RecordingFile;
use serde::Serialize;

use crate::failure::Failure;

/// A file that is opened before the run, so that a run is not for nothing, and keeps what it holds
/// until there is a result. One that the run made is removed if there is none.
pub(crate) struct ResultFile {
    path: PathBuf,
    file: File,
    is_new: bool,
    has_result: bool,
}

impl ResultFile {
    /// Opens the file, or creates it.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let cannot = |error| Failure::usage(format!("cannot write {}: {error}", path.display()));
        Self::create(path).map_err(cannot)
    }

    /// The same for a file that follows another one during a run.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let open = |is_new| {
            let mut options = OpenOptions::new();
            // What is no new file may still be none: a link to a file that does not exist.
            options.write(true).truncate(false).create_new(is_new).create(!is_new).open(path)
        };
        let (opened, is_new) = match open(true) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => (open(false), false),
            made => (made, true),
        };
        Ok(Self { path: path.to_owned(), file: opened?, is_new, has_result: false })
    }

    /// Replaces what the file held.
    pub(crate) fn replace(&mut self, text: &str) -> Result<(), Failure> {
        self.write_all(text.as_bytes()).map_err(|error| self.cannot_write(&error))
    }

    /// Writes a report as JSON.
    pub(crate) fn write_report(&mut self, report: &impl Serialize) -> Result<(), Failure> {
        match serde_json::to_string_pretty(report) {
            Ok(text) => self.replace(&(text + "\n")),
            Err(error) => Err(self.cannot_write(&error.into())),
        }
    }

    fn cannot_write(&self, error: &io::Error) -> Failure {
        Failure::found(format!("cannot write {}: {error}", self.path.display()))
    }
}

impl RecordingFile for ResultFile {
    fn cut(&mut self, bytes: u64) {
        self.file.cut(bytes);
    }
}

impl Write for ResultFile {
    /// The first call takes away what the file held.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !std::mem::replace(&mut self.has_result, true) {
            // A pipe or a device has no length to take away, and needs none.
            let _ = self.file.set_len(0);
        }
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for ResultFile {
    fn drop(&mut self) {
        if self.is_new && !self.has_result {
            // One that cannot be removed stays, and is empty.
            let _ = fs::remove_file(&self.path);
        }
    }
}
