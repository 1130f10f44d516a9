//! The thread that writes a journal: a slow disk delays acknowledgements, and nothing else.

use std::error::Error;
use std::panic::{self, AssertUnwindSafe};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use isochrone_control::desk::Unwritten;
use isochrone_model::Entry;

use super::error::JournalError;
use super::line::Line;
use super::write::Journal;
use crate::task::clocks::unix_ns;
use crate::task::panics;

/// Pause after a failed attempt to write: ten times as long as the attempt took.
const RETRY_PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(10)];
/// A write that takes longer is reported, and changes are refused until it is done.
const PATIENCE: Duration = Duration::from_secs(1);
/// How long the end of a node waits for the disk, in total.
const LAST_PATIENCE: Duration = Duration::from_secs(5);

/// A journal that is being written.
#[derive(Debug)]
pub(crate) struct Writing {
    name: String,
    jobs: Sender<Job>,
    thread: Option<JoinHandle<()>>,
    shared: Arc<SharedState>,
    /// Position of the end of the last line that was sent to the thread.
    sent: Mark,
    /// Since when a line has waited for the thread.
    behind_since: Option<(u64, Instant)>,
    /// Until when to wait for the end that was requested.
    ends_until: Option<Instant>,
}

/// Position of the end of a line among all lines sent to the thread.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Mark {
    lines: u64,
    bytes: u64,
}

/// A job for the thread.
enum Job {
    Write { line: Vec<u8>, transaction: u64 },
    End { ended_unix_ns: u64 },
}

/// A report from the thread.
#[derive(Debug, Default)]
struct SharedState {
    state: Mutex<WriterState>,
    has_changed: Condvar,
}

#[derive(Debug, Clone, Default)]
struct WriterState {
    /// The last transaction of earlier runs in the file; 0 before it is open.
    last_transaction: u64,
    /// How many lines it has tried to write.
    tried: u64,
    written_bytes: u64,
    unwritten: Option<Unwritten>,
    /// It has stopped writing.
    end: Option<End>,
}

/// How the thread ended.
#[derive(Debug, Clone)]
struct End {
    /// Why the file lacks lines at its end, if it does.
    incomplete: Option<Arc<str>>,
}

/// The progress of the thread.
#[derive(Debug, Clone)]
pub(crate) struct WriterProgress {
    /// The last transaction of earlier runs in the file, as far as that is known.
    pub(crate) last_transaction: u64,
    tried: u64,
    written_bytes: u64,
    /// Whether to stop waiting for it.
    is_given_up: bool,
    /// Why changes are refused; `None`: all is written, or that is not known yet.
    pub(crate) unwritten: Option<Unwritten>,
}

/// The state of a line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fate {
    /// It waits for the thread.
    Waits,
    /// It is in the file.
    Written,
    /// It is not in the file yet.
    Unwritten(Unwritten),
}

impl WriterProgress {
    /// The state of the line that ends at this position.
    pub(crate) fn fate(&self, mark: Mark) -> Fate {
        match &self.unwritten {
            _ if mark.bytes <= self.written_bytes => Fate::Written,
            Some(why) if self.is_given_up || mark.lines <= self.tried => {
                Fate::Unwritten(why.clone())
            }
            _ => Fate::Waits,
        }
    }
}

impl SharedState {
    /// Notes that the journal of this name cannot be opened; in words.
    fn fail(&self, name: &str, cause: &str) -> Arc<str> {
        let reason: Arc<str> = format!("the journal {name} cannot be opened ({cause})").into();
        tracing::error!("{reason}; changes are refused until the node is started again");
        self.lock().unwritten = Some(Unwritten::ForGood(Arc::clone(&reason)));
        reason
    }

