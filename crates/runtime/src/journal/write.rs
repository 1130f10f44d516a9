//! Writing a journal file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use isochrone_engine::Plan;
use rustix::fs::{FallocateFlags, OFlags, fallocate};
use rustix::io::Errno;

use super::error::JournalError;
use super::line::{FORMAT, Line, RunEnd, RunHeader};
use super::tail::Tail;
use crate::operating::unix_ns;

/// What a file system keeps free for the journal, so that what is allowed to happen can be written.
const RESERVE_BYTES: u64 = 1 << 20;
/// Between two attempts to write what could not be written.
pub(super) const RETRY_PAUSE: Duration = Duration::from_millis(100);
/// Longest pause, where an attempt takes long.
const MOST_RETRY_PAUSE: Duration = Duration::from_secs(10);

/// The journal of a node, as it is written: lines are added to a file, for an ordinary thread.
///
/// Each line is with the operating system before what it tells is acknowledged, so a process that is
/// killed loses nothing that was; a power failure may cost what the system had not written to the disk. On
/// file systems that can, 1 MiB is reserved beyond the end of the file, so that a change is refused before
/// it happens if the disk has no room for its entry. What cannot be written is kept and tried again, and
/// changes are refused until it is written.
///
/// Where the file is renamed or removed while the node runs, another one of its name goes on within a second,
/// with all that the run has written so far.
#[derive(Debug)]
pub struct Journal {
    pub(super) path: PathBuf,
    pub(super) file: File,
    /// A regular file, which has a length; pipes and devices have none.
    pub(super) is_regular: bool,
    is_new: bool,
    pub(super) header: RunHeader,
    has_begun: bool,
    pub(super) has_ended: bool,
    pub(super) last_transaction: u64,
    has_cut_line: bool,
    /// Length of the file, in bytes.
    pub(super) written: u64,
    /// Where the run begins in the file, and its first line after the header.
    pub(super) run_begins: u64,
    pub(super) lines_begin: u64,
    /// Up to where room is reserved; `None`: the file system cannot.
    reserved: Option<u64>,
    pub(super) waiting: Vec<u8>,
    /// Whether the beginning of its first line is in the file.
    pub(super) has_begun_line: bool,
    /// How much of that is the line of the end, which comes last.
    end_bytes: usize,
    unwritten: Option<Arc<str>>,
    /// When it is tried again, while it cannot be written.
    tried_again: Option<Instant>,
}

impl Journal {
    /// Opens the file, or creates it, for a run of this plan. What it holds stays; a last line that a
    /// killed node has not finished is taken away.
    ///
    /// # Errors
    /// It cannot be written, another process writes it, or it holds something else than a journal.
    pub fn open(path: &Path, plan: &Plan) -> Result<Self, JournalError> {
        let name = || path.display().to_string();
        let write = |source| JournalError::Write { path: name(), source };
        let (file, is_new) = open(path).map_err(write)?;
        let is_regular = file.metadata().map_err(write)?.is_file();
        let mut journal = Self {
            path: path.to_owned(),
            is_regular,
            is_new,
            header: RunHeader {
                is_cut: false,
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
            run_begins: 0,
            lines_begin: 0,
            reserved: is_regular.then_some(0),
            waiting: Vec::new(),
            has_begun_line: false,
            end_bytes: 0,
            unwritten: None,
            tried_again: None,
            file,
        };
        if is_regular {
            journal.lock()?;
            journal.follow().map_err(|error| match error {
                FollowError::Journal(error) => error,
                FollowError::Io(source) => write(source),
            })?;
        }
        Ok(journal)
    }

    /// The same run in another file, which is to be followed. Until it goes on there, dropping it writes nothing:
    /// the file may be another's.
    ///
    /// # Errors
    /// It is no regular file, or another process writes it.
    pub(super) fn successor(&self, file: File) -> io::Result<Self> {
        if !file.metadata()?.is_file() {
            return Err(io::Error::other("there is something else than a file of this name now"));
        }
        let new = Self {
            path: self.path.clone(),
            file,
            is_regular: true,
            is_new: false,
            header: self.header.clone(),
            has_begun: true,
            has_ended: true,
            last_transaction: self.last_transaction,
            has_cut_line: false,
            written: 0,
            run_begins: 0,
            lines_begin: 0,
            reserved: Some(0),
            waiting: Vec::new(),
            has_begun_line: false,
            end_bytes: 0,
            unwritten: self.unwritten.clone(),
            tried_again: None,
        };
        Ok(new)
    }

    /// Keeps other processes from writing it.
    pub(super) fn lock(&self) -> Result<(), JournalError> {
        let path = || self.path.display().to_string();
        self.file.try_lock().map_err(|error| match error {
            fs::TryLockError::WouldBlock => JournalError::InUse { path: path() },
            fs::TryLockError::Error(source) => JournalError::Write { path: path(), source },
        })
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

    /// Goes to the end of what there is.
    pub(super) fn follow(&mut self) -> Result<(), FollowError> {
        let tail = Tail::read(&self.path)?;
        self.header.run = tail.run + 1;
        self.last_transaction = tail.transaction;
        self.has_cut_line = tail.is_cut;
        self.file.set_len(tail.bytes)?;
        if tail.is_open {
            self.file.write_all(b"\n")?;
        }
        self.written = tail.bytes + u64::from(tail.is_open);
        Ok(())
    }

    /// Writes that a run begins.
    pub(crate) fn begin(&mut self, started_unix_ns: u64) -> Result<(), JournalError> {
        self.header.started_unix_ns = started_unix_ns;
        self.header.after_transaction = Some(self.last_transaction);
        if let Err(source) = self.write_header().and_then(|()| self.reserve()) {
            self.truncate(self.run_begins);
            return Err(JournalError::Write { path: self.name(), source });
        }
        self.has_begun = true;
        Ok(())
    }

    /// Adds a line, with its end, and the transaction that it is of.
    pub(super) fn add(&mut self, line: &[u8], transaction: Option<u64>) {
        self.waiting.extend_from_slice(line);
        self.last_transaction = self.last_transaction.max(transaction.unwrap_or_default());
    }

    /// How much of what was added waits to be written.
    pub(super) fn waiting_bytes(&self) -> u64 {
        self.waiting.len().saturating_sub(self.end_bytes) as u64
    }

    /// Leaves it as it is: lines are lost that belong before an end.
    pub(super) fn abandon(&mut self) {
        self.has_ended = true;
    }

    /// Leaves out the rest of a line whose beginning was cut away with the file.
    pub(super) fn drop_begun_line(&mut self) {
        if std::mem::take(&mut self.has_begun_line) {
            let end = self.waiting.iter().position(|byte| *byte == b'\n');
            self.waiting.drain(..end.map_or(self.waiting.len(), |end| end + 1));
        }
    }

    /// Writes what waits, and sees to it that there is room for more. Whether it was tried: a full disk is
    /// asked again now and then, not each time that somebody looks.
    pub(crate) fn flush(&mut self) -> bool {
        let now = Instant::now();
        if self.tried_again.is_some_and(|due| now < due) {
            return false;
        }
        self.tried_again = None;
        let kept = self.keep_place();
        // What is not at its place is complete all the same; what is left of one that was cut may be another's.
        let written = if self.is_cut() { Ok(()) } else { self.write_waiting() };
        let written = kept.and(written).and_then(|()| self.reserve());
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
                // What takes long, as to write all of a long run anew, is tried less often.
                let pause = (now.elapsed() * 10).clamp(RETRY_PAUSE, MOST_RETRY_PAUSE);
                self.tried_again = Some(Instant::now() + pause);
            }
        }
        true
    }

