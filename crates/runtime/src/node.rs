//! From a plan to threads that wait for their start.

use std::sync::Arc;

use isochrone_control::desk::{Feeds, Operator};
use isochrone_cyclic::{Clock, GrantRefusal, Monotonic, ThreadGrant};
use isochrone_engine::{Plan, TaskEngine};
use isochrone_ipc::{LayoutAnnouncer, OpenError, Participant, RealTime, Service, ipc, local};
use isochrone_model::{Access, epoch_after_ns};
use isochrone_recording::{self as recording, TaskLayout, WriteError};

use crate::alarms::Alarm;
use crate::error::PrepareError;
use crate::journal::{Journal, JournalError};
use crate::layouts::Resolver;
use crate::operating::{Shared, unix_ns};
use crate::outputs;
use crate::parts::Parts;
use crate::placement::TaskCpus;
use crate::recorded::task_layouts;
use crate::recorder::{Recorder, Recording, RecordingFile};
use crate::running::Running;
use crate::server::Serving;
use crate::snapshots::Snapshots;
use crate::task::Ready;
use crate::telemetry::{Telemetry, cuts};
use crate::threads::Threads;

/// From the end of the set-up to the first release.
const START_DELAY_NS: u64 = 20_000_000;

/// An instant, 20 ms and a little from now, at which a grid may begin: [`epoch_after_ns`].
pub fn next_epoch_ns() -> u64 {
    epoch_after_ns(Monotonic.now_ns() + START_DELAY_NS)
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
    /// Where the configuration leaves the CPU of a task open (`cpu = "auto"`), the machine is observed for
    /// 200 ms and the best one chosen, as [`TaskCpus::of`] says.
    ///
    /// Unless the configuration says `control = "off"`, a thread of its own serves the requests of
    /// other programs ([`control`](isochrone_control)) from the start to the end of the node.
    ///
    /// # Errors
    /// A node of this name runs already, or a port or a thread is refused.
    pub fn prepare<S: Service + 'static>(
        plan: &Plan,
        participant: Participant<S>,
    ) -> Result<Prepared<S>, PrepareError> {
        Self::prepare_at(plan, &TaskCpus::of(plan), participant)
    }

    /// As [`prepare`](Self::prepare), with the tasks on CPUs that were chosen before.
    ///
    /// # Errors
    /// A node of this name runs already, or a port or a thread is refused.
    pub fn prepare_at<S: Service + 'static>(
        plan: &Plan,
        cpus: &TaskCpus,
        participant: Participant<S>,
    ) -> Result<Prepared<S>, PrepareError> {
        Prepared::new(plan, cpus, Some(Arc::new(participant.for_real_time()?)))
    }

    /// A node without services: its inputs are given by [`Running::set`], its signals are read by
    /// [`Running::value`], and nobody else sees it.
    ///
    /// # Errors
    /// A thread is refused.
    pub fn prepare_alone(plan: &Plan) -> Result<Prepared<local::Service>, PrepareError> {
        Prepared::new(plan, &TaskCpus::of(plan), None)
    }
}

/// A node whose ports are open and whose threads wait. Dropping it ends them. Like [`Running`], it
/// stays in the thread that prepared it.
#[must_use = "dropping it ends its threads"]
pub struct Prepared<S: Service = ipc::Service> {
    // The threads end before what they use.
    serving: Option<Serving>,
    threads: Threads,
    parts: Parts<S>,
    grants: Vec<ThreadGrant>,
    cycles: Option<u64>,
    layouts: Vec<TaskLayout>,
}

