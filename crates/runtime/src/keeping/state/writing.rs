//! The thread that writes the state of a running node.

use std::fs::File;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::desk::{AlarmRecord, Operator, RetainedValue};
use isochrone_engine::{Source, TaskState};
use isochrone_timing::units::duration;

use super::error::StateError;
use super::file::StateFile;
use super::node_state::{NodeState, RetainedTask};
use super::retention::Retention;
use crate::error::PrepareError;
use crate::keeping::guard::WriteGuard;
use crate::node::process_alarms::ProcessAlarms;
use crate::task::clocks::unix_ns;
use crate::task::faults::Active;
use crate::task::retained::{Copies, Wanted};

/// How long copies are waited for before the state is written without those of slow tasks.
const COPIES_WITHIN: Duration = Duration::from_millis(100);
/// How long a write may take before it is an alarm, and how long the end of a node waits for the disk.
const PATIENCE: Duration = Duration::from_secs(5);

/// The state of a running node, for its supervisor. Dropping it leaves the last state that was written.
pub(crate) struct StateWriting {
    jobs: Sender<Job>,
    has_ended: Receiver<()>,
    disk: Arc<Disk>,
    path: PathBuf,
    every: Duration,
    due: Instant,
    /// When copies were asked for, while the state is to be written with them.
    asked: Option<Instant>,
    tasks: Vec<CopiedTask>,
    /// Since which cycle of the first task the state cannot be written, and how often that has begun.
    unwritten: Option<u64>,
    failures: u64,
}

/// A task whose state is copied.
struct CopiedTask {
    name: String,
    period_ns: u64,
    needs_ns: u64,
    copies: Arc<Wanted>,
    /// Since which cycle of the first task there is no time for copies.
    short: Option<u64>,
}

/// What is known of the disk.
#[derive(Default)]
struct Disk(Mutex<DiskState>);

#[derive(Default)]
struct DiskState {
    /// Since when a write is under way.
    since: Option<Instant>,
    /// Why the last write failed, if it did.
    failure: Option<String>,
}

/// What people did that outlives a run.
#[derive(Default, PartialEq)]
pub(crate) struct DeskState {
    tuned: Vec<RetainedValue>,
    alarms: Vec<AlarmRecord>,
}

impl DeskState {
    /// What is set, and the alarms with what was acknowledged.
    pub(crate) fn of(operator: &Operator, alarms: &ProcessAlarms) -> Self {
        Self { tuned: operator.retained_values(), alarms: alarms.records() }
    }
}

/// What is written at the end.
pub(crate) struct FinalState {
    pub(crate) desk: DeskState,
    /// Of each task; `None`: its last copy counts.
    pub(crate) tasks: Vec<Option<TaskState>>,
}

enum Job {
    Desk(DeskState),
    Change(Box<Source>, Vec<Copies>),
    End(Box<FinalState>),
}

impl StateWriting {
    /// Starts the thread. The tasks have these names, periods in ns, and copies; `desk` is what the desk has.
    ///
    /// # Errors
    /// A state that is not to be restored cannot be put aside, or there is no thread.
    pub(crate) fn start(
        retention: Retention,
        node: &str,
        source: &Source,
        tasks: Vec<(String, u64, Copies)>,
        desk: DeskState,
        guard: WriteGuard,
    ) -> Result<Self, PrepareError> {
        let (file, claim, settings) = retention.settle()?;
        let (jobs, taken) = channel();
        let (tell, has_ended) = channel();
        let disk = Arc::<Disk>::default();
        let (path, every) = (file.path().to_owned(), Duration::from_nanos(settings.every_ns));
        let mut retained = Vec::new();
        let mut copies = Vec::new();
        for (task, period_ns, of_task) in tasks {
            retained.push(CopiedTask::new(task, period_ns, &of_task));
            copies.push(of_task);
        }
        let writer = StateWriter {
            file,
            _claim: claim,
            guard,
            node: node.to_owned(),
            source: source.clone(),
            are_awaited: vec![false; copies.len()],
            copies,
            desk,
            disk: Arc::clone(&disk),
        };
        let work = move || {
            writer.run(&taken);
            // Nobody waits for it after a panic.
            let _ = tell.send(());
        };
        let thread = thread::Builder::new().name("state".to_owned()).spawn(work);
        thread
            .map_err(|cause| PrepareError::no_thread("the thread that writes the state", cause))?;
        let (due, asked) = (Instant::now() + every, None);
        let (tasks, unwritten, failures) = (retained, None, 0);
        Ok(Self { jobs, has_ended, disk, path, every, due, asked, tasks, unwritten, failures })
    }

