//! The thread that writes a journal: a disk that is slow holds up what waits to be acknowledged, and
//! nothing else.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use isochrone_engine::operate::Entry;
use isochrone_timing::CycleRecord;

use super::error::JournalError;
use super::line::Line;
use super::missed::Progress;
use super::write::{Journal, RETRY_PAUSE};
use crate::control::JournalEntry;

/// Most bytes that wait to be written. While there are more, no missed cycles are added; they are
/// unclear then.
const MOST_WAITING_BYTES: u64 = 1 << 20;
/// Between two looks whether the file is still at its place.
const LOOK_PAUSE: Duration = Duration::from_secs(1);
/// What takes longer is told, and changes are refused until it is over.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long a node's end waits for the disk.
const LAST_PATIENCE: Duration = Duration::from_secs(5);

/// A journal that is being written.
#[derive(Debug)]
pub(crate) struct Writing {
    name: String,
    lines: Option<Sender<Vec<u8>>>,
    thread: Option<JoinHandle<Journal>>,
    desk: Arc<Desk>,
    /// Lines and bytes that were handed to the thread.
    sent: u64,
    sent_bytes: u64,
    /// Since when there has been a line that the thread has not come to.
    behind_since: Option<(u64, Instant)>,
    progress: Vec<Progress>,
}

/// What the thread tells.
#[derive(Debug, Default)]
struct Desk {
    told: Mutex<Told>,
    has_told: Condvar,
}

#[derive(Debug, Clone, Default)]
struct Told {
    /// Lines that it has written, or could not write.
    tried: u64,
    written_bytes: u64,
    unwritten: Option<Arc<str>>,
    lost: Option<Arc<str>>,
}

impl Desk {
    fn lock(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Writing {
    /// Begins to write for a node of so many tasks.
    ///
    /// # Errors
    /// There is no thread for it.
    pub(crate) fn start(journal: Journal, tasks: usize) -> Result<Self, JournalError> {
        let (lines, taken) = channel();
        let (name, desk) = (journal.name(), Arc::new(Desk::default()));
        let told = Arc::clone(&desk);
        let work = move || write(journal, &taken, &told);
        let thread = thread::Builder::new().name("journal".to_owned()).spawn(work);
        let path = name.clone();
        let thread = thread.map_err(|source| JournalError::Thread { path, source })?;
        Ok(Self {
            name,
            lines: Some(lines),
            thread: Some(thread),
            desk,
            sent: 0,
            sent_bytes: 0,
            behind_since: None,
            progress: (0..tasks).map(|_| Progress::default()).collect(),
        })
    }

    /// Adds what was done to a task of this name. Returns the number of its line, which [`tried`](Self::tried)
    /// reaches before it is acknowledged; `None`: it is in no journal.
    pub(crate) fn note(&mut self, entry: &Entry, task: &str) -> Option<u64> {
        // What the program gives to inputs is no operator's doing.
        if entry.changes.is_empty() && entry.configuration.is_none() {
            return None;
        }
        let applied = entry.configuration.as_deref();
        let configuration = applied.map(|applied| applied.text.to_string());
        self.send(&Line::Entry(JournalEntry { configuration, ..JournalEntry::of(entry, task) }));
        Some(self.sent)
    }

    /// Takes note of a cycle, and adds those before it that were missed.
    pub(crate) fn note_cycle(&mut self, task: usize, name: &str, record: &CycleRecord) {
        let Some(progress) = self.progress.get_mut(task) else { return };
        // While there is nothing to tell, nobody is asked.
        if !progress.is_next(record) && self.waiting_bytes() > MOST_WAITING_BYTES {
            return;
        }
        let progress = self.progress.get_mut(task);
        if let Some(line) = progress.and_then(|progress| progress.note(name, record)) {
            self.send(&line);
        }
    }

    /// How many lines the thread has written, or could not write.
    pub(crate) fn tried(&self) -> u64 {
        self.desk.lock().tried
    }

    /// Why changes are refused, as part of a sentence; `None`: all is written.
    pub(crate) fn unwritten(&mut self) -> Option<Arc<str>> {
        let Told { tried, unwritten, .. } = self.desk.lock().clone();
        let began = self.behind_since.filter(|(at, _)| *at == tried).map(|(_, began)| began);
        let began = (tried < self.sent).then(|| began.unwrap_or_else(Instant::now));
        self.behind_since = began.map(|began| (tried, began));
        unwritten.or_else(|| {
            let is_slow = began.is_some_and(|began| began.elapsed() >= PATIENCE);
            let name = &self.name;
            is_slow.then(|| format!("the journal {name} has not been written for a second").into())
        })
    }

    /// What the file lacks for good, as a sentence without its end.
    pub(crate) fn lost(&self) -> Option<Arc<str>> {
        self.desk.lock().lost.clone()
    }

    /// Waits until all that was added is written or could not be; not for ever. Whether it is.
    pub(crate) fn wait(&self) -> bool {
        let is_behind = |told: &mut Told| told.tried < self.sent;
        let told =
            self.desk.has_told.wait_timeout_while(self.desk.lock(), LAST_PATIENCE, is_behind);
        !told.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    /// Writes that the run has ended. Returns why the file lacks something at its end, if it does: that is
    /// lost.
    pub(crate) fn end(mut self, ended_unix_ns: u64) -> Option<Arc<str>> {
        let is_written = self.wait();
        self.lines = None;
        let thread = self.thread.take().filter(|_| is_written);
        let Some(mut journal) = thread.and_then(|thread| thread.join().ok()) else {
            let (name, seconds) = (&self.name, LAST_PATIENCE.as_secs());
            let reason = format!("its end was not written within {seconds} s");
            return Some(format!("the journal {name} is incomplete: {reason}").into());
        };
        journal.end(ended_unix_ns)
    }

    fn waiting_bytes(&self) -> u64 {
        self.sent_bytes - self.desk.lock().written_bytes
    }

    fn send(&mut self, line: &Line) {
        let Some(text) = line.text() else { return };
        let bytes = text.len() as u64;
        // The thread ends with this end.
        if self.lines.as_ref().is_some_and(|lines| lines.send(text).is_ok()) {
            self.sent += 1;
            self.sent_bytes += bytes;
        }
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        self.lines = None;
        // The journal ends with its thread; one that hangs in the disk is left there.
        if self.thread.is_some() && self.wait() {
            let _ = self.thread.take().map(JoinHandle::join);
        }
    }
}

fn write(mut journal: Journal, lines: &Receiver<Vec<u8>>, desk: &Desk) -> Journal {
    let (mut taken, mut taken_bytes) = (0, 0);
    loop {
        let pause = if journal.unwritten().is_some() { RETRY_PAUSE } else { LOOK_PAUSE };
        let first = match lines.recv_timeout(pause) {
            Ok(line) => Some(line),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return journal,
        };
        for line in first.into_iter().chain(lines.try_iter()) {
            taken += 1;
            taken_bytes += line.len() as u64;
            journal.add(&line);
        }
        journal.flush();
        let mut told = desk.lock();
        told.tried = taken;
        told.written_bytes = taken_bytes - journal.waiting_bytes();
        told.unwritten = journal.unwritten().cloned();
        told.lost = journal.lost();
        drop(told);
        desk.has_told.notify_all();
    }
}
