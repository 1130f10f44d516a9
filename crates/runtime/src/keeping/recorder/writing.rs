//! The thread that writes a recording, so that a slow, full or missing disk holds up nothing else.

use std::collections::VecDeque;
use std::panic::{self, AssertUnwindSafe};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_recording::{ChannelId, RecordedEntry, RowHead, WriteError, Writer};

use super::{Capture, RecordingFile, RecordingOutcome};
use crate::task::clocks::read_clocks;
use crate::task::panics;
use isochrone_timing::Progress;

/// Between two looks at the rings.
const TURN: Duration = Duration::from_millis(20);
/// How often everything is flushed to the system.
const FLUSH: Duration = Duration::from_secs(1);

/// A job for the thread.
pub(super) enum Job {
    /// `before`: the place before its first cycle, where it goes on from an earlier run.
    Rows {
        task: usize,
        capture: Capture,
        before: Option<Progress>,
    },
    Entry(RecordedEntry),
    End(Ends),
}

/// For each task its last cycle, as far as it is known.
pub(super) type Ends = Vec<Option<Progress>>;

/// The progress of the thread.
#[derive(Default)]
pub(super) struct SharedState {
    pub(super) state: Mutex<WriterState>,
    pub(super) has_ended: Condvar,
}

#[derive(Default)]
pub(super) struct WriterState {
    pub(super) outcome: RecordingOutcome,
    pub(super) tried_entries: u64,
    /// Of the first task.
    pub(super) last_cycle: u64,
    pub(super) has_ended: bool,
}

impl SharedState {
    pub(super) fn lock(&self) -> MutexGuard<'_, WriterState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The body of the thread.
pub(super) fn work<F: RecordingFile>(
    writer: Writer<F>,
    jobs: &Receiver<Job>,
    shared: &SharedState,
) {
    let mut writing =
        Writing { writer, shared, tasks: Vec::new(), given: 0, flushed: Instant::now() };
    let written = panic::catch_unwind(AssertUnwindSafe(|| writing.run(jobs)));
    let Writing { writer, given, .. } = writing;
    let why = match written {
        Ok(Ok(())) => match writer.finish() {
            Ok(_) => None,
            Err((error, failed)) => Some((error.to_string(), failed)),
        },
        Ok(Err(error)) => Some((error.to_string(), writer.give_up())),
        Err(panic) => {
            let message = panics::message(&*panic);
            Some((format!("the thread that writes it panicked: {message}"), writer.give_up()))
        }
    };
    let failed = why.map(|(why, mut failed)| {
        let written = given.saturating_sub(failed.lost_frames);
        match failed.out.cut(failed.good_bytes) {
            0 => (why, 0, 0),
            left => (why, left, written),
        }
    });
    let mut state = shared.lock();
    if let Some((why, bytes, cycles)) = failed {
        let outcome = &mut state.outcome;
        (outcome.cycles, outcome.bytes) = (cycles, bytes);
        if bytes == 0 {
            outcome.entries = 0;
        }
        let file = &outcome.file;
        let sentence = format!(
            "the recording {file} cannot be written ({why}): it ends there, and the node goes on without it"
        );
        tracing::error!("{sentence}");
        outcome.incomplete = Some(sentence);
    }
    state.has_ended = true;
    shared.has_ended.notify_all();
}

struct Writing<'a, F: RecordingFile> {
    writer: Writer<F>,
    shared: &'a SharedState,
    tasks: Vec<Task>,
    /// Rows that the writer was given.
    given: u64,
    flushed: Instant,
}

/// The rows of a task.
#[derive(Default)]
struct Task {
    /// The first is for the configuration that the task has, or had; the others are for later ones.
    captures: VecDeque<Capture>,
    channel: Option<ChannelId>,
    row: Vec<f64>,
    last: Option<Progress>,
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
                self.shared.lock().outcome.bytes = self.writer.bytes();
                return Ok(());
            }
            if self.flushed.elapsed() >= FLUSH {
                self.flushed = Instant::now();
                self.writer.follow(read_clocks())?;
                self.writer.flush()?;
                self.shared.lock().outcome.bytes = self.writer.bytes();
            }
        }
    }

    fn take(&mut self, job: Job) -> Result<Option<Ends>, WriteError> {
        match job {
            Job::Rows { task, capture, before } => {
                if self.tasks.len() <= task {
                    self.tasks.resize_with(task + 1, Task::default);
                }
                if let Some(task) = self.tasks.get_mut(task) {
                    task.captures.push_back(capture);
                    task.last = task.last.or(before);
                }
            }
            Job::Entry(entry) => {
                let written = self.writer.write_entry(&entry);
                let mut state = self.shared.lock();
                state.tried_entries += 1;
                state.outcome.entries += u64::from(written.is_ok());
                drop(state);
                written?;
            }
            Job::End(ends) => return Ok(Some(ends)),
        }
        Ok(None)
    }

    /// Writes the waiting rows of a task.
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
            let place = Progress::of(&record);
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
        let mut state = self.shared.lock();
        state.outcome.cycles = self.given;
        if let (0, Some(last)) = (index, task.last) {
            state.last_cycle = last.cycle;
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
                self.writer.mark_lost_rows(layout, end.cycle, lost, Monotonic.now_ns())?;
            }
        }
        Ok(())
    }
}