    /// Asks for copies when they are due, and has the state written when they are there, with what
    /// `desk` says. `cycle` is the last one of the first task.
    pub(crate) fn look(&mut self, cycle: u64, desk: impl FnOnce() -> DeskState) {
        let now = Instant::now();
        match self.asked {
            None if now >= self.due => {
                self.due = now + self.every;
                self.asked = Some(now);
                self.tasks.iter().for_each(|task| task.copies.ask());
            }
            // One is enough to wait for a slow disk.
            Some(_) if self.disk.lock().since.is_some() => {}
            Some(asked)
                if now >= asked + COPIES_WITHIN
                    || !self.tasks.iter().any(|task| task.copies.is_awaited()) =>
            {
                self.asked = None;
                let _ = self.jobs.send(Job::Desk(desk()));
            }
            None | Some(_) => {}
        }
        let since = |is: bool, before: Option<u64>| is.then(|| before.unwrap_or(cycle));
        let is_unwritten = self.trouble().is_some();
        self.failures += u64::from(is_unwritten && self.unwritten.is_none());
        self.unwritten = since(is_unwritten, self.unwritten);
        for task in &mut self.tasks {
            task.short = since(task.copies.is_short(), task.short);
        }
    }

    /// Has the state written with the next look: a person did what it has to have.
    pub(crate) fn hurry(&mut self) {
        self.due = Instant::now();
    }

    /// Goes on with the state of another configuration, which all tasks have.
    pub(crate) fn change(&mut self, source: &Source, copies: Vec<Copies>) {
        for (task, copies) in self.tasks.iter_mut().zip(&copies) {
            *task = CopiedTask::new(std::mem::take(&mut task.name), task.period_ns, copies);
        }
        let _ = self.jobs.send(Job::Change(Box::new(source.clone()), copies));
    }

    /// The alarms: the state cannot be written, or that of a task has no time.
    pub(crate) fn alarms(&self) -> impl Iterator<Item = Active> {
        let failures = self.failures;
        let unwritten = self.unwritten.zip(self.trouble());
        let unwritten =
            unwritten.map(|(since, why)| Active::of_node("state", why, since, failures));
        let of_task =
            |task: &CopiedTask| Some(Active::of_node("state", task.shortage()?, task.short?, 1));
        unwritten.into_iter().chain(self.tasks.iter().filter_map(of_task))
    }

    /// Which tasks have no time for copies, in sentences.
    pub(crate) fn shortages(&self) -> impl Iterator<Item = String> {
        self.tasks.iter().filter_map(CopiedTask::shortage)
    }

    /// Why the state cannot be written now, if so.
    fn trouble(&self) -> Option<String> {
        let disk = self.disk.lock();
        let hangs = || {
            let (path, seconds) = (self.path.display(), PATIENCE.as_secs());
            let is_long = disk.since.is_some_and(|since| since.elapsed() > PATIENCE);
            is_long.then(|| format!("the disk has not taken the state {path} for {seconds} s"))
        };
        disk.failure.clone().or_else(hangs)
    }

    /// Has the last state written.
    pub(crate) fn begin_end(&self, last: FinalState) {
        let _ = self.jobs.send(Job::End(Box::new(last)));
    }

    /// Waits up to 5 s for the disk; `Some`: the last state could not be written, with the reason.
    pub(crate) fn end(self) -> Option<String> {
        let (path, seconds) = (self.path.display(), PATIENCE.as_secs());
        match self.has_ended.recv_timeout(PATIENCE) {
            Ok(()) => self.disk.lock().failure.take(),
            Err(RecvTimeoutError::Timeout) => {
                Some(format!("the state {path} was not written within {seconds} s at the end"))
            }
            Err(RecvTimeoutError::Disconnected) => {
                Some(format!("the state {path} was not written at the end: its thread panicked"))
            }
        }
    }
}

