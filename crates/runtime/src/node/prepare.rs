//! From a plan to threads that wait for the start.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use isochrone_control::desk::{AlarmRecord, Feeds, Operator, PreparedRequest};
use isochrone_cyclic::{Clock, GrantRefusal, Monotonic, ThreadGrant, lock_new_memory_as_touched};
use isochrone_engine::config::{OnWarmStart, Retain};
use isochrone_engine::{AlarmPlan, Plan, TaskEngine, TaskPlan};
use isochrone_ipc::{OpenError, Participant, RealTime, Service, local};
use isochrone_model::epoch_after_ns;
use isochrone_recording::{self as recording, TaskLayout, WriteError};

use crate::error::PrepareError;
use crate::keeping::guard::WriteGuard;
use crate::keeping::journal::{Journal, JournalAtTakeover, JournalError};
use crate::keeping::recorded::task_layouts;
use crate::keeping::recorder::{Recorder, Recording, RecordingFile};
use crate::keeping::state::{NodeState, Restoration, Restored, Retention, StateWriting, restore};
use crate::node::alarms::Alarm;
use crate::node::operating::Shared;
use crate::node::running::Running;
use crate::placement::TaskCpus;
use crate::redundancy::Redundancy;
use crate::redundancy::paired::NewPaired;
use crate::redundancy::relay::service_name;
use crate::redundancy::room::make_room;
use crate::redundancy::twin::Twin;
use crate::supervisor::{Equipment, Events, NewSupervisor, NodeServices, Start, Supervisor, cuts};
use crate::task::clocks::unix_ns;
use crate::task::cycle::Ready;
use crate::task::snapshots::Snapshots;
use crate::task::threads::{Connections, RetainedTask, Spawned, Threads};
use crate::task::{outputs, retained};

/// Time from the end of the set-up to the first release.
const START_DELAY_NS: u64 = 20_000_000;

/// An instant, a little more than 20 ms from now, at which a grid may begin: [`epoch_after_ns`].
pub fn next_epoch_ns() -> u64 {
    epoch_after_ns(Monotonic.now_ns() + START_DELAY_NS)
}

/// A control node. Its states are types: [`Prepared`], [`Running`], [`Outcome`](crate::Outcome).
#[derive(Debug)]
pub enum Node {}

impl Node {
    /// Opens the ports of a plan's tasks in threads of their own, which then wait for the start, and those of the
    /// node's supervisor in its thread.
    ///
    /// The participant joins again for real time. Inputs that name no service are given by
    /// [`Running::set`]. Memory is locked by
    /// [`prepare_process`](isochrone_cyclic::prepare_process), which is the program's to call.
    ///
    /// Where the configuration leaves the CPU of a task open (`cpu = "auto"`), the machine is observed for
    /// 200 ms and the best one chosen, as [`TaskCpus::of`] says.
    ///
    /// Unless the configuration says `control = "off"`, the supervisor serves the requests of other programs
    /// ([`control`](isochrone_control)) from the start to the end of the node.
    ///
    /// With `retain = true` the node goes on where it ended last, and writes its state to its
    /// [usual file](crate::state::StateFile::of).
    ///
    /// # Errors
    /// A node of this name runs already, a port or a thread cannot be created, or its state not restored.
    pub fn prepare<S: Service + 'static>(
        plan: &Plan,
        participant: Participant<S>,
    ) -> Result<Prepared, PrepareError> {
        Self::prepare_at(plan, &TaskCpus::of(plan), Retention::of(plan)?, participant)
    }

    /// As [`prepare`](Self::prepare), with the tasks on CPUs that were chosen before, and the state that was found.
    ///
    /// # Errors
    /// A node of this name runs already, or a port or a thread cannot be created.
    pub fn prepare_at<S: Service + 'static>(
        plan: &Plan,
        cpus: &TaskCpus,
        retention: Option<Retention>,
        participant: Participant<S>,
    ) -> Result<Prepared, PrepareError> {
        Prepared::new(plan, cpus, retention, Some(Arc::new(participant.for_real_time()?)), None)
    }

    /// As [`prepare_at`](Self::prepare_at), as one of two processes of the node. One that stands by starts its tasks as
    /// any other, which follow those of the holder. It retains nothing.
    ///
    /// # Errors
    /// A port or a thread cannot be created, or the node's state is too large to be handed over in every cycle.
    pub fn prepare_redundant<S: Service + 'static>(
        plan: &Plan,
        cpus: &TaskCpus,
        retention: Option<Retention>,
        participant: Participant<S>,
        redundancy: &Redundancy,
    ) -> Result<Prepared, PrepareError> {
        let participant = Arc::new(participant.as_twin().for_real_time()?);
        let twin = Some(Arc::clone(&redundancy.twin));
        Prepared::new(plan, cpus, retention, Some(participant), twin)
    }

    /// Prepares a node without services: its inputs are set with [`Running::set`], its signals are read with
    /// [`Running::value`], and no other program sees it.
    ///
    /// # Errors
    /// A thread cannot be created, or the state of the node not restored.
    pub fn prepare_alone(plan: &Plan) -> Result<Prepared, PrepareError> {
        Prepared::new::<local::Service>(plan, &TaskCpus::of(plan), Retention::of(plan)?, None, None)
    }
}

