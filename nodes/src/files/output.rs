//! Files that grow while a verb runs.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use isochrone_runtime::{RecordingFile, open_output, output_target};
use rustix::fs::OFlags;
use rustix::io::Errno;

use super::names::{highest_number, numbered};
use super::pipe::await_other_end;
use super::replacement::being_written;
use super::{Unwritable, is_stream};

/// A file that is opened before the run, so that the run is not in vain if it cannot be. It keeps its contents until
/// something is written. A new file to which nothing was written is removed.
///
/// It is locked, so that no two runs write the same file, and writing fails once another program has removed the file
/// or changed its length. Pipes and devices are neither locked nor watched.
pub(crate) struct OutputFile {
    path: PathBuf,
    file: File,
    is_new: bool,
    has_begun: bool,
    /// Whether it has a name and a length that can be checked.
    is_watched: bool,
    /// Bytes that were written.
    length: u64,
}

/// Which recordings have a number in their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Numbers {
    /// Only if the name is taken: from `level_0002.mcap` on.
    IfTaken,
    /// Each of a series, from `level_0001.mcap` on.
    Always,
}

impl OutputFile {
    /// Opens the file, or creates it.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        match Self::create(path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            created => return created,
        }
        let _reader = await_reader(path)?;
        let file = open_output(path, OpenOptions::new().write(true), 0)?;
        Self::new(path, file, false)
    }

    /// Creates the file of a recording. If a file of this name exists, whatever it holds, the recording takes the
    /// number after the highest one that is taken. A pipe or a device is opened as it is.
    pub(crate) fn create_recording(path: &Path, numbers: Numbers) -> Result<Self, Unwritable> {
        let target = output_target(path).map_err(|error| Unwritable::new(path, error))?;
        if numbers == Numbers::IfTaken {
            let is_stream = is_stream(&target);
            let opened = if is_stream { Self::open(path) } else { Self::create(path) };
            match opened {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                opened => return opened.map_err(|error| Unwritable::new(path, error)),
            }
        }
        let first = if numbers == Numbers::Always { 1 } else { 2 };
        let mut number = first.max(highest_number(&target).saturating_add(1));
        loop {
            let name = numbered(&target, number);
            match Self::create(&name) {
                // Another program has just taken it.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
                created => return created.map_err(|error| Unwritable::new(&name, error)),
            }
        }
    }

    fn create(path: &Path) -> io::Result<Self> {
        let mut options = OpenOptions::new();
        let file = open_output(path, options.write(true).create_new(true), 0)?;
        Self::new(path, file, true)
    }

    fn new(path: &Path, file: File, is_new: bool) -> io::Result<Self> {
        let metadata = file.metadata()?;
        // Some file systems have no locks; others count no links, so that the name cannot be checked.
        if metadata.is_file() && matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(being_written());
        }
        let is_watched = metadata.is_file() && metadata.nlink() > 0;
        Ok(Self { path: path.to_owned(), file, is_new, has_begun: false, is_watched, length: 0 })
    }

    /// Writes a text as a whole, in place of what the file held.
    pub(super) fn write_whole(mut self, text: &[u8]) -> io::Result<()> {
        self.write_all(text)?;
        self.flush()
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it is a file with a name and a length, rather than a pipe or a device.
    pub(crate) fn is_watched(&self) -> bool {
        self.is_watched
    }

    /// Fails if the written data is no longer there.
    fn check(&self) -> io::Result<()> {
        if !self.is_watched {
            return Ok(());
        }
        let metadata = self.file.metadata()?;
        if metadata.nlink() == 0 {
            return Err(io::Error::other("it was removed or replaced while it was written"));
        }
        if self.has_begun && metadata.len() != self.length {
            return Err(io::Error::other(
                "another program changed its length while it was written",
            ));
        }
        Ok(())
    }
}

impl RecordingFile for OutputFile {
    fn cut(&mut self, bytes: u64) -> u64 {
        // If others have changed the file, it is left alone.
        if self.check().is_err() { 0 } else { self.file.cut(bytes) }
    }
}

impl Write for OutputFile {
    /// The first call truncates the file.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.check()?;
        if !std::mem::replace(&mut self.has_begun, true) {
            // This fails for pipes and devices, which need no truncation.
            let _ = self.file.set_len(0);
        }
        let written = self.file.write(bytes)?;
        self.length += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.check()
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        if self.is_new && !self.has_begun {
            // If it cannot be removed, it stays, empty.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Waits until a named pipe has a reader, as `open` does, but reports the wait and ends it on a signal. The returned
/// file keeps the pipe open for that reader until the caller has opened it.
fn await_reader(path: &Path) -> io::Result<Option<File>> {
    if !fs::metadata(path).is_ok_and(|it| it.file_type().is_fifo()) {
        return Ok(None);
    }
    let at_once = OFlags::NONBLOCK.bits() as i32;
    await_other_end(path, "reads", 1, || {
        match open_output(path, OpenOptions::new().write(true), at_once) {
            Err(error) if Errno::from_io_error(&error) == Some(Errno::NXIO) => Ok(None),
            opened => opened.map(Some),
        }
    })
    .map(Some)
}