impl CopiedTask {
    fn new(name: String, period_ns: u64, copies: &Copies) -> Self {
        let (needs_ns, copies) = (copies.needs_ns, Arc::clone(copies.shared()));
        Self { name, period_ns, needs_ns, copies, short: None }
    }

    /// Why its state is not retained while it runs, if so.
    fn shortage(&self) -> Option<String> {
        let Self { name, period_ns, needs_ns, .. } = self;
        let (needs, period) = (duration(*needs_ns as f64), duration(*period_ns as f64));
        self.copies.is_short().then(|| {
            format!(
                "the state of task \"{name}\" is not retained while it runs: a copy needs {needs} free after a cycle, \
                 and its period is {period}; give it a longer period or fewer blocks"
            )
        })
    }
}

impl Disk {
    fn lock(&self) -> MutexGuard<'_, DiskState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes how long a write takes, and what came of it.
    fn watch(&self, write: impl FnOnce() -> Result<(), StateError>) {
        self.lock().since = Some(Instant::now());
        let failure = write().err().map(|error| error.to_string());
        *self.lock() = DiskState { since: None, failure };
    }
}

/// The thread's part.
struct StateWriter {
    file: StateFile,
    /// Keeps other processes from writing there; `None` for one of two that may take the file over.
    _claim: Option<File>,
    guard: WriteGuard,
    node: String,
    source: Source,
    copies: Vec<Copies>,
    /// Whose first copy in a new configuration has not come yet.
    are_awaited: Vec<bool>,
    /// What the desk had, as it was written last.
    desk: DeskState,
    disk: Arc<Disk>,
}

impl StateWriter {
    /// Writes what comes until the end; where the disk is slow, the newest.
    fn run(mut self, jobs: &Receiver<Job>) {
        while let Ok(job) = jobs.recv() {
            let mut desk = None;
            for job in std::iter::once(job).chain(std::iter::from_fn(|| jobs.try_recv().ok())) {
                match job {
                    Job::Desk(newest) => desk = Some(newest),
                    Job::Change(source, copies) => {
                        self.are_awaited = vec![true; copies.len()];
                        (self.source, self.copies) = (*source, copies);
                        // That is of the configuration before.
                        desk = None;
                    }
                    Job::End(last) => {
                        self.update();
                        return self.write(last.desk, last.tasks);
                    }
                }
            }
            let is_fresh = self.update();
            if self.are_awaited.contains(&true) {
                continue;
            }
            if let Some(desk) = desk.filter(|desk| is_fresh || *desk != self.desk) {
                let none = self.copies.iter().map(|_| None).collect();
                self.write(desk, none);
            }
        }
    }

    /// Takes in the newest copies; whether any came.
    fn update(&mut self) -> bool {
        let mut is_fresh = false;
        for (copies, is_awaited) in self.copies.iter_mut().zip(&mut self.are_awaited) {
            let has_come = copies.update(unix_ns());
            is_fresh |= has_come;
            *is_awaited &= !has_come && !copies.shared().is_short();
        }
        is_fresh
    }

    fn write(&mut self, desk: DeskState, last: Vec<Option<TaskState>>) {
        let unix_ns = unix_ns();
        let is_final = last.iter().all(Option::is_some);
        let copies = self.copies.iter_mut().zip(&self.are_awaited);
        let retained = |(last, (copies, is_awaited)): (Option<TaskState>, (&mut Copies, &bool))| {
            let layout = copies.layout;
            match last {
                Some(last) => Some(RetainedTask::new(unix_ns, layout, last)),
                // It is of a configuration that the task had not stepped.
                None if *is_awaited => None,
                None => Some(RetainedTask::new(copies.unix_ns, layout, copies.last().clone())),
            }
        };
        let state = NodeState {
            node: self.node.clone(),
            unix_ns,
            is_final,
            term: self.guard.term(),
            file: self.source.name.clone(),
            configuration: self.source.text.to_string(),
            tasks: last.into_iter().zip(copies).map(retained).collect(),
            tuned: desk.tuned,
            alarms: desk.alarms,
        };
        self.disk.watch(|| self.file.write_if(&state, || self.guard.allows()));
        self.desk = DeskState { tuned: state.tuned, alarms: state.alarms };
    }
}
