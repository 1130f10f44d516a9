//! The end of a journal file.

use std::fs::{self, File};
use std::io::{self, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use super::error::JournalError;
use super::line::Line;
use super::lines::JournalLines;

/// The state at the end of a file, which the next run continues from.
#[derive(Debug, Default)]
pub(super) struct Tail {
    /// Number of its last run; 0 if it has none.
    pub(super) run: u64,
    /// The last transaction of all its runs; 0 if there is none.
    pub(super) transaction: u64,
    /// Length of its complete lines, in bytes.
    bytes: u64,
    /// Whether the last of them lacks its end of line.
    is_open: bool,
    /// Whether an incomplete line comes after them.
    pub(super) is_cut: bool,
}

/// Opens a file again without /proc, where its path still leads to it; otherwise this error.
fn by_path(file: &File, path: &Path, error: io::Error) -> io::Result<File> {
    let read = File::open(path)?;
    let [own, found] = [file.metadata()?, read.metadata()?];
    let is_same = (own.dev(), own.ino()) == (found.dev(), found.ino());
    if is_same { Ok(read) } else { Err(error) }
}

impl Tail {
    /// Locks a file against other writers, and reads its end.
    pub(super) fn take(file: &File, path: &Path) -> Result<Self, JournalError> {
        let name = || path.display().to_string();
        file.try_lock().map_err(|error| match error {
            fs::TryLockError::WouldBlock => JournalError::InUse { path: name() },
            fs::TryLockError::Error(source) => JournalError::Write { path: name(), source },
        })?;
        Self::read(file, path)
    }

    /// Reads the end of this open file, whatever its path leads to by now.
    pub(super) fn read(file: &File, path: &Path) -> Result<Self, JournalError> {
        let read = File::open(format!("/proc/self/fd/{}", file.as_raw_fd()));
        let read = read.or_else(|error| by_path(file, path, error));
        let failed = |source| JournalError::Read { path: path.display().to_string(), source };
        let mut lines = JournalLines::of(read.map_err(failed)?, path);
        let mut tail = Self::default();
        for line in &mut lines {
            let (run, transaction) = match line {
                Ok((_, Line::Run(header))) => (header.run, header.after_transaction),
                Ok((_, Line::Entry(entry))) => (0, Some(entry.transaction)),
                Ok((_, Line::End(end))) => (end.run, end.last_transaction),
                Ok((_, Line::Missed(_))) => (0, None),
                // A file that was created and not begun.
                Err(JournalError::Empty { .. }) => (0, None),
                Err(error) => return Err(error),
            };
            tail.run = tail.run.max(run);
            tail.transaction = tail.transaction.max(transaction.unwrap_or_default());
        }
        tail.bytes = lines.whole_bytes();
        tail.is_open = lines.is_open();
        tail.is_cut = lines.cut_line().is_some();
        Ok(tail)
    }

    /// Removes an incomplete last line, and completes one that lacks only its newline; returns the new length.
    pub(super) fn trim(&self, mut file: &File) -> io::Result<u64> {
        if self.is_cut {
            file.set_len(self.bytes)?;
        }
        if self.is_open {
            file.write_all(b"\n")?;
        }
        Ok(self.bytes + u64::from(self.is_open))
    }
}
