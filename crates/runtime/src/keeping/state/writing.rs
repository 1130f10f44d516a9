//! The thread that writes the state of a running node.

use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::desk::RetainedValue;
use isochrone_engine::{Source, TaskState};
use isochrone_timing::units::duration;

use super::file::StateFile;
use super::node_state::NodeState;
use super::retention::Retention;
use crate::error::PrepareError;
use crate::task::clocks::unix_ns;
use crate::task::faults::Active;
use crate::task::retained::Copies;

/// How long the end of a node waits for the disk.
const LAST_PATIENCE: Duration = Duration::from_secs(5);

/// The state of a running node, for its supervisor. Dropping it leaves the last state that was written.
pub(crate) struct StateWriting {
    jobs: Sender<Job>,
    has_ended: Receiver<()>,
    failure: Arc<Failure>,
    path: PathBuf,
    every: Duration,
    due: Instant,
    tasks: Vec<TaskRoom>,
    /// Since which cycle of the first task the state cannot be written, and how often that has begun.
    unwritten: Option<u64>,
    failures: u64,
}

/// Whether there is time to copy the state of a task.
struct TaskRoom {
    task: String,
    period_ns: u64,
    needs_ns: u64,
    is_short: Arc<AtomicBool>,
    since: Option<u64>,
}

/// Why the last write failed, if it did.
#[derive(Default)]
struct Failure(Mutex<Option<String>>);

/// What is written at the end.
pub(crate) struct FinalState {
    pub(crate) values: Vec<RetainedValue>,
    /// Of each task; `None`: its last copy counts.
    pub(crate) tasks: Vec<Option<TaskState>>,
}

enum Job {
    Values(Vec<RetainedValue>),
    Change(Box<Source>, Vec<Copies>),
    End(Box<FinalState>),
}

impl StateWriting {
    /// Starts the thread. The tasks have these names, periods in ns, and copies.
    pub(crate) fn start(
        retention: Retention,
        node: &str,
        source: &Source,
        tasks: Vec<(String, u64, Copies)>,
    ) -> Result<Self, PrepareError> {
        let Retention { file, claim, settings, .. } = retention;
        let (jobs, taken) = channel();
        let (tell, has_ended) = channel();
        let failure = Arc::<Failure>::default();
        let (path, every) = (file.path().to_owned(), Duration::from_nanos(settings.every_ns));
        let mut rooms = Vec::new();
        let mut copies = Vec::new();
        for (task, period_ns, of_task) in tasks {
            rooms.push(TaskRoom::new(task, period_ns, &of_task));
            copies.push(of_task);
        }
        let writer = StateWriter {
            file,
            _claim: claim,
            node: node.to_owned(),
            source: source.clone(),
            are_awaited: vec![false; copies.len()],
            copies,
            values: None,
            failure: Arc::clone(&failure),
        };
        let work = move || {
            writer.run(&taken);
            // Nobody waits for it after a panic.
            let _ = tell.send(());
        };
        let thread = thread::Builder::new().name("state".to_owned()).spawn(work);
        thread
            .map_err(|cause| PrepareError::no_thread("the thread that writes the state", cause))?;
        let (due, tasks, unwritten) = (Instant::now() + every, rooms, None);
        Ok(Self { jobs, has_ended, failure, path, every, due, tasks, unwritten, failures: 0 })
    }

    /// Has the state written, if that is due: with what `values` says was set. `cycle` is the last one of the first
    /// task.
    pub(crate) fn look(&mut self, cycle: u64, values: impl FnOnce() -> Vec<RetainedValue>) {
        let now = Instant::now();
        if now < self.due {
            return;
        }
        self.due = now + self.every;
        let _ = self.jobs.send(Job::Values(values()));
        let since = |is: bool, before: Option<u64>| is.then(|| before.unwrap_or(cycle));
        let is_unwritten = self.failure.lock().is_some();
        self.failures += u64::from(is_unwritten && self.unwritten.is_none());
        self.unwritten = since(is_unwritten, self.unwritten);
        for task in &mut self.tasks {
            task.since = since(task.is_short.load(Ordering::Relaxed), task.since);
        }
    }

    /// Goes on with the state of another configuration, which all tasks have.
    pub(crate) fn change(&mut self, source: &Source, copies: Vec<Copies>) {
        for (task, copies) in self.tasks.iter_mut().zip(&copies) {
            *task = TaskRoom::new(std::mem::take(&mut task.task), task.period_ns, copies);
        }
        let _ = self.jobs.send(Job::Change(Box::new(source.clone()), copies));
    }

