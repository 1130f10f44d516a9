//! The thread that writes a recording: a disk that is slow, full or gone holds up nothing else.

use std::collections::VecDeque;
use std::panic::{self, AssertUnwindSafe};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::operate;
use isochrone_recording::{ChannelId, Entry, Node, RowHead, TaskLayout, WriteError, Writer};

use super::{Capture, RecordingFile, RecordingOutcome};
use crate::clocks::read_clocks;
use crate::journal::Line;
use crate::panics;
use crate::rows::Place;

/// Between two looks at the rings.
const TURN: Duration = Duration::from_millis(20);
/// How often everything is handed to the system.
const FLUSH: Duration = Duration::from_secs(1);
/// Unix time that moved against the monotonic clock by so much was set.
const SET_NS: u64 = 1_000_000;
/// Entries of the journal that may wait: so many are changed in minutes, by programs.
const MOST_ENTRIES: u64 = 10_000;
/// How long a node's end waits for the disk.
const LAST_PATIENCE: Duration = Duration::from_secs(5);

/// A recording that is being written. Dropping it ends it.
pub(crate) struct Recording {
    jobs: Option<Sender<Job>>,
    desk: Arc<Desk>,
    file: String,
    sent_entries: u64,
    lost_entries: u64,
}

enum Job {
    Rows { task: usize, capture: Capture },
    Entry(Entry),
    End(Ends),
}

/// For each task its last cycle, as far as it is known.
type Ends = Vec<Option<Place>>;

#[derive(Default)]
struct Desk {
    told: Mutex<Told>,
    has_ended: Condvar,
}

#[derive(Default)]
struct Told {
    outcome: RecordingOutcome,
    tried_entries: u64,
    /// Of the first task.
    last_cycle: u64,
    has_ended: bool,
}

impl Desk {
    fn lock(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Recording {
    /// Begins a file, and the thread that writes it.
    ///
    /// # Errors
    /// It cannot be written, or there is no thread.
    pub(crate) fn start(
        file: String,
        out: impl RecordingFile,
        node: &Node,
        configuration: &str,
    ) -> Result<Self, WriteError> {
        let writer = Writer::create_for_node(out, read_clocks(), node, configuration)?;
        let (jobs, taken) = channel();
        let desk = Arc::<Desk>::default();
        let told = Arc::clone(&desk);
        desk.lock().outcome.file.clone_from(&file);
        let work = move || work(writer, &taken, &told);
        let thread = thread::Builder::new().name("recording".to_owned());
        thread.spawn(work).map_err(WriteError::Io)?;
        Ok(Self { jobs: Some(jobs), desk, file, sent_entries: 0, lost_entries: 0 })
    }

    /// Writes the rows that come, after those of the same task that came before.
    pub(crate) fn add(&self, task: usize, capture: Capture) {
        self.send(Job::Rows { task, capture });
    }

    /// Adds what was done to a task of this name.
    pub(crate) fn note(&mut self, entry: &operate::Entry, task: &str) {
        let Some(line) = Line::of_entry(entry, task).and_then(|line| line.json()) else { return };
        if self.sent_entries - self.desk.lock().tried_entries >= MOST_ENTRIES {
            self.lost_entries += 1;
            return;
        }
        self.sent_entries += 1;
        let (time_ns, task) = (Monotonic.now_ns(), task.to_owned());
        self.send(Job::Entry(Entry { time_ns, cycle: entry.cycle, task, line }));
    }

    /// Why it has ended, in a sentence, and the last cycle of the first task in it.
    pub(crate) fn trouble(&self) -> Option<(String, u64)> {
        let told = self.desk.lock();
        Some((told.outcome.incomplete.clone()?, told.last_cycle))
    }

    /// Ends the file, when no cycle runs any more, and tells what is in it. Waits for the disk up to 5 s.
    pub(crate) fn end(mut self, ends: Vec<Option<Place>>) -> RecordingOutcome {
        let ran: u64 = ends.iter().flatten().map(|last| last.ran()).sum();
        let (outcome, has_ended) = self.await_end(ends);
        let mut outcome = outcome;
        outcome.lost = ran.saturating_sub(outcome.cycles);
        let file = &self.file;
        if !has_ended {
            let seconds = LAST_PATIENCE.as_secs();
            outcome.incomplete = Some(format!(
                "the recording {file} is incomplete: its end was not written within {seconds} s"
            ));
        }
        if outcome.incomplete.is_none() && outcome.lost + self.lost_entries > 0 {
            let (lost, entries) = (outcome.lost, self.lost_entries);
            outcome.incomplete = Some(format!(
                "the recording {file} lacks {lost} cycles and {entries} entries of the journal: they came \
                 faster than they could be written"
            ));
        }
        outcome
    }

    fn await_end(&mut self, ends: Ends) -> (RecordingOutcome, bool) {
        self.send(Job::End(ends));
        self.jobs = None;
        let writes = |told: &mut Told| !told.has_ended;
        let told = self.desk.has_ended.wait_timeout_while(self.desk.lock(), LAST_PATIENCE, writes);
        let told = told.unwrap_or_else(PoisonError::into_inner).0;
        (told.outcome.clone(), told.has_ended)
    }

    fn send(&self, job: Job) {
        // A thread that has ended has said why.
        let _ = self.jobs.as_ref().map(|jobs| jobs.send(job));
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        if self.jobs.is_some() {
            self.await_end(Vec::new());
        }
    }
}

/// What the thread does, from its beginning to its end.
fn work<F: RecordingFile>(writer: Writer<F>, jobs: &Receiver<Job>, desk: &Desk) {
    let mut writing =
        Writing { writer, desk, tasks: Vec::new(), given: 0, flushed: Instant::now() };
    let written = panic::catch_unwind(AssertUnwindSafe(|| writing.run(jobs)));
    let Writing { writer, given, .. } = writing;
    let why = match written {
        Ok(Ok(())) => match writer.finish() {
            Ok(_) => None,
            Err((error, failed)) => Some((error.to_string(), failed)),
        },
        Ok(Err(error)) => Some((error.to_string(), writer.give_up())),
        Err(panic) => {
            let words = panics::words(&*panic);
            Some((format!("the thread that writes it panicked: {words}"), writer.give_up()))
        }
    };
    let failed = why.map(|(why, mut failed)| {
        failed.out.cut(failed.good_bytes);
        (why, failed.good_bytes, given.saturating_sub(failed.lost_frames))
    });
    let mut told = desk.lock();
    if let Some((why, bytes, cycles)) = failed {
        let outcome = &mut told.outcome;
        (outcome.cycles, outcome.bytes) = (cycles, bytes);
        let file = &outcome.file;
        let sentence = format!(
            "the recording {file} cannot be written ({why}): it ends there, and the node goes on without it"
        );
        tracing::error!("{sentence}");
        outcome.incomplete = Some(sentence);
    }
    told.has_ended = true;
    desk.has_ended.notify_all();
}

struct Writing<'a, F: RecordingFile> {
    writer: Writer<F>,
    desk: &'a Desk,
    tasks: Vec<Task>,
    /// Rows that the writer was given.
    given: u64,
    flushed: Instant,
}

/// The rows of a task.
#[derive(Default)]
struct Task {
    /// The first is of the configuration that the task has, or had; the others follow.
    captures: VecDeque<Capture>,
    channel: Option<ChannelId>,
    row: Vec<f64>,
    last: Option<Place>,
}

impl<F: RecordingFile> Writing<'_, F> {
    fn run(&mut self, jobs: &Receiver<Job>) -> Result<(), WriteError> {
        loop {
            let mut ends = match jobs.recv_timeout(TURN) {
                Ok(job) => self.take(job)?,
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => Some(Vec::new()),
            };
            while let Ok(job) = jobs.try_recv() {
                ends = ends.or(self.take(job)?);
            }
            for index in 0..self.tasks.len() {
                self.write_rows(index)?;
            }
            if let Some(ends) = ends {
                self.mark_ends(&ends)?;
                // So that the length of the file is known.
                self.writer.flush()?;
                self.desk.lock().outcome.bytes = self.writer.bytes();
                return Ok(());
            }
            if self.flushed.elapsed() >= FLUSH {
                self.flushed = Instant::now();
                let now = read_clocks();
                if now.moved_ns(self.writer.clock()) > SET_NS {
                    self.writer.set_clock(now)?;
                }
                self.writer.flush()?;
                self.desk.lock().outcome.bytes = self.writer.bytes();
            }
        }
    }

