//! Writing a journal file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use isochrone_engine::Plan;
use isochrone_engine::operate::Entry;
use isochrone_timing::CycleRecord;
use rustix::fs::{FallocateFlags, OFlags, fallocate};
use rustix::io::Errno;

use super::error::JournalError;
use super::line::{FORMAT, Line, RunEnd, RunHeader};
use super::missed::Progress;
use super::read::scan;
use crate::control::JournalEntry;
use crate::operating::unix_ns;

/// What a file system keeps free for the journal, so that what is allowed to happen can be written.
const RESERVE_BYTES: u64 = 1 << 20;
/// Most bytes that wait to be written. While there are more, no missed cycles are added; they are
/// unclear then.
const MOST_WAITING_BYTES: usize = 1 << 20;
/// Between two attempts to write what could not be written.
const RETRY_PAUSE: Duration = Duration::from_millis(100);

/// The journal of a node, as it is written: lines are added to a file, for an ordinary thread.
///
/// Each line is with the operating system before what it tells is acknowledged, so a process that is
/// killed loses nothing that was; a power failure may cost what the system had not written to the disk. On
/// file systems that can, 1 MiB is reserved beyond the end of the file, so that a change is refused before
/// it happens if the disk has no room for its entry. What cannot be written is kept and tried again, and
/// changes are refused until it is written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// A regular file, which has a length; pipes and devices have none.
    is_regular: bool,
    is_new: bool,
    header: RunHeader,
    has_begun: bool,
    has_ended: bool,
    last_transaction: u64,
    has_cut_line: bool,
    /// Length of the file, in bytes.
    written: u64,
    /// Up to where room is reserved; `None`: the file system cannot.
    reserved: Option<u64>,
    waiting: Vec<u8>,
    unwritten: Option<Arc<str>>,
    /// When it could not be written last, while that is so.
    failed: Option<Instant>,
    progress: Vec<Progress>,
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
        let open = |is_new: bool| {
            let mut options = OpenOptions::new();
            // A pipe that nobody reads must hold up nothing.
            options.append(true).create_new(is_new).create(!is_new);
            options.custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)
        };
        let (file, is_new) = match open(true) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => (open(false), false),
            made => (made, true),
        };
        let file = file.map_err(write)?;
        let is_regular = file.metadata().map_err(write)?.is_file();
        let mut journal = Self {
            path: path.to_owned(),
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
            },
            has_begun: false,
            has_ended: false,
            last_transaction: 0,
            has_cut_line: false,
            written: 0,
            reserved: is_regular.then_some(0),
            waiting: Vec::new(),
            unwritten: None,
            failed: None,
            progress: plan.tasks.iter().map(|_| Progress::default()).collect(),
            file,
        };
        if is_regular {
            journal.file.try_lock().map_err(|error| match error {
                fs::TryLockError::WouldBlock => JournalError::InUse { path: name() },
                fs::TryLockError::Error(source) => write(source),
            })?;
            journal.follow().map_err(|error| match error {
                FollowError::Journal(error) => error,
                FollowError::Io(source) => write(source),
            })?;
        }
        Ok(journal)
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
    fn follow(&mut self) -> Result<(), FollowError> {
        let (mut run, mut transaction) = (0, 0);
        let end = scan(&self.path, |_, line| match line {
            Line::Run(header) => run = run.max(header.run),
            Line::Entry(entry) => transaction = transaction.max(entry.transaction),
            Line::Missed(_) | Line::Unclear(_) | Line::End(_) => {}
        })?;
        self.header.run = run + 1;
        self.last_transaction = transaction;
        self.has_cut_line = end.cut_line.is_some();
        self.file.set_len(end.bytes)?;
        if end.is_open {
            self.file.write_all(b"\n")?;
        }
        self.written = end.bytes + u64::from(end.is_open);
        Ok(())
    }

    /// Writes that a run begins.
    pub(crate) fn begin(&mut self, started_unix_ns: u64) -> Result<(), JournalError> {
        self.header.started_unix_ns = started_unix_ns;
        let before = self.written;
        self.put(&Line::Run(self.header.clone()));
        if let Err(source) = self.write_waiting().and_then(|()| self.reserve()) {
            self.waiting.clear();
            self.truncate(before);
            let path = self.path.display().to_string();
            return Err(JournalError::Write { path, source });
        }
        self.has_begun = true;
        Ok(())
    }

    /// Adds what was done to a task of this name.
    pub(crate) fn note(&mut self, entry: &Entry, task: &str) {
        // What the program gives to inputs is in no journal.
        if !entry.changes.is_empty() || entry.configuration.is_some() {
            let applied = entry.configuration.as_deref();
            let configuration = applied.map(|applied| applied.text.to_string());
            self.put(&Line::Entry(JournalEntry { configuration, ..JournalEntry::of(entry, task) }));
            self.flush();
        }
    }

    /// Takes note of a cycle, and adds those before it that were missed.
    pub(crate) fn note_cycle(&mut self, task: usize, name: &str, record: &CycleRecord) {
        if self.waiting.len() > MOST_WAITING_BYTES {
            return;
        }
        let progress = self.progress.get_mut(task);
        if let Some(line) = progress.and_then(|progress| progress.note(name, record)) {
            self.put(&line);
        }
    }

    /// Writes what waits, and sees to it that there is room for more.
    pub(crate) fn flush(&mut self) {
        let is_idle = self.waiting.is_empty() && self.unwritten.is_none() && self.has_reserve();
        // A full disk is asked again now and then, not each time that somebody looks.
        let is_too_soon = self.failed.is_some_and(|failed| failed.elapsed() < RETRY_PAUSE);
        if is_idle || is_too_soon {
            return;
        }
        self.failed = None;
        let written = self.write_waiting().and_then(|()| self.reserve());
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
                self.failed = Some(Instant::now());
            }
        }
    }

    /// Writes that the run has ended, and gives back the room that is reserved. Returns why the file lacks
    /// something at its end, if it does: that is lost.
    pub(crate) fn end(&mut self, ended_unix_ns: u64) -> Option<Arc<str>> {
        if !self.has_begun || self.has_ended {
            return None;
        }
        self.has_ended = true;
        self.put(&Line::End(RunEnd { run: self.header.run, ended_unix_ns }));
        let written = self.write_waiting();
        self.truncate(self.written);
        let path = self.path.display();
        written.err().map(|error| {
            format!("the journal {path} is incomplete: its end could not be written ({error})")
                .into()
        })
    }

    /// Why changes are refused, as part of a sentence; `None`: all is written.
    pub(crate) fn unwritten(&self) -> Option<&Arc<str>> {
        self.unwritten.as_ref()
    }

    fn put(&mut self, line: &Line) {
        let length = self.waiting.len();
        match serde_json::to_writer(&mut self.waiting, line) {
            Ok(()) => self.waiting.push(b'\n'),
            // Which no line does.
            Err(_) => self.waiting.truncate(length),
        }
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
    fn truncate(&mut self, length: u64) {
        if self.is_regular && self.file.set_len(length).is_ok() {
            self.written = length;
        }
    }
}

/// Why what there is cannot be followed.
#[derive(Debug, thiserror::Error)]
enum FollowError {
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
