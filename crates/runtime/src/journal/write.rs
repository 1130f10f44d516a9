//! Writing a journal file.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isochrone_engine::Plan;
use rustix::fs::OFlags;

use super::error::JournalError;
use super::line::{FORMAT, Line, RunEnd, RunHeader};
use super::lines::JournalLines;
use crate::operating::unix_ns;
use crate::output_file::open_output;

/// A file that is longer is kept beside the next one. The text of the configuration does not count, which may be
/// longer by itself.
const LARGEST_BYTES: u64 = 16 << 20;
/// So many files are kept, as `FILE.1` (the latest) to `FILE.8`.
const KEPT: u32 = 8;

/// The journal of a node, as it is written: lines are added to a file, for an ordinary thread.
///
/// Each line is with the operating system before what it tells is acknowledged, so a process that is
/// killed loses nothing that was; a power failure may cost what the system had not written to the disk. What
/// cannot be written is kept and tried again, and changes are refused until it is written.
///
/// A file that has grown to 16 MiB is renamed to `FILE.1`, an older one of that name to `FILE.2`, and so on up to
/// `FILE.8`. The next file begins with the run again. A file that somebody else has renamed or removed is
/// followed by another one in the same way.
#[derive(Debug)]
pub struct Journal {
    /// As it was given.
    path: PathBuf,
    /// Where it led when it was opened.
    place: PathBuf,
    file: File,
    /// A regular file, which has a length; pipes and devices have none.
    is_regular: bool,
    is_new: bool,
    header: RunHeader,
    has_begun: bool,
    has_ended: bool,
    last_transaction: u64,
    has_cut_line: bool,
    /// Length of the file, in bytes, and from which on it is kept beside another.
    written: u64,
    full_at: u64,
    waiting: Vec<u8>,
    /// The last transaction of what waits.
    waiting_transaction: u64,
    unwritten: Option<Arc<str>>,
}