    /// The alarms: the state cannot be written, or that of a task has no time.
    pub(crate) fn alarms(&self) -> impl Iterator<Item = Active> {
        let why = self.failure.lock().clone();
        let failures = self.failures;
        let unwritten = self.unwritten.zip(why).map(|(since, why)| active(since, failures, why));
        unwritten.into_iter().chain(self.tasks.iter().filter_map(TaskRoom::alarm))
    }

    /// Writes the last state; `Some`: it could not be written, with the reason. Waits for the disk up to 5 s.
    pub(crate) fn end(self, last: FinalState) -> Option<String> {
        let _ = self.jobs.send(Job::End(Box::new(last)));
        if self.has_ended.recv_timeout(LAST_PATIENCE).is_err() {
            let (path, seconds) = (self.path.display(), LAST_PATIENCE.as_secs());
            return Some(format!("the state {path} was not written within {seconds} s at the end"));
        }
        self.failure.lock().take()
    }
}

fn active(since_cycle: u64, count: u64, meaning: String) -> Active {
    Active { name: "state".to_owned(), code: None, status: None, meaning, since_cycle, count }
}

impl TaskRoom {
    fn new(task: String, period_ns: u64, copies: &Copies) -> Self {
        let (needs_ns, is_short) = (copies.needs_ns(), Arc::clone(copies.is_short()));
        Self { task, period_ns, needs_ns, is_short, since: None }
    }

    fn alarm(&self) -> Option<Active> {
        let Self { task, period_ns, needs_ns, since, .. } = self;
        let (needs, period) = (duration(*needs_ns as f64), duration(*period_ns as f64));
        let meaning = format!(
            "the state of task \"{task}\" is not retained while it runs: a copy needs {needs} of free time, and its \
             period is {period}; give it a longer period or fewer blocks"
        );
        since.map(|since| active(since, 1, meaning))
    }
}

impl Failure {
    fn lock(&self) -> MutexGuard<'_, Option<String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The thread's part.
struct StateWriter {
    file: StateFile,
    /// Keeps other processes from writing there.
    _claim: File,
    node: String,
    source: Source,
    copies: Vec<Copies>,
    /// Whose first copy in a new configuration has not come yet.
    are_awaited: Vec<bool>,
    /// What was written last.
    values: Option<Vec<RetainedValue>>,
    failure: Arc<Failure>,
}

impl StateWriter {
    /// Writes what comes until the end; where the disk is slow, the newest.
    fn run(mut self, jobs: &Receiver<Job>) {
        while let Ok(job) = jobs.recv() {
            let mut values = None;
            for job in std::iter::once(job).chain(std::iter::from_fn(|| jobs.try_recv().ok())) {
                match job {
                    Job::Values(newest) => values = Some(newest),
                    Job::Change(source, copies) => {
                        self.are_awaited = vec![true; copies.len()];
                        (self.source, self.copies) = (*source, copies);
                    }
                    Job::End(last) => {
                        let FinalState { values, tasks } = *last;
                        self.are_awaited.fill(false);
                        self.update();
                        return self.write(values, tasks);
                    }
                }
            }
            let is_fresh = self.update();
            if self.are_awaited.iter().any(|is_awaited| *is_awaited) {
                continue;
            }
            if let Some(values) = values.filter(|new| is_fresh || Some(new) != self.values.as_ref())
            {
                let none = self.copies.iter().map(|_| None).collect();
                self.write(values, none);
            }
        }
    }

    /// Takes in the newest copies; whether any came.
    fn update(&mut self) -> bool {
        let mut is_fresh = false;
        for (copies, is_awaited) in self.copies.iter_mut().zip(&mut self.are_awaited) {
            let has_come = copies.newest().is_some();
            is_fresh |= has_come;
            *is_awaited &= !has_come && !copies.is_short().load(Ordering::Relaxed);
        }
        is_fresh
    }

    fn write(&mut self, values: Vec<RetainedValue>, last: Vec<Option<TaskState>>) {
        let is_final = last.iter().all(Option::is_some);
        let copied = |copies: &mut Copies| {
            let is_short = copies.is_short().load(Ordering::Relaxed);
            (!is_short).then(|| copies.last().clone())
        };
        let tasks = last.into_iter().zip(&mut self.copies);
        let state = NodeState {
            node: self.node.clone(),
            unix_ns: unix_ns(),
            is_final,
            file: self.source.name.clone(),
            configuration: self.source.text.to_string(),
            tasks: tasks.map(|(last, copies)| last.or_else(|| copied(copies))).collect(),
            tuned: values,
        };
        let written = self.file.write(&state);
        self.values = written.is_ok().then_some(state.tuned);
        *self.failure.lock() = written.err().map(|error| error.to_string());
    }
}
