//! A recording, for the node's ordinary threads.

use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_model::Entry;
use isochrone_recording::{RecordedEntry, RecordedNode, WriteError, Writer};

use super::writing::{Ends, Job, SharedState, WriterState, work};
use super::{Capture, RecordingFile, RecordingOutcome};
use crate::keeping::journal::Line;
use crate::task::clocks::read_clocks;
use crate::task::faults::Active;
use isochrone_timing::Progress;

/// How many entries of the journal may wait: programs need minutes to cause so many.
const MOST_ENTRIES: u64 = 10_000;
/// How long the end of a node waits for the disk.
const LAST_PATIENCE: Duration = Duration::from_secs(5);

/// A recording that is being written. Dropping it ends it.
pub(crate) struct Recording {
    jobs: Option<Sender<Job>>,
    shared: Arc<SharedState>,
    file: String,
    /// Where each task was before its first cycle.
    before: Vec<Option<Progress>>,
    sent_entries: u64,
    lost_entries: u64,
}

impl Recording {
    /// Begins a file, and starts the thread that writes it.
    ///
    /// # Errors
    /// The file cannot be written, or the thread cannot be started.
    pub(crate) fn start(
        file: String,
        out: impl RecordingFile,
        node: &RecordedNode,
        configuration: &str,
        state: Option<Vec<u8>>,
    ) -> Result<Self, WriteError> {
        let mut writer = Writer::create_for_node(out, read_clocks(), node, configuration)?;
        if let Some(state) = state {
            writer.attach_state(read_clocks(), state)?;
        }
        let (jobs, taken) = channel();
        let shared = Arc::<SharedState>::default();
        let of_thread = Arc::clone(&shared);
        shared.lock().outcome.file.clone_from(&file);
        let work = move || work(writer, &taken, &of_thread);
        let thread = thread::Builder::new().name("recording".to_owned());
        thread.spawn(work).map_err(WriteError::Io)?;
        Ok(Self {
            jobs: Some(jobs),
            shared,
            file,
            before: Vec::new(),
            sent_entries: 0,
            lost_entries: 0,
        })
    }

    /// Records the rows of the next task, whose first cycle has this number; in the order of the tasks.
    pub(crate) fn begin(&mut self, task: usize, capture: Capture, first_cycle: u64) {
        let before = Progress::before(first_cycle);
        self.before.push(before);
        self.send(Job::Rows { task, capture, before });
    }

    /// Records the rows of a ring, after those of the same task that came before.
    pub(crate) fn add(&self, task: usize, capture: Capture) {
        self.send(Job::Rows { task, capture, before: None });
    }

    /// Records an entry of the journal.
    pub(crate) fn note(&mut self, entry: &Entry) {
        let Some(line) = Line::of_entry(entry).and_then(|line| line.json()) else { return };
        if self.sent_entries - self.shared.lock().tried_entries >= MOST_ENTRIES {
            self.lost_entries += 1;
            return;
        }
        self.sent_entries += 1;
        let (time_ns, task) = (Monotonic.now_ns(), entry.task.clone());
        self.send(Job::Entry(RecordedEntry { time_ns, cycle: entry.cycle, task, line }));
    }

    /// The alarm if it has ended before the node.
    pub(crate) fn alarm(&self) -> Option<Active> {
        let state = self.shared.lock();
        let meaning = state.outcome.incomplete.clone()?;
        Some(Active::of_node("recording", meaning, state.last_cycle, 1))
    }

    /// Ends the file after the last cycle, and returns what is in it. Waits for the disk up to 5 s.
    pub(crate) fn end(mut self, ends: Vec<Option<Progress>>) -> RecordingOutcome {
        let ran = |(end, before): (&Option<Progress>, &Option<Progress>)| {
            end.map_or(0, |end| end.lost_until_end(*before))
        };
        let ran: u64 = ends.iter().zip(&self.before).map(ran).sum();
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
        let writes = |state: &mut WriterState| !state.has_ended;
        let state =
            self.shared.has_ended.wait_timeout_while(self.shared.lock(), LAST_PATIENCE, writes);
        let state = state.unwrap_or_else(PoisonError::into_inner).0;
        (state.outcome.clone(), state.has_ended)
    }

    fn send(&self, job: Job) {
        if let Some(jobs) = &self.jobs {
            // A thread that has ended has reported why.
            let _ = jobs.send(job);
        }
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        if self.jobs.is_some() {
            self.await_end(Vec::new());
        }
    }
}