impl Journal {
    /// Opens the file, or creates it, for a run of this plan. What it holds stays; a last line that a
    /// killed node has not finished is taken away.
    ///
    /// # Errors
    /// It cannot be written, another process writes it, or it holds something else than a journal.
    pub fn open(path: &Path, plan: &Plan) -> Result<Self, JournalError> {
        let write = |source| JournalError::Write { path: path.display().to_string(), source };
        let (file, is_new) = open(path).map_err(write)?;
        let is_regular = file.metadata().map_err(write)?.is_file();
        let mut journal = Self {
            path: path.to_owned(),
            place: fs::canonicalize(path).unwrap_or_else(|_| path.to_owned()),
            is_regular,
            is_new,
            header: RunHeader {
                format: FORMAT,
                run: 1,
                node: plan.node.clone(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                file: plan.source.name.clone(),
                sha256: plan.source.sha256(),
                started_unix_ns: 0,
                configuration: Some(plan.source.text.to_string()),
                after_transaction: None,
            },
            has_begun: false,
            has_ended: false,
            last_transaction: 0,
            has_cut_line: false,
            written: 0,
            full_at: LARGEST_BYTES,
            waiting: Vec::new(),
            waiting_transaction: 0,
            unwritten: None,
            file,
        };
        if journal.is_regular {
            let tail = Tail::take(&journal.file, path)?;
            journal.header.run = tail.run + 1;
            journal.last_transaction = tail.transaction;
            journal.has_cut_line = tail.is_cut;
            journal.written = tail.trim(&journal.file).map_err(write)?;
        }
        Ok(journal)
    }

    /// Its path, as it was given.
    pub(super) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Number of the run that is written, from 1.
    pub fn run(&self) -> u64 {
        self.header.run
    }

    /// Whether the file had an incomplete last line, which was taken away: a node was killed while it
    /// wrote.
    pub fn had_cut_line(&self) -> bool {
        self.has_cut_line
    }

    /// The last transaction of the runs before; 0: there is none.
    pub(crate) fn last_transaction(&self) -> u64 {
        self.last_transaction
    }

    /// Writes that a run begins.
    pub(crate) fn begin(&mut self, started_unix_ns: u64) -> Result<(), JournalError> {
        self.header.started_unix_ns = started_unix_ns;
        let begun = if self.is_full() && self.rotate() {
            Ok(())
        } else {
            self.file.try_clone().and_then(|file| self.begin_in(file, self.written))
        };
        let path = || self.path.display().to_string();
        begun.map_err(|source| JournalError::Write { path: path(), source })?;
        self.has_begun = true;
        Ok(())
    }

    /// Adds a line, with its end, and the transaction that it is of.
    pub(super) fn add(&mut self, line: &[u8], transaction: u64) {
        self.waiting.extend_from_slice(line);
        self.waiting_transaction = transaction;
    }

    /// How much of what was added waits to be written.
    pub(super) fn waiting_bytes(&self) -> u64 {
        self.waiting.len() as u64
    }

    /// Leaves it as it is: lines are lost that belong before an end.
    pub(super) fn abandon(&mut self) {
        self.has_ended = true;
    }

    /// Writes what waits.
    pub(crate) fn flush(&mut self) {
        let written = self.write_waiting();
        let path = self.path.display();
        match written {
            Ok(()) if self.unwritten.take().is_some() => {
                tracing::info!("the journal {path} is written again; changes are taken");
            }
            Ok(()) => {}
            Err(error) => {
                let reason: Arc<str> =
                    format!("the journal {path} cannot be written ({error})").into();
                if self.unwritten.is_none() {
                    tracing::error!("{reason}; changes are refused until it can be");
                }
                self.unwritten = Some(reason);
            }
        }
    }

    /// Writes that the run has ended. Returns why the file lacks something at its end, if it does: that is lost.
    pub(crate) fn end(&mut self, ended_unix_ns: u64) -> Option<Arc<str>> {
        if !self.has_begun || self.has_ended {
            return None;
        }
        self.has_ended = true;
        let written = self.write_waiting().and_then(|()| {
            let (run, last_transaction) = (self.header.run, Some(self.last_transaction));
            let end = Line::End(RunEnd { run, ended_unix_ns, last_transaction });
            self.write(&mut end.text().unwrap_or_default())
        });
        let path = self.path.display();
        written.err().map(|error| {
            format!("the journal {path} is incomplete: its end could not be written ({error})")
                .into()
        })
    }

    /// Why changes are refused, as part of a sentence; `None`: all is written.
    pub(super) fn unwritten(&self) -> Option<&Arc<str>> {
        self.unwritten.as_ref()
    }

    fn write_waiting(&mut self) -> io::Result<()> {
        if !self.is_at_its_place()? {
            self.go_on()?;
            tracing::warn!(
                "the journal {} was renamed, removed or truncated; what is done from now on is in another file of \
                 this name",
                self.path.display()
            );
        }
        if self.is_full() && !self.waiting.is_empty() {
            self.rotate();
        }
        let mut waiting = std::mem::take(&mut self.waiting);
        let written = self.write(&mut waiting);
        self.waiting = waiting;
        if written.is_ok() {
            self.last_transaction = self.last_transaction.max(self.waiting_transaction);
        }
        written
    }

    /// Whether the file that is written is still the one of its path, with all that was written.
    fn is_at_its_place(&self) -> io::Result<bool> {
        if !self.is_regular {
            return Ok(true);
        }
        let own = self.file.metadata()?;
        Ok(own.len() >= self.written
            && match fs::metadata(&self.place) {
                Ok(there) => (there.dev(), there.ino()) == (own.dev(), own.ino()),
                Err(error) => error.kind() != ErrorKind::NotFound,
            })
    }

    fn is_full(&self) -> bool {
        self.is_regular && self.written >= self.full_at
    }

    /// Keeps the file beside another that goes on; whether that could be. Nothing is lost where it could not.
    fn rotate(&mut self) -> bool {
        let next = self.beside("new");
        let rotated = self.begin_next(&next);
        if let Err(error) = &rotated {
            let _ = fs::remove_file(next);
            self.full_at = self.written + LARGEST_BYTES / 16;
            let path = self.path.display();
            tracing::warn!(
                "the journal {path} grows beyond 16 MiB: no other can take its place ({error})"
            );
        }
        rotated.is_ok()
    }

    /// Begins another file, and gives it the name when it has the line of the run.
    fn begin_next(&mut self, next: &Path) -> io::Result<()> {
        // What a node that was killed has left.
        let _ = fs::remove_file(next);
        let (file, _) = open(next)?;
        file.set_permissions(Permissions::from_mode(self.file.metadata()?.permissions().mode()))?;
        file.try_lock()?;
        let line = self.header_line();
        write_whole(&file, &line, 0)?;
        let kept = |number: u32| self.beside(&number.to_string());
        for number in (1..KEPT).rev() {
            match fs::rename(kept(number), kept(number + 1)) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        fs::rename(&self.place, kept(1))?;
        fs::rename(next, &self.place).inspect_err(|_| {
            let _ = fs::rename(kept(1), &self.place);
        })?;
        self.go_on_in(file, line.len(), 0);
        Ok(())
    }

    fn beside(&self, suffix: &str) -> PathBuf {
        let mut name = self.place.clone().into_os_string();
        name.push(format!(".{suffix}"));
        name.into()
    }

    /// Goes on in the file that is at the place now, or in a new one.
    fn go_on(&mut self) -> io::Result<()> {
        let (file, is_new) = open(&self.place)?;
        let (own, metadata) = (self.file.metadata()?, file.metadata()?);
        if !metadata.is_file() {
            return Err(io::Error::other("there is something else than a file of this name now"));
        }
        if is_new {
            file.set_permissions(Permissions::from_mode(own.permissions().mode()))?;
        }
        // One that was only truncated is locked already, by this journal.
        let is_own = (metadata.dev(), metadata.ino()) == (own.dev(), own.ino());
        let file = if is_own { self.file.try_clone()? } else { file };
        let tail =
            if is_own { Tail::read(&file, &self.path) } else { Tail::take(&file, &self.path) };
        let tail = tail.map_err(io::Error::other)?;
        let length = tail.trim(&file)?;
        self.header.run = self.header.run.max(tail.run);
        self.last_transaction = self.last_transaction.max(tail.transaction);
        self.begin_in(file, length)
    }

    /// Writes that the run begins at the end of a file of this length, and goes on there.
    fn begin_in(&mut self, file: File, length: u64) -> io::Result<()> {
        let line = self.header_line();
        write_whole(&file, &line, length)?;
        self.go_on_in(file, line.len(), length);
        Ok(())
    }

    fn header_line(&mut self) -> Vec<u8> {
        self.header.after_transaction = Some(self.last_transaction);
        Line::Run(self.header.clone()).text().unwrap_or_default()
    }

    fn go_on_in(&mut self, file: File, header_bytes: usize, length: u64) {
        self.file = file;
        self.written = length + header_bytes as u64;
        self.full_at = LARGEST_BYTES + header_bytes as u64;
    }

    /// Writes bytes and takes away what is written: all of them or, in a file, none.
    fn write(&mut self, bytes: &mut Vec<u8>) -> io::Result<()> {
        let mut done = 0;
        let written = loop {
            match self.file.write(bytes.get(done..).unwrap_or_default()) {
                Ok(0) if done < bytes.len() => break Err(ErrorKind::WriteZero.into()),
                Ok(more) => done += more,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => break Err(error),
            }
            if done == bytes.len() {
                break Ok(());
            }
        };
        if written.is_err() && self.is_regular && self.file.set_len(self.written).is_ok() {
            done = 0;
        }
        bytes.drain(..done);
        self.written += done as u64;
        written
    }
}

/// Adds a line to a file of this length, or nothing.
fn write_whole(mut file: &File, line: &[u8], length: u64) -> io::Result<()> {
    file.write_all(line).inspect_err(|_| {
        // Fails on what has no length.
        let _ = file.set_len(length);
    })
}

/// Opens a file that is added to; whether it is new.
fn open(path: &Path) -> io::Result<(File, bool)> {
    let open = |is_new: bool| {
        let mut options = OpenOptions::new();
        // A pipe that nobody reads must hold up nothing.
        options.append(true).create_new(is_new).create(!is_new);
        open_output(path, &options, OFlags::NONBLOCK)
    };
    match open(true) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok((open(false)?, false)),
        made => Ok((made?, true)),
    }
}

/// What a file ends with, which the next run in it goes on from.
#[derive(Debug, Default)]
struct Tail {
    /// Number of its last run; 0: it has none.
    run: u64,
    /// The last transaction of all its runs; 0: there is none.
    transaction: u64,
    /// Length of its complete lines, in bytes.
    bytes: u64,
    /// Whether the last of them lacks its end of line.
    is_open: bool,
    /// Whether an incomplete line comes after them.
    is_cut: bool,
}

impl Tail {
    /// Keeps other processes from writing a file, and reads it.
    fn take(file: &File, path: &Path) -> Result<Self, JournalError> {
        let name = || path.display().to_string();
        file.try_lock().map_err(|error| match error {
            fs::TryLockError::WouldBlock => JournalError::InUse { path: name() },
            fs::TryLockError::Error(source) => JournalError::Write { path: name(), source },
        })?;
        Self::read(file, path)
    }

