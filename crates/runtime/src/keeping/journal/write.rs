//! Writing a journal file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isochrone_engine::{Plan, Source};
use rustix::fs::OFlags;

use super::error::JournalError;
use super::line::{FORMAT, Line, RunEnd, RunHeader};
use super::tail::Tail;
use crate::keeping::guard::WriteGuard;
use crate::keeping::output_file::open_output;
use crate::task::clocks::unix_ns;

/// A longer file is rotated out. The text of the configuration does not count, as that may be longer by itself.
pub(super) const LARGEST_BYTES: u64 = 16 << 20;

/// The journal of a node that is being written: an ordinary thread appends lines to a file.
///
/// A change is acknowledged after the operating system has taken its line, so a process that is killed loses nothing
/// that was acknowledged; a power failure may lose what the system had not written to the disk yet. Lines that cannot
/// be written are kept and tried again, and changes are refused until they are written.
///
/// A file that has grown to 16 MiB is renamed to `FILE.1`, an older one of that name to `FILE.2`, and so on up to
/// `FILE.8`. The next file begins with the run again. A file that somebody else has renamed or removed is
/// followed by another one in the same way.
#[derive(Debug)]
pub struct Journal {
    /// As given by the user.
    pub(super) path: PathBuf,
    /// The target of the path when it was opened.
    pub(super) place: PathBuf,
    pub(super) file: File,
    /// Whether it is a regular file, which has a length; pipes and devices have none.
    pub(super) is_regular: bool,
    is_new: bool,
    pub(super) header: RunHeader,
    has_begun: bool,
    has_ended: bool,
    pub(super) last_transaction: u64,
    has_cut_line: bool,
    /// Length of the file, and the length from which it is rotated out, in bytes.
    pub(super) written: u64,
    pub(super) full_at: u64,
    waiting: Vec<u8>,
    /// The last transaction of the lines that wait.
    waiting_transaction: u64,
    unwritten: Option<Arc<str>>,
    pub(crate) guard: WriteGuard,
}

/// The journal that one of two processes of a node goes on with when it takes over.
#[derive(Clone)]
pub(crate) struct JournalAtTakeover {
    path: PathBuf,
    node: String,
    source: Source,
}

impl JournalAtTakeover {
    pub(crate) fn new(path: &Path, plan: &Plan) -> Self {
        Self { path: path.to_owned(), node: plan.node.clone(), source: plan.source.clone() }
    }

    /// Has it begin with another configuration.
    pub(crate) fn change_over(&mut self, source: &Source) {
        self.source = source.clone();
    }

    /// Its path, as it was given.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Opens it, as [`Journal::open_beside_twin`] does, and begins a run in it.
    pub(crate) fn open(&self, guard: WriteGuard) -> Result<Journal, JournalError> {
        let mut journal = Journal::open_locked(&self.path, &self.node, &self.source, Some(guard))?;
        journal.begin(unix_ns())?;
        Ok(journal)
    }
}

impl Journal {
    /// Opens the file, or creates it, for a run of this plan. Its contents stay; an incomplete last line, which a
    /// killed node leaves, is removed.
    ///
    /// # Errors
    /// It cannot be written, another process writes it, or it is not a journal.
    pub fn open(path: &Path, plan: &Plan) -> Result<Self, JournalError> {
        Self::open_locked(path, &plan.node, &plan.source, None)
    }

    /// As [`open`](Self::open), for one of two processes of a node: also if the other one, which may be stopped, has it
    /// open. Only the one that holds the node writes to it.
    ///
    /// # Errors
    /// As `open`.
    pub fn open_beside_twin(path: &Path, plan: &Plan) -> Result<Self, JournalError> {
        Self::open_locked(path, &plan.node, &plan.source, Some(WriteGuard::default()))
    }