    fn take(&mut self, job: Job) -> Result<Option<Ends>, WriteError> {
        match job {
            Job::Rows { task, capture } => {
                if self.tasks.len() <= task {
                    self.tasks.resize_with(task + 1, Task::default);
                }
                if let Some(task) = self.tasks.get_mut(task) {
                    task.captures.push_back(capture);
                }
            }
            Job::Entry(entry) => {
                let written = self.writer.write_entry(&entry);
                let mut told = self.desk.lock();
                told.tried_entries += 1;
                told.outcome.entries += u64::from(written.is_ok());
                drop(told);
                written?;
            }
            Job::End(ends) => return Ok(Some(ends)),
        }
        Ok(None)
    }

    /// Writes what waits of a task.
    fn write_rows(&mut self, index: usize) -> Result<(), WriteError> {
        let Some(task) = self.tasks.get_mut(index) else { return Ok(()) };
        while let Some(Capture { layout, rows }) = task.captures.front_mut() {
            task.row.resize(layout.len(), 0.0);
            let Some(cycle) = rows.pop(&mut task.row) else {
                if rows.is_over() && task.captures.len() > 1 {
                    task.captures.pop_front();
                    task.channel = None;
                    continue;
                }
                break;
            };
            let channel = match task.channel {
                Some(channel) => channel,
                None => *task.channel.insert(self.writer.add_task(layout)?),
            };
            let record = cycle.record;
            let place = Place::of(&record);
            let lost = place.lost_since(task.last.replace(place));
            let head = RowHead {
                cycle: record.cycle,
                release_ns: record.release_ns,
                start_ns: record.start_ns,
                end_ns: record.end_ns,
                missed: record.missed,
                lost,
            };
            self.given += 1;
            self.writer.write_row(channel, &head, &task.row)?;
        }
        let mut told = self.desk.lock();
        told.outcome.cycles = self.given;
        if let (0, Some(last)) = (index, task.last) {
            told.last_cycle = last.cycle;
        }
        Ok(())
    }

    /// Marks what is lost at the end of each task.
    fn mark_ends(&mut self, ends: &Ends) -> Result<(), WriteError> {
        for (task, end) in self.tasks.iter().zip(ends) {
            let (Some(end), Some(Capture { layout, .. })) = (end, task.captures.front()) else {
                continue;
            };
            let lost = end.lost_until_end(task.last);
            if lost > 0 {
                mark(&mut self.writer, layout, end.cycle, lost)?;
            }
        }
        Ok(())
    }
}

fn mark<F: RecordingFile>(
    writer: &mut Writer<F>,
    layout: &TaskLayout,
    cycle: u64,
    lost: u64,
) -> Result<(), WriteError> {
    writer.mark_lost_rows(layout, cycle, lost, Monotonic.now_ns())
}