impl<S: Service + 'static> Prepared<S> {
    fn new(
        plan: &Plan,
        cpus: &TaskCpus,
        participant: Option<Arc<RealTime<S>>>,
    ) -> Result<Self, PrepareError> {
        let engines = TaskEngine::build(plan)?;
        if let Some(participant) = &participant {
            let outputs = plan.tasks.iter().flat_map(|task| &task.outputs);
            let services: Vec<_> = outputs.map(|output| output.service.as_str()).collect();
            participant.ordinary().refuse_far_writers(&services)?;
        }
        let (snapshots, taps) = Snapshots::of(plan);
        let feeds = if participant.is_some() { Feeds::Services } else { Feeds::Program };
        let telemetry = participant.as_deref();
        let telemetry = telemetry.map(|p| Telemetry::open(p, &plan.node, &snapshots)).transpose();
        let mut threads = Threads::default();
        let mut parts = Parts {
            node: plan.node.clone(),
            tasks: Vec::new(),
            operating: Shared::new(Operator::new(plan, feeds), plan),
            snapshots,
            telemetry: telemetry.map_err(|error| runs_already(plan, error))?,
            announcers: Vec::new(),
            alarms: Vec::new(),
            participant,
        };
        let mut ready = Vec::new();
        let built = engines.into_iter().zip(taps);
        for (index, (task, (engine, tap))) in plan.tasks.iter().zip(built).enumerate() {
            ready.push(threads.spawn(task, cpus.pinning(index), engine, tap, &mut parts)?);
        }
        let mut grants = Vec::new();
        for (index, ready) in ready.into_iter().enumerate() {
            let Ok(ready) = ready.recv() else {
                return Err(threads.lost(index).into());
            };
            let Ready { grant, desks } = ready?;
            if let Some(lane) = parts.operating.lock().lanes.get_mut(index) {
                lane.grant = Some(grant.clone());
                lane.cpu_reason = cpus.reason(index).filter(|_| grant.cpu.is_some());
            }
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
        let serving = parts.participant.clone().filter(|_| plan.control != Access::Off);
        let serving = serving.map(|participant| Serving::open(participant, plan, &parts.operating));
        let serving = serving.transpose()?;
        let layouts = task_layouts(plan);
        Ok(Self { serving, threads, parts, grants, cycles: None, layouts })
    }

    /// Ends the node when its first task has run this many cycles; with `Some(0)`, that is at its start.
    pub fn with_cycles(self, cycles: Option<u64>) -> Self {
        Self { cycles, ..self }
    }

    /// Writes what is done to the node's values into a journal, from its start to its end. Transactions
    /// are counted on from the last run in it, and while it cannot be written, changes are refused.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn with_journal(self, mut journal: Journal) -> Result<Self, JournalError> {
        journal.begin(unix_ns())?;
        self.parts.operating.lock().keep(journal)?;
        Ok(self)
    }

    /// Records the node in a file, which people know as `name`, from its first cycle to its last: every cycle of
    /// every task with its inputs and outputs, and what is done to the node's values. A thread of its own
    /// writes; what it cannot write is counted, and the node runs on.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn with_recording(
        self,
        name: impl Into<String>,
        out: impl RecordingFile,
    ) -> Result<Self, WriteError> {
        let mut operating = self.parts.operating.lock();
        let source = operating.configuration.source.clone();
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let node =
            recording::RecordedNode { name: self.parts.node.clone(), version, file: source.name };
        let recording = Recording::start(name.into(), out, &node, &source.text)?;
        for (task, (lane, layout)) in operating.lanes.iter_mut().zip(&self.layouts).enumerate() {
            let (recorder, capture) = Recorder::new(layout.clone());
            recording.add(task, capture);
            lane.orders.record(recorder);
        }
        operating.recording = Some(recording);
        drop(operating);
        Ok(self)
    }

    /// What the machine granted each task, by its name.
    pub fn grants(&self) -> impl Iterator<Item = (&str, &ThreadGrant)> {
        self.parts.tasks.iter().map(|task| task.name.as_str()).zip(&self.grants)
    }

    /// What the machine refused the tasks. The node runs without it, less punctually.
    pub fn refusals(&self) -> impl Iterator<Item = &GrantRefusal> {
        self.grants.iter().flat_map(|grant| &grant.refusals)
    }

    /// What people are to know of the node beforehand.
    pub fn alarms(&self) -> &[Alarm] {
        &self.parts.alarms
    }

    /// Starts all tasks on one grid.
    pub fn start(mut self) -> Running<S> {
        let epoch_ns = next_epoch_ns();
        self.threads.start(epoch_ns, self.cycles);
        self.parts.operating.lock().start(epoch_ns);
        if let Some(serving) = &mut self.serving {
            serving.start();
        }
        Running::new(self.serving, self.threads, self.parts, epoch_ns)
    }
}

impl<S: Service> std::fmt::Debug for Prepared<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prepared").field("grants", &self.grants).finish_non_exhaustive()
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
