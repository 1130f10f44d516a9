//! Files that hold the result of a run.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use isochrone_processes::is_asked_to_end;
use isochrone_runtime::{RecordingFile, open_output};
use rustix::fs::OFlags;
use rustix::io::Errno;
use serde::Serialize;

use crate::failure::Failure;
use crate::terminal;

/// Between two looks for a reader of a pipe.
const LOOK: Duration = Duration::from_millis(20);

/// A file that is opened before the run, so that a run is not for nothing, and keeps what it holds
/// until there is a result. One that the run made is removed if there is none.
///
/// It is locked, so that no two runs write the same file, and what is written fails once others have removed
/// the file or changed its length. Pipes and devices are neither locked nor watched.
pub(crate) struct ResultFile {
    path: PathBuf,
    file: File,
    is_new: bool,
    has_result: bool,
    /// Whether it has a name and a length that can be looked after.
    is_watched: bool,
    /// Bytes that were written.
    length: u64,
}

impl ResultFile {
    /// Opens the file, or creates it.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let cannot = |error| Failure::usage(format!("cannot write {}: {error}", path.display()));
        Self::create(path).map_err(cannot)
    }

    /// The same for a file that follows another one during a run.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let _reader = await_reader(path)?;
        let open = |is_new| {
            let mut options = OpenOptions::new();
            // What is no new file may still be none: a link to a file that does not exist.
            options.write(true).truncate(false).create_new(is_new).create(!is_new);
            open_output(path, &options, OFlags::empty())
        };
        let (opened, is_new) = match open(true) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => (open(false), false),
            made => (made, true),
        };
        let file = opened?;
        let metadata = file.metadata()?;
        // Some file systems have no locks, and those that count no links have none to look after.
        if metadata.is_file() && matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(io::Error::other("it is being written already; choose another file"));
        }
        // Before it was locked, it may have been given another name.
        if metadata.is_file() && fs::metadata(path)?.ino() != metadata.ino() {
            return Err(io::Error::other("another program has just replaced it; try again"));
        }
        let is_watched = metadata.is_file() && metadata.nlink() > 0;
        Ok(Self { path: path.to_owned(), file, is_new, has_result: false, is_watched, length: 0 })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it is a file that has a name and a length, and no pipe or device.
    pub(crate) fn is_watched(&self) -> bool {
        self.is_watched
    }

    /// Goes on with a new file, where the one before has another name now.
    pub(crate) fn renew(&mut self) -> io::Result<()> {
        *self = Self::create(&self.path)?;
        Ok(())
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

    /// Fails if what was written is not there any more.
    fn check(&self) -> io::Result<()> {
        if !self.is_watched {
            return Ok(());
        }
        let metadata = self.file.metadata()?;
        if metadata.nlink() == 0 {
            return Err(io::Error::other("it was removed or replaced while it was written"));
        }
        if self.has_result && metadata.len() != self.length {
            return Err(io::Error::other(
                "another program changed its length while it was written",
            ));
        }
        Ok(())
    }

    fn cannot_write(&self, error: &io::Error) -> Failure {
        Failure::found(format!("cannot write {}: {error}", self.path.display()))
    }
}

impl RecordingFile for ResultFile {
    fn cut(&mut self, bytes: u64) -> u64 {
        // What others made of the file is theirs.
        if self.check().is_err() { 0 } else { self.file.cut(bytes) }
    }
}

impl Write for ResultFile {
    /// The first call takes away what the file held.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.check()?;
        if !std::mem::replace(&mut self.has_result, true) {
            // A pipe or a device has no length to take away, and needs none.
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

impl Drop for ResultFile {
    fn drop(&mut self) {
        if self.is_new && !self.has_result {
            // One that cannot be removed stays, and is empty.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Waits until somebody reads a named pipe, as opening it does, but says so and ends on a signal. What it
/// returns keeps that reader until the pipe is open.
fn await_reader(path: &Path) -> io::Result<Option<File>> {
    if !fs::metadata(path).is_ok_and(|it| it.file_type().is_fifo()) {
        return Ok(None);
    }
    let mut is_said = false;
    loop {
        match open_output(path, OpenOptions::new().write(true), OFlags::NONBLOCK) {
            Err(error) if Errno::from_io_error(&error) == Some(Errno::NXIO) => {}
            opened => return opened.map(Some),
        }
        if is_asked_to_end() {
            return Err(io::Error::other("nobody reads this pipe"));
        }
        if !std::mem::replace(&mut is_said, true) {
            terminal::note(&format!("waiting until somebody reads the pipe {}", path.display()));
        }
        thread::sleep(LOOK);
    }
}
