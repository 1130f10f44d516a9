//! From a plan to threads that wait for their start.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use isochrone_cyclic::{Clock, EPOCH_OFFSET_NS, Monotonic, Refusal, ThreadGrant, ThreadRequest};
use isochrone_engine::{Pins, Plan, TaskEngine, TaskPlan};
use isochrone_ipc::{LayoutAnnouncer, OpenError, Participant, RealTime, Service, ipc, local};
use isochrone_timing::{CycleRecord, TaskTiming};
use rtrb::{Consumer, RingBuffer};

use crate::alarms::Alarm;
use crate::error::{PrepareError, TaskPanicked};
use crate::events::{self, Log};
use crate::layouts::Resolver;
use crate::running::Running;
use crate::set_points::{self, Sender as SetPoints};
use crate::snapshots::{Snapshots, Tap};
use crate::task::{self, Done, Job, Ready, Services, Start};
use crate::telemetry::{Telemetry, cuts};
use crate::{inputs, outputs};

/// Records that fit between the cycle and the thread that reads them: 40 ms at the shortest period.
const RING_RECORDS: usize = 4096;
/// From the end of the set-up to the first release.
const START_DELAY_NS: u64 = 20_000_000;
/// Ticks of 100, 250 and 1000 Hz fall on multiples of this.
const EPOCH_GRID_NS: u64 = 20_000_000;

/// An instant, 20 ms and a little from now, at which a grid may begin, in ns of `CLOCK_MONOTONIC`. The
/// kernel's ticks come at whole milliseconds of the clock; a release that meets one is late by what the
/// tick does. So the grid begins between them.
pub fn next_epoch_ns() -> u64 {
    (Monotonic.now_ns() + START_DELAY_NS).next_multiple_of(EPOCH_GRID_NS) + EPOCH_OFFSET_NS
}

/// A control node. Its states are types: [`Prepared`], [`Running`], [`Outcome`](crate::Outcome).
#[derive(Debug)]
pub enum Node {}

impl Node {
    /// Opens the ports of a plan's tasks in threads of their own, which then wait for the start.
    ///
    /// The participant joins again for real time. Inputs that name no service are given by
    /// [`Running::set`]. Memory is locked by
    /// [`prepare_process`](isochrone_cyclic::prepare_process), which is the program's to call.
    ///
    /// # Errors
    /// A node of this name runs already, or a port or a thread is refused.
    pub fn prepare<S: Service + 'static>(
        plan: &Plan,
        participant: Participant<S>,
    ) -> Result<Prepared<S>, PrepareError> {
        Prepared::new(plan, Some(Arc::new(participant.for_real_time()?)))
    }

    /// A node without services: its inputs are given by [`Running::set`], its signals are read by
    /// [`Running::value`], and nobody else sees it.
    ///
    /// # Errors
    /// A thread is refused.
    pub fn prepare_alone(plan: &Plan) -> Result<Prepared<local::Service>, PrepareError> {
        Prepared::new(plan, None)
    }
}

/// A node whose ports are open and whose threads wait. Dropping it ends them.
#[must_use = "dropping it ends its threads"]
pub struct Prepared<S: Service = ipc::Service> {
    // The threads end before what they use.
    threads: Threads,
    parts: Parts<S>,
    grants: Vec<ThreadGrant>,
    cycles: Option<u64>,
}

/// What the ordinary thread has of a node beside its threads; the participant is dropped last.
pub(crate) struct Parts<S: Service> {
    pub(crate) tasks: Vec<Task<S>>,
    pub(crate) pins: Pins,
    pub(crate) snapshots: Snapshots,
    pub(crate) telemetry: Option<Telemetry<S>>,
    pub(crate) announcers: Vec<LayoutAnnouncer<S>>,
    pub(crate) alarms: Vec<Alarm>,
    pub(crate) participant: Option<Arc<RealTime<S>>>,
}

/// What the ordinary thread has of a task.
pub(crate) struct Task<S: Service> {
    pub(crate) name: String,
    pub(crate) timing: TaskTiming,
    pub(crate) records: Consumer<CycleRecord>,
    pub(crate) log: Log,
    pub(crate) set_points: SetPoints,
    pub(crate) resolvers: Vec<Resolver<S>>,
}

/// The threads of a node's tasks. Dropping them ends them, and waits until they have ended.
pub(crate) struct Threads {
    pub(crate) stop: Arc<AtomicBool>,
    threads: Vec<Thread>,
}

struct Thread {
    task: String,
    thread: JoinHandle<Option<Done>>,
    start: Sender<Start>,
}

impl Threads {
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    pub(crate) fn have_ended(&self) -> bool {
        self.threads.iter().all(|thread| thread.thread.is_finished())
    }

    /// Ends and awaits the threads, in order.
    pub(crate) fn join(mut self) -> Result<Vec<Option<Done>>, TaskPanicked> {
        self.end().into_iter().collect()
    }

    fn end(&mut self) -> Vec<Result<Option<Done>, TaskPanicked>> {
        self.stop();
        // One that waits for its start ends when nobody can give it any more.
        let handles: Vec<_> = self.threads.drain(..).map(|t| (t.task, t.thread)).collect();
        let join = |(task, thread): (String, JoinHandle<_>)| {
            thread.join().map_err(|panic| TaskPanicked { task, message: words(&*panic) })
        };
        handles.into_iter().map(join).collect()
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.end();
    }
}

/// What a panic said.
fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".into())
}

