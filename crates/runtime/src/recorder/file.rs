//! The file of a recording, and its outcome.

use std::fs::File;
use std::io::Write;

/// A file that a node is recorded in.
pub trait RecordingFile: Write + Send + 'static {
    /// Truncates the file to this length, to remove a record that did not fit as a whole. Returns how many readable
    /// bytes are left: 0 if others removed or changed the file.
    fn cut(&mut self, bytes: u64) -> u64;
}

impl RecordingFile for File {
    fn cut(&mut self, bytes: u64) -> u64 {
        // A pipe or a device cannot be truncated.
        let _ = self.set_len(bytes);
        bytes
    }
}

/// The outcome of a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct RecordingOutcome {
    /// Its file, as it was named.
    pub file: String,
    /// Cycles in the file, of all tasks.
    pub cycles: u64,
    /// Cycles that ran and are not in it.
    pub lost: u64,
    /// Entries of the journal in it.
    pub entries: u64,
    /// Its size.
    pub bytes: u64,
    /// Why it is incomplete, in a sentence; `None`: it is complete.
    pub incomplete: Option<String>,
}
