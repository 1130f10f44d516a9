//! Where a recording goes, and what has become of it.

use std::fs::File;
use std::io::Write;

/// A file that a node is recorded in.
pub trait RecordingFile: Write + Send + 'static {
    /// Takes away what stands behind so many bytes: the half of a record that found no room. Returns how many
    /// bytes are left that can be read: 0 if others removed or changed the file.
    fn cut(&mut self, bytes: u64) -> u64;
}

impl RecordingFile for File {
    fn cut(&mut self, bytes: u64) -> u64 {
        // A pipe or a device keeps it.
        let _ = self.set_len(bytes);
        bytes
    }
}

/// What a recording of a node has.
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
    /// Why it lacks something, in a sentence; `None`: it is complete.
    pub incomplete: Option<String>,
}