    fn lock(&self) -> MutexGuard<'_, WriterState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Writing {
    /// Starts the thread, which first opens the journal of this name.
    ///
    /// # Errors
    /// The thread could not be started.
    pub(crate) fn start(
        name: String,
        open: impl FnOnce() -> Result<Journal, JournalError> + Send + 'static,
    ) -> Result<Self, JournalError> {
        let (jobs, taken) = channel();
        let shared = Arc::new(SharedState::default());
        let of_thread = Arc::clone(&shared);
        let of_journal = name.clone();
        let thread = thread::Builder::new().name("journal".to_owned());
        let thread = thread.spawn(move || work(&of_journal, open, &taken, &of_thread));
        let path = name.clone();
        let thread = thread.map_err(|source| JournalError::Thread { path, source })?;
        Ok(Self::of(name, jobs, Some(thread), shared))
    }

    /// One that could not be started: changes are refused.
    pub(crate) fn failed(name: String, error: &JournalError) -> Self {
        let shared = Arc::new(SharedState::default());
        let incomplete = Some(shared.fail(&name, &cause_of(error)));
        shared.lock().end = Some(End { incomplete });
        Self::of(name, channel().0, None, shared)
    }

    fn of(
        name: String,
        jobs: Sender<Job>,
        thread: Option<JoinHandle<()>>,
        shared: Arc<SharedState>,
    ) -> Self {
        let sent = Mark::default();
        Self { name, jobs, thread, shared, sent, behind_since: None, ends_until: None }
    }

    /// Adds an entry. Returns the position of the end of its line, for [`fate`](WriterProgress::fate); `None`: the
    /// entry is not journaled.
    pub(crate) fn note(&mut self, entry: &Entry) -> Option<Mark> {
        let line = Line::of_entry(entry)?.text()?;
        self.sent.lines += 1;
        self.sent.bytes += line.len() as u64;
        // A thread that panicked never writes it, and has reported that.
        let _ = self.jobs.send(Job::Write { line, transaction: entry.transaction });
        Some(self.sent)
    }

    /// The progress of the thread, without waiting for it.
    pub(crate) fn progress(&mut self) -> WriterProgress {
        let WriterState { last_transaction, tried, written_bytes, unwritten, end } =
            self.shared.lock().clone();
        let began = self.behind_since.filter(|(at, _)| *at == tried).map(|(_, began)| began);
        let began = (tried < self.sent.lines).then(|| began.unwrap_or_else(Instant::now));
        self.behind_since = began.map(|began| (tried, began));
        let is_slow = began.is_some_and(|began| began.elapsed() >= PATIENCE);
        let slow = || {
            let reason = format!("the journal {} has not been written for a second", self.name);
            Unwritten::ForNow(reason.into())
        };
        let is_given_up = is_slow || end.is_some();
        let unwritten = unwritten.or_else(|| is_slow.then(slow));
        WriterProgress { last_transaction, tried, written_bytes, is_given_up, unwritten }
    }

    /// Makes the thread write the end of the run after all entries. Further calls do nothing.
    pub(crate) fn begin_end(&mut self, ended_unix_ns: u64) {
        if self.ends_until.is_none() {
            self.ends_until = Some(Instant::now() + LAST_PATIENCE);
            // A thread that panicked has reported that.
            let _ = self.jobs.send(Job::End { ended_unix_ns });
        }
    }

    /// Waits until the end of the run is written, up to 5 s after that was requested. If the file lacks lines at its
    /// end, which are lost then, returns the reason.
    pub(crate) fn end(mut self, ended_unix_ns: u64) -> Option<Arc<str>> {
        self.begin_end(ended_unix_ns);
        self.await_end()
    }

    /// Leaves it to its thread, which writes nothing any more.
    pub(crate) fn leave(mut self) {
        self.thread = None;
    }