/// A node whose ports are open and whose threads wait. Dropping it ends them.
#[must_use = "dropping it ends its threads"]
pub struct Prepared {
    // The threads end before the supervisor does, as in a node that runs.
    threads: Threads,
    supervisor: Supervisor,
    shared: Shared,
    node: String,
    grants: Vec<(String, ThreadGrant)>,
    alarms: Vec<Alarm>,
    cycles: Option<u64>,
    layouts: Vec<TaskLayout>,
    restored: Option<Restored>,
    /// The state that tasks go on from.
    state: Option<NodeState>,
    /// Sets what was set in an earlier run.
    request: Option<PreparedRequest>,
    /// Where this is one of two processes of the node.
    twin: Option<Arc<Twin>>,
}

/// The alarms of a task that were active, by their index.
fn active_in(records: &HashMap<&str, &AlarmRecord>, task: &TaskPlan) -> Vec<usize> {
    let alarms = task.alarms.iter().enumerate();
    let was_active =
        |alarm: &AlarmPlan| records.get(alarm.name.as_str()).is_some_and(|it| it.active);
    alarms.filter(|(_, alarm)| was_active(alarm)).map(|(index, _)| index).collect()
}

impl Prepared {
    fn new<S: Service + 'static>(
        plan: &Plan,
        cpus: &TaskCpus,
        mut retention: Option<Retention>,
        participant: Option<Arc<RealTime<S>>>,
        twin: Option<Arc<Twin>>,
    ) -> Result<Self, PrepareError> {
        let mut engines = TaskEngine::build(plan)?;
        let has_services = participant.is_some();
        let feeds = if has_services { Feeds::Services } else { Feeds::Program };
        let mut operator = Operator::new(plan, feeds);
        let found = retention.as_mut().and_then(|retention| retention.found.take());
        let Restoration { warm, request, set, restored, cold_start } =
            restore(found.as_ref(), plan, &mut engines, &mut operator);
        let (is_found, is_warm) = (found.is_some(), warm.tasks.iter().any(Option::is_some));
        let state = found.filter(|_| is_warm);
        let state = state.map(|found| found.state.only(&warm.tasks, set));
        let found = retention.iter_mut().flat_map(|retention| retention.alarms.drain(..));
        let mut found: Vec<Alarm> = found.chain(cold_start).collect();
        if let Some(participant) = &participant {
            let outputs = plan.tasks.iter().flat_map(|task| &task.outputs);
            let services: Vec<_> = outputs.map(|output| output.service.as_str()).collect();
            participant.ordinary().refuse_far_writers(&services)?;
        }
        let (snapshots, taps) = Snapshots::of(plan);
        let layout = snapshots.layout().clone();
        let supervisor =
            NewSupervisor::spawn(participant.clone(), &plan.node, layout, twin.clone());
        let supervisor = supervisor.map_err(|error| runs_already(plan, error))?;
        let mut threads = Threads::default();
        let mut spawned = Vec::new();
        let mut copies = Vec::new();
        let records = warm.alarms.iter().map(|record| (record.name.as_str(), record)).collect();
        if let Some(twin) = &twin {
            make_room(twin, plan, &engines)?;
        }
        let built = engines.into_iter().zip(taps).zip(warm.tasks);
        for (index, (task, ((engine, tap), warm))) in plan.tasks.iter().zip(built).enumerate() {
            let cpu = cpus.pinning(index);
            let period_ns = task.settings.period_ns;
            // A state that no copy of this run has replaced is as old as it was found.
            let since = warm.as_ref().map_or_else(unix_ns, |warm| warm.unix_ns);
            let ends = retention.as_ref().map(|_| retained::ends(&engine, task, since));
            let (copier, of_task) = ends.unzip();
            copies.extend(of_task.map(|copies| (task.name.clone(), period_ns, copies)));
            let active = active_in(&records, task);
            let retained = RetainedTask { warm, copier: copier.map(Box::new), active };
            let paired = twin.as_ref().zip(participant.as_ref()).map(|(twin, participant)| {
                let (twin, participant) = (Arc::clone(twin), Arc::clone(participant));
                let service = service_name(&plan.node, &task.name);
                let schedule = task.settings.schedule();
                NewPaired { participant, twin, task: index, service, schedule }
            });
            let connections = Connections { participant: participant.as_ref(), paired };
            spawned.push(threads.spawn(task, cpu, engine, tap, retained, connections)?);
        }
        let (mut lanes, mut tasks) = (Vec::new(), Vec::new());
        let (mut grants, mut desks) = (Vec::new(), Vec::new());
        for (index, Spawned { ready, mut lane, task }) in spawned.into_iter().enumerate() {
            let Ok(ready) = ready.recv() else {
                return Err(threads.lost(index).into());
            };
            let Ready { grant, desks: of_task } = ready?;
            lane.grant = Some(grant.clone());
            lane.cpu_reason = cpus.reason(index).filter(|_| grant.cpu.is_some());
            grants.push((lane.name.clone(), grant));
            lanes.push(lane);
            tasks.push(task);
            desks.push(of_task);
        }
        let shared = Shared::new(operator, plan, lanes, snapshots);
        shared.lock().process_alarms.restore(&records);
        twin.iter().for_each(|twin| shared.lock().join_twin(Arc::clone(twin)));
        let is_confirmed = |retain: Retain| retain.on_warm_start == OnWarmStart::Confirm;
        if plan.retain.is_some_and(is_confirmed) && is_found {
            shared.lock().hold(&threads.is_held);
        }
        if let Some(retention) = retention {
            let mut operating = shared.lock();
            let desk = operating.desk_state();
            let (node, source) = (&plan.node, &plan.source);
            let state = StateWriting::start(
                retention,
                node,
                source,
                copies,
                desk,
                WriteGuard::of(twin.as_ref()),
            )?;
            let shortages = state.shortages().map(|reason| Alarm::StateNotRetained { reason });
            found.extend(shortages);
            operating.state = Some(state);
        }
        let alarms: Vec<Alarm> = cuts(plan).filter(|_| has_services).chain(found).collect();
        let outputs = plan.tasks.iter().flat_map(outputs::of_task).collect();
        let services = NodeServices { desks, outputs, control: plan.control };
        let (of_node, known) = (shared.clone(), alarms.clone());
        let equipment = Equipment { shared: of_node, tasks, alarms: known, services };
        let supervisor = supervisor.equip(equipment)?;
        let (node, layouts) = (plan.node.clone(), task_layouts(plan));
        let cycles = None;
        Ok(Self {
            threads,
            supervisor,
            shared,
            node,
            grants,
            alarms,
            cycles,
            layouts,
            restored,
            state,
            request,
            twin,
        })
    }

    /// Ends the node when its first task has run this many cycles; with `Some(0)`, that is at its start.
    pub fn with_cycles(self, cycles: Option<u64>) -> Self {
        Self { cycles, ..self }
    }

    /// Writes all changes of the node's values into a journal, from its start to its end. Transaction numbers
    /// continue from the last run in it, and while it cannot be written, changes are refused.
    ///
    /// # Errors
    /// The journal cannot be written.
    pub fn with_journal(self, mut journal: Journal) -> Result<Self, JournalError> {
        journal.guard = WriteGuard::of_holder(self.twin.as_ref());
        journal.begin(unix_ns())?;
        self.shared.lock().keep(journal)?;
        Ok(self)
    }

    /// As [`with_journal`](Self::with_journal), whenever this process takes the node over from the other one of two.
    pub fn with_journal_at_takeover(self, path: &Path, plan: &Plan) -> Self {
        self.shared.lock().journal_at_takeover = Some(JournalAtTakeover::new(path, plan));
        self
    }

    /// Records the node from its first cycle to its last: every cycle of every task with its inputs and outputs, and
    /// all changes of the node's values. `name` is the file's name for messages. A thread of its own writes; what it
    /// cannot write is counted, and the node runs on.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn with_recording(
        mut self,
        name: impl Into<String>,
        out: impl RecordingFile,
    ) -> Result<Self, WriteError> {
        let mut operating = self.shared.lock();
        let source = operating.configuration.source.clone();
        let state = self.state.take().map(|state| state.to_bytes());
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let node = recording::RecordedNode { name: self.node.clone(), version, file: source.name };
        let mut recording = Recording::start(name.into(), out, &node, &source.text, state)?;
        for (task, (lane, layout)) in operating.lanes.iter_mut().zip(&self.layouts).enumerate() {
            let (recorder, capture) = Recorder::new(layout.clone());
            recording.begin(task, capture, lane.first_cycle);
            lane.orders.record(recorder);
        }
        operating.recording = Some(recording);
        drop(operating);
        Ok(self)
    }

    /// The events of the node from its first cycle on.
    pub fn events(&self) -> Events {
        self.supervisor.events()
    }

    /// What the machine granted each task, by its name.
    pub fn grants(&self) -> impl Iterator<Item = (&str, &ThreadGrant)> {
        self.grants.iter().map(|(task, grant)| (task.as_str(), grant))
    }

    /// What the machine refused the tasks. The node runs without it, less on time.
    pub fn refusals(&self) -> impl Iterator<Item = &GrantRefusal> {
        self.grants.iter().flat_map(|(_, grant)| &grant.refusals)
    }

    /// What it goes on with; `None`: it retains no state, or there was none.
    pub fn restored(&self) -> Option<&Restored> {
        self.restored.as_ref()
    }

    /// Whether it will send nothing before it is [told to](Running::start_sending).
    pub fn is_held(&self) -> bool {
        self.threads.is_held.load(Ordering::Relaxed)
    }

    /// Warnings about the node before its start.
    pub fn alarms(&self) -> &[Alarm] {
        &self.alarms
    }

    /// Starts all tasks on one grid.
    pub fn start(self) -> Running {
        let Self { threads, mut supervisor, shared, cycles, request, twin, .. } = self;
        if let Some(request) = request {
            // The first cycle takes it; before the start there is room.
            let _ = shared.lock().send(request);
        }
        lock_new_memory_as_touched();
        let epoch_ns = match twin {
            Some(twin) => twin.start(next_epoch_ns(), &shared.lock().first_numbers()),
            None => next_epoch_ns(),
        };
        let started = SystemTime::now();
        let stop = Arc::clone(&threads.stop);
        threads.start(epoch_ns, cycles);
        shared.lock().start(epoch_ns);
        supervisor.start(Start { threads, started });
        Running::new(supervisor, shared, stop, epoch_ns)
    }
}

impl std::fmt::Debug for Prepared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prepared").field("grants", &self.grants).finish_non_exhaustive()
    }
}

/// A node's telemetry has one publisher, so a second one means that the node runs already.
fn runs_already(plan: &Plan, error: PrepareError) -> PrepareError {
    match error {
        PrepareError::Open(OpenError::SecondPublisher { other, .. }) => {
            PrepareError::RunsAlready { node: plan.node.clone(), other }
        }
        error => error,
    }
}