    /// Reads this very file, which was opened to be written, whatever is at its path by now.
    fn read(file: &File, path: &Path) -> Result<Self, JournalError> {
        let mut lines = JournalLines::open(&descriptor(file))?.named(path);
        let mut tail = Self::default();
        for line in &mut lines {
            let (run, transaction) = match line {
                Ok((_, Line::Run(header))) => (header.run, header.after_transaction),
                Ok((_, Line::Entry(entry))) => (0, Some(entry.transaction)),
                Ok((_, Line::End(end))) => (end.run, end.last_transaction),
                Ok((_, Line::Missed(_))) => (0, None),
                // One that was created and not begun.
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

    /// Takes an incomplete line away, and ends one that lacks only that; the length of the file then.
    fn trim(&self, mut file: &File) -> io::Result<u64> {
        file.set_len(self.bytes)?;
        if self.is_open {
            file.write_all(b"\n")?;
        }
        Ok(self.bytes + u64::from(self.is_open))
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        if !self.has_begun {
            if self.is_new && self.is_regular {
                // One that cannot be removed stays, and is empty.
                let _ = fs::remove_file(&self.path);
            }
            return;
        }
        if let Some(reason) = self.end(unix_ns()) {
            tracing::error!("{reason}");
        }
    }
}

fn descriptor(file: &File) -> PathBuf {
    format!("/proc/self/fd/{}", file.as_raw_fd()).into()
}