    /// `beside_twin`: not locked, as this guard says who writes.
    fn open_locked(
        path: &Path,
        node: &str,
        source: &Source,
        beside_twin: Option<WriteGuard>,
    ) -> Result<Self, JournalError> {
        let write = |source| JournalError::Write { path: path.display().to_string(), source };
        let is_locked = beside_twin.is_none();
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
                node: node.to_owned(),
                version: env!("CARGO_PKG_VERSION").to_owned(),
                file: source.name.clone(),
                sha256: source.sha256(),
                started_unix_ns: 0,
                configuration: Some(source.text.to_string()),
                after_transaction: None,
                term: None,
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
            guard: beside_twin.unwrap_or_default(),
            file,
        };
        if journal.is_regular {
            let tail = if is_locked { Tail::take } else { Tail::read };
            let tail = tail(&journal.file, path)?;
            if !journal.guard.allows() {
                return Ok(journal);
            }
            journal.header.run = tail.run + 1;
            journal.last_transaction = tail.transaction;
            journal.has_cut_line = tail.is_cut;
            journal.written = tail.trim(&journal.file).map_err(write)?;
        }
        Ok(journal)
    }

    /// Its path, as it was given.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Number of the run that is written, from 1.
    pub fn run(&self) -> u64 {
        self.header.run
    }

    /// Whether the file had an incomplete last line, which was removed: a node was killed while writing it.
    pub fn had_cut_line(&self) -> bool {
        self.has_cut_line
    }

    /// The last transaction of earlier runs; 0 if there is none.
    pub(crate) fn last_transaction(&self) -> u64 {
        self.last_transaction
    }

    /// Writes the header line of the run.
    pub(crate) fn begin(&mut self, started_unix_ns: u64) -> Result<(), JournalError> {
        if !self.guard.allows() {
            return Ok(());
        }
        self.header.started_unix_ns = started_unix_ns;
        self.header.term = self.guard.term();
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

    /// Adds a line, including its newline, of a transaction.
    pub(super) fn add(&mut self, line: &[u8], transaction: u64) {
        self.waiting.extend_from_slice(line);
        self.waiting_transaction = transaction;
    }

    /// How many bytes wait to be written.
    pub(super) fn waiting_bytes(&self) -> u64 {
        self.waiting.len() as u64
    }

    /// Stops writing: as lines were lost, an end line would be wrong.
    pub(super) fn abandon(&mut self) {
        self.has_ended = true;
    }

    /// Writes the lines that wait.
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

    /// Writes the end line of the run. If the file lacks lines at its end, which are lost then, returns the reason.
    pub(crate) fn end(&mut self, ended_unix_ns: u64) -> Option<Arc<str>> {
        if !self.has_begun || self.has_ended {
            return None;
        }
        self.has_ended = true;
        let written = self.write_waiting().and_then(|()| {
            if !self.guard.allows() {
                return Ok(());
            }
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

    /// Why changes are refused, as part of a sentence; `None` if all lines are written.
    pub(super) fn unwritten(&self) -> Option<&Arc<str>> {
        self.unwritten.as_ref()
    }

    fn write_waiting(&mut self) -> io::Result<()> {
        if !self.guard.allows() {
            // The other process of the node has taken over, and writes what is done from now on.
            self.waiting.clear();
            self.abandon();
            return Ok(());
        }
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

    /// Writes bytes and removes them from the buffer: all of them or, to a regular file, none.
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

impl Drop for Journal {
    fn drop(&mut self) {
        if !self.has_begun {
            if self.is_new && self.is_regular && self.guard.allows() {
                // If it cannot be removed, it stays, empty.
                let _ = fs::remove_file(&self.path);
            }
            return;
        }
        if let Some(reason) = self.end(unix_ns()) {
            tracing::error!("{reason}");
        }
    }
}

/// Opens a file for appending; whether it is new.
pub(super) fn open(path: &Path) -> io::Result<(File, bool)> {
    let open = |is_new: bool| {
        let mut options = OpenOptions::new();
        // A pipe that nobody reads must not block the node.
        options.append(true).create_new(is_new).create(!is_new);
        open_output(path, &options, OFlags::NONBLOCK.bits() as i32)
    };
    match open(true) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok((open(false)?, false)),
        made => Ok((made?, true)),
    }
}