impl<S: Service + 'static> Prepared<S> {
    fn new(plan: &Plan, participant: Option<Arc<RealTime<S>>>) -> Result<Self, PrepareError> {
        let (snapshots, taps) = Snapshots::of(plan);
        let telemetry = participant.as_deref();
        let telemetry = telemetry.map(|p| Telemetry::open(p, &plan.node, &snapshots)).transpose();
        let mut threads = Threads { stop: Arc::default(), threads: Vec::new() };
        let mut parts = Parts {
            tasks: Vec::new(),
            pins: Pins::of(plan),
            snapshots,
            telemetry: telemetry.map_err(|error| runs_already(plan, error))?,
            announcers: Vec::new(),
            alarms: Vec::new(),
            participant,
        };
        let engines = TaskEngine::build(plan)?.into_iter().zip(taps);
        let mut ready = Vec::new();
        for (task, (engine, tap)) in plan.tasks.iter().zip(engines) {
            ready.push(threads.spawn(task, engine, tap, &mut parts)?);
        }
        let mut grants = Vec::new();
        for (index, ready) in ready.into_iter().enumerate() {
            let Ok(ready) = ready.recv() else {
                return Err(threads.lost(index).into());
            };
            let Ready { grant, desks } = ready?;
            grants.push(grant);
            let (Some(participant), Some(task)) = (&parts.participant, parts.tasks.get_mut(index))
            else {
                continue;
            };
            let open = |desk| Resolver::open(participant.ordinary(), desk);
            task.resolvers = desks.into_iter().map(open).collect::<Result<_, _>>()?;
        }
        if let Some(participant) = &parts.participant {
            let outputs = plan.tasks.iter().flat_map(outputs::of_task);
            let open = |output: outputs::Output| {
                let ordinary = participant.ordinary();
                LayoutAnnouncer::open(ordinary, &output.service, &plan.node, &output.layout)
            };
            parts.announcers = outputs.map(open).collect::<Result<_, _>>()?;
            parts.alarms = cuts(plan).collect();
        }
        Ok(Self { threads, parts, grants, cycles: None })
    }

    /// Ends the node when its first task has run this many cycles.
    pub fn with_cycles(self, cycles: Option<u64>) -> Self {
        Self { cycles, ..self }
    }

    /// What the machine granted each task, by its name.
    pub fn grants(&self) -> impl Iterator<Item = (&str, &ThreadGrant)> {
        self.parts.tasks.iter().map(|task| task.name.as_str()).zip(&self.grants)
    }

    /// What the machine refused the tasks. The node runs without it, less punctually.
    pub fn refusals(&self) -> impl Iterator<Item = &Refusal> {
        self.grants.iter().flat_map(|grant| &grant.refusals)
    }

    /// What people are to know of the node beforehand.
    pub fn alarms(&self) -> &[Alarm] {
        &self.parts.alarms
    }

    /// Starts all tasks on one grid.
    pub fn start(self) -> Running<S> {
        let epoch_ns = next_epoch_ns();
        for (index, thread) in self.threads.threads.iter().enumerate() {
            // One that has ended meanwhile has set the stop flag.
            let cycles = self.cycles.filter(|_| index == 0);
            let _ = thread.start.send(Start { epoch_ns, cycles });
        }
        Running::new(self.threads, self.parts, self.grants, epoch_ns)
    }
}

impl<S: Service> std::fmt::Debug for Prepared<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prepared").field("grants", &self.grants).finish_non_exhaustive()
    }
}

impl Threads {
    /// Starts the thread of a task, which opens its ports and then waits.
    fn spawn<S: Service + 'static>(
        &mut self,
        task: &TaskPlan,
        engine: TaskEngine,
        tap: Tap,
        parts: &mut Parts<S>,
    ) -> Result<Receiver<Result<Ready, OpenError>>, PrepareError> {
        let (ready, is_ready) = channel();
        let (start, started) = channel();
        let (records, consumer) = RingBuffer::new(RING_RECORDS);
        let (applier, set_points) = set_points::ends();
        let (events, log) = events::ends(task);
        let services = parts.participant.clone().map(|participant| Services {
            participant,
            inputs: inputs::of_task(task),
            outputs: outputs::of_task(task),
        });
        let request =
            ThreadRequest { priority: task.priority, cpu: task.cpu.map(|cpu| cpu as usize) };
        let job = Job {
            schedule: task.schedule,
            request,
            engine,
            services,
            stop: self.stop.clone(),
            set_points: applier,
            records,
            tap,
            events,
            ready,
            start: started,
        };
        let name = task.name.clone();
        let spawned = thread::Builder::new()
            .name(name.chars().take(15).collect())
            .spawn(move || task::run(job))
            .map_err(|source| PrepareError::Thread { task: name.clone(), source })?;
        self.threads.push(Thread { task: name.clone(), thread: spawned, start });
        parts.tasks.push(Task {
            name,
            timing: TaskTiming::new(task.schedule.period_ns),
            records: consumer,
            log,
            set_points,
            resolvers: Vec::new(),
        });
        Ok(is_ready)
    }

    /// Why a thread ended in its set-up without a word.
    fn lost(&mut self, index: usize) -> TaskPanicked {
        let task = self.threads.get(index).map(|thread| thread.task.clone()).unwrap_or_default();
        let panics = self.end().into_iter().filter_map(Result::err);
        let message = "its thread ended during its set-up".into();
        panics.into_iter().next().unwrap_or(TaskPanicked { task, message })
    }
}

/// A node's telemetry has one publisher, so a second one means that the node runs already.
fn runs_already(plan: &Plan, error: OpenError) -> PrepareError {
    match error {
        OpenError::SecondPublisher { other, .. } => {
            PrepareError::RunsAlready { node: plan.node.clone(), other }
        }
        error => error.into(),
    }
}