    fn await_end(&mut self) -> Option<Arc<str>> {
        let Some(thread) = self.thread.take() else {
            return self.shared.lock().end.clone()?.incomplete;
        };
        let now = Instant::now();
        let patience = self.ends_until.unwrap_or(now).saturating_duration_since(now);
        let writes = |state: &mut WriterState| state.end.is_none();
        let state =
            self.shared.has_changed.wait_timeout_while(self.shared.lock(), patience, writes);
        let end = state.unwrap_or_else(PoisonError::into_inner).0.end.clone();
        let Some(End { incomplete }) = end else {
            // It hangs in a disk access, and is left there.
            let (name, seconds) = (&self.name, LAST_PATIENCE.as_secs());
            let reason = format!("its end was not written within {seconds} s");
            return Some(format!("the journal {name} is incomplete: {reason}").into());
        };
        // Its last report is the last thing that it does.
        let _ = thread.join();
        incomplete
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        if self.thread.is_some() {
            self.begin_end(unix_ns());
            if let Some(reason) = self.await_end() {
                tracing::error!("{reason}");
            }
        }
    }
}

/// The body of the thread.
fn work(
    name: &str,
    open: impl FnOnce() -> Result<Journal, JournalError>,
    jobs: &Receiver<Job>,
    shared: &SharedState,
) {
    let opened = panic::catch_unwind(AssertUnwindSafe(open));
    let incomplete = match opened {
        Ok(Ok(journal)) => {
            shared.lock().last_transaction = journal.last_transaction();
            write_guarded(journal, jobs, shared)
        }
        Ok(Err(error)) => Some(shared.fail(name, &cause_of(&error))),
        Err(panic) => Some(shared.fail(name, &panics::message(&*panic))),
    };
    shared.lock().end = Some(End { incomplete });
    shared.has_changed.notify_all();
}

/// What the system said, or all that is known.
fn cause_of(error: &JournalError) -> String {
    error.source().map_or_else(|| error.to_string(), ToString::to_string)
}

/// Writes entries until the end of the run, also if that panics. The file is unlocked at the end. If it lacks lines,
/// returns the reason.
fn write_guarded(
    mut journal: Journal,
    jobs: &Receiver<Job>,
    shared: &SharedState,
) -> Option<Arc<str>> {
    let name = journal.name();
    let written = panic::catch_unwind(AssertUnwindSafe(|| write(&mut journal, jobs, shared)));
    written.unwrap_or_else(|panic| {
        // The lines that it had taken are lost, so the run gets no end line.
        journal.abandon();
        let message = panics::message(&*panic);
        let why = format!("the thread that writes it panicked: {message}");
        let reason = format!("the journal {name} cannot be written ({why})");
        shared.lock().unwritten = Some(Unwritten::ForGood(reason.into()));
        Some(format!("the journal {name} is incomplete: {why}").into())
    })
}

/// The same. If the file lacks lines at its end, returns the reason.
fn write(journal: &mut Journal, jobs: &Receiver<Job>, shared: &SharedState) -> Option<Arc<str>> {
    let mut taken = Mark::default();
    let mut pause = Duration::ZERO;
    loop {
        let next = match journal.unwritten() {
            Some(_) => jobs.recv_timeout(pause),
            None => jobs.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        let first = match next {
            Ok(job) => Some(job),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return journal.end(unix_ns()),
        };
        let mut end = None;
        for job in first.into_iter().chain(jobs.try_iter()) {
            match job {
                Job::Write { line, transaction } => {
                    taken.lines += 1;
                    taken.bytes += line.len() as u64;
                    journal.add(&line, transaction);
                }
                Job::End { ended_unix_ns } => end = Some(ended_unix_ns),
            }
        }
        let incomplete = end.map(|ended_unix_ns| journal.end(ended_unix_ns));
        if incomplete.is_none() {
            let began = Instant::now();
            journal.flush();
            let [least, most] = RETRY_PAUSES;
            pause = (began.elapsed() * 10).clamp(least, most);
        }
        let mut state = shared.lock();
        state.tried = taken.lines;
        state.written_bytes = taken.bytes.saturating_sub(journal.waiting_bytes());
        state.unwritten = match &incomplete {
            Some(incomplete) => incomplete.clone().map(Unwritten::ForGood),
            None => journal.unwritten().cloned().map(Unwritten::ForNow),
        };
        drop(state);
        if let Some(incomplete) = incomplete {
            return incomplete;
        }
    }
}