    /// Writes that the run has ended, and gives back the room that is reserved. Returns why the file lacks
    /// something at its end, if it does: that is lost.
    pub(crate) fn end(&mut self, ended_unix_ns: u64) -> Option<Arc<str>> {
        if !self.has_begun || self.has_ended {
            return None;
        }
        let kept = self.keep_place();
        self.has_ended = true;
        let (run, last_transaction) = (self.header.run, Some(self.last_transaction));
        let end = Line::End(RunEnd { run, ended_unix_ns, last_transaction });
        let end = end.text().unwrap_or_default();
        self.end_bytes = end.len();
        self.waiting.extend(end);
        let written = if self.is_cut() {
            kept
        } else {
            // What is not at its place is complete all the same.
            let written = self.write_waiting();
            self.truncate(self.written);
            written
        };
        let path = self.path.display();
        written.err().map(|error| {
            format!("the journal {path} is incomplete: its end could not be written ({error})")
                .into()
        })
    }

    /// What the file lacks for good, as a sentence without its end.
    pub(super) fn lost(&self) -> Option<Arc<str>> {
        self.header.is_cut.then(|| self.lost_words().into())
    }

    /// Why changes are refused, as part of a sentence; `None`: all is written.
    pub(super) fn unwritten(&self) -> Option<&Arc<str>> {
        self.unwritten.as_ref()
    }

    fn write_waiting(&mut self) -> io::Result<()> {
        let mut done = 0;
        let result = loop {
            let Some(rest) = self.waiting.get(done..).filter(|rest| !rest.is_empty()) else {
                break Ok(());
            };
            match self.file.write(rest) {
                Ok(0) => break Err(ErrorKind::WriteZero.into()),
                Ok(bytes) => done += bytes,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => break Err(error),
            }
        };
        let last = done.checked_sub(1).and_then(|last| self.waiting.get(last));
        self.has_begun_line = last.map_or(self.has_begun_line, |last| *last != b'\n');
        self.waiting.drain(..done);
        self.written += done as u64;
        result
    }

    fn has_reserve(&self) -> bool {
        self.reserved.is_none_or(|reserved| reserved >= self.written + RESERVE_BYTES)
    }

    fn reserve(&mut self) -> io::Result<()> {
        if self.has_reserve() {
            return Ok(());
        }
        let (from, length) = (self.written, 2 * RESERVE_BYTES);
        match fallocate(&self.file, FallocateFlags::KEEP_SIZE, from, length) {
            Ok(()) => self.reserved = Some(from + length),
            Err(Errno::INTR) => {}
            Err(error @ (Errno::NOSPC | Errno::DQUOT | Errno::IO)) => return Err(error.into()),
            Err(_) => self.reserved = None,
        }
        Ok(())
    }

    /// Gives back what is beyond a length, reserved room included.
    pub(super) fn truncate(&mut self, length: u64) {
        if self.is_regular && self.file.set_len(length).is_ok() {
            self.written = length;
        }
    }
}

/// Opens a file that is added to; whether it is new.
pub(super) fn open(path: &Path) -> io::Result<(File, bool)> {
    let open = |is_new: bool| {
        let mut options = OpenOptions::new();
        // A pipe that nobody reads must hold up nothing.
        options.append(true).create_new(is_new).create(!is_new);
        options.custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)
    };
    match open(true) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok((open(false)?, false)),
        made => Ok((made?, true)),
    }
}

/// Why what there is cannot be followed.
#[derive(Debug, thiserror::Error)]
pub(super) enum FollowError {
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Io(#[from] io::Error),
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
