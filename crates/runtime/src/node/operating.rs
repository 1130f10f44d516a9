//! The operating state of a running node, shared by its supervisor and the threads of the program that embeds it.

mod held;
mod journaling;
mod keeping;
mod lane;
mod twin;

use std::collections::VecDeque;
use std::iter;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use isochrone_control::desk::{
    Changes, Operator, OrderOutcome, PreparedRequest, Signals, ValueWarning,
};
use isochrone_engine::{OwnedRules, Plan, Source, TaskState};

use self::keeping::Keeping;
pub(crate) use self::keeping::RequestOutcome;
pub(crate) use self::lane::Lane;
use crate::error::SendError;
use crate::keeping::journal::JournalAtTakeover;
use crate::keeping::recorder::Recording;
use crate::keeping::state::{DeskState, FinalState, StateWriting};
use crate::node::process_alarms::ProcessAlarms;
use crate::redundancy::twin::Twin;
use crate::supervisor::NewParts;
use crate::task::clocks::unix_ns;
use crate::task::orders::{Changeover, Returned};
use crate::task::records::Cycle;
use crate::task::snapshots::Snapshots;
use isochrone_control::{Placement, Refusal};

/// A request that is on its way to its tasks.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Sent {
    /// Its number, with which [`Batch`](crate::Batch) reports its outcome.
    pub number: u64,
    /// A warning for each block that will report an error because of its values.
    pub warnings: Vec<ValueWarning>,
}

/// The configuration of a node.
#[derive(Debug, Clone)]
pub(crate) struct Configuration {
    pub(crate) source: Source,
    pub(crate) sha256: String,
    /// Of the text that the node was started with.
    pub(crate) started_sha256: String,
    /// The rules that it was checked against.
    pub(crate) rules: OwnedRules,
    /// Whether it has changed since the start.
    pub(crate) is_changed: bool,
}

/// The operator of a node, and the channels to and from the cycles of its tasks.
pub(crate) struct Operating {
    pub(crate) operator: Operator,
    pub(crate) configuration: Configuration,
    /// What was last handed out to be saved.
    saved: Changes,
    pub(crate) lanes: Vec<Lane>,
    pub(crate) process_alarms: ProcessAlarms,
    keeping: Keeping,
    /// What no cycle had to do, and is to be passed on.
    noted: Vec<RequestOutcome>,
    pub(crate) recording: Option<Recording>,
    /// Where its state is retained.
    pub(crate) state: Option<StateWriting>,
    /// While it is set, the tasks send nothing.
    is_held: Arc<AtomicBool>,
    /// Where this is one of two processes of the node.
    pub(crate) twin: Option<Arc<Twin>>,
    /// Whether it held the node when it was last looked.
    held: bool,
    /// The journal when this process has taken over.
    pub(crate) journal_at_takeover: Option<JournalAtTakeover>,
    /// In which cycle of the first task the standby was gone, until another one follows.
    pub(crate) standby_gone: Option<u64>,
    /// What waits for the standby.
    awaited: VecDeque<RequestOutcome>,
    /// How many configurations all tasks have had before this one.
    changes: u64,
    epoch_ns: u64,
    pub(crate) snapshots: Snapshots,
    /// The parts that belong to a configuration on its way to the tasks.
    expected: Option<NewParts>,
}

/// The [`Operating`] of a node. It is locked for short work only, and never by a cycle.
#[derive(Clone)]
pub(crate) struct Shared(Arc<Mutex<Operating>>);

impl Shared {
    pub(crate) fn new(
        operator: Operator,
        plan: &Plan,
        lanes: Vec<Lane>,
        snapshots: Snapshots,
    ) -> Self {
        let Plan { source, rules, .. } = plan;
        let (source, sha256, rules) = (source.clone(), source.sha256(), rules.clone());
        let (started_sha256, is_changed) = (sha256.clone(), false);
        Self(Arc::new(Mutex::new(Operating {
            operator,
            configuration: Configuration { source, sha256, started_sha256, rules, is_changed },
            saved: Changes::default(),
            lanes,
            process_alarms: ProcessAlarms::of(plan),
            keeping: Keeping::default(),
            noted: Vec::new(),
            recording: None,
            state: None,
            is_held: Arc::default(),
            twin: None,
            held: true,
            journal_at_takeover: None,
            standby_gone: None,
            awaited: VecDeque::new(),
            changes: 0,
            epoch_ns: u64::MAX,
            snapshots,
            expected: None,
        })))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Operating> {
        // After a panic of another thread the state is still usable, and its requests are under way.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Searches the index of names without the lock, as that may take some tenths of a second. Returns with the lock
    /// held, and the index still being the node's.
    pub(crate) fn search<T>(
        &self,
        find: impl Fn(&Arc<Signals>) -> Result<T, Refusal>,
    ) -> Result<(MutexGuard<'_, Operating>, T), Refusal> {
        loop {
            let signals = Arc::clone(self.lock().operator.signals());
            let found = find(&signals)?;
            let operating = self.lock();
            if Arc::ptr_eq(operating.operator.signals(), &signals) {
                return Ok((operating, found));
            }
            // The configuration has changed meanwhile.
        }
    }
}

impl Operating {
    /// The values that are to be saved, which count as saved from then on.
    pub(crate) fn hand_out_changes(&mut self) -> Changes {
        self.saved = self.operator.to_save();
        self.saved.clone()
    }

    /// The values that are lost with the node: neither the configuration has them nor what was handed out.
    pub(crate) fn unsaved(&self) -> Changes {
        self.operator.to_save().beyond(&self.saved)
    }

    pub(crate) fn start(&mut self, epoch_ns: u64) {
        self.epoch_ns = epoch_ns;
    }

    /// The number of each task's first cycle.
    pub(crate) fn first_numbers(&self) -> Vec<u64> {
        self.lanes.iter().map(|lane| lane.first_cycle).collect()
    }

    /// Whether no task runs any more; the rings then have everything that the tasks did.
    pub(crate) fn have_ended(&self) -> bool {
        self.lanes.iter().all(Lane::has_ended)
    }

    /// The names of the tasks that run.
    pub(crate) fn unfinished(&self) -> impl Iterator<Item = &str> {
        self.lanes.iter().filter(|lane| !lane.has_ended()).map(|lane| lane.name.as_str())
    }

    /// The first cycle of each task that has not begun.
    pub(crate) fn next_cycles(&self, now_ns: u64) -> Vec<u64> {
        self.lanes.iter().map(|lane| lane.next_cycle(self.epoch_ns, now_ns)).collect()
    }

    /// The first cycle of each task that is due at an instant or later.
    pub(crate) fn first_cycles(&self, instant_ns: u64) -> Vec<u64> {
        self.lanes.iter().map(|lane| lane.cycle_due_at(self.epoch_ns, instant_ns)).collect()
    }

    /// When a task's cycle is due, in ns of `CLOCK_MONOTONIC`.
    pub(crate) fn release_ns(&self, task: usize, cycle: u64) -> u64 {
        self.lanes.get(task).map_or(0, |lane| lane.release_ns(self.epoch_ns, cycle))
    }

    /// When cycle 0 of each task was due, or would have been, and its period, in ns; modulo 2^64.
    pub(crate) fn grids(&self) -> Vec<(u64, u64)> {
        self.lanes.iter().map(|lane| lane.grid(self.epoch_ns)).collect()
    }

    /// How long a task has not run where it should have, in ns, see [`Lane::stands_ns`].
    pub(crate) fn stands_ns(&self, task: usize, now_ns: u64) -> Option<u64> {
        self.lanes.get(task)?.stands_ns(self.epoch_ns, now_ns)
    }

    /// When a task needs which CPU; `None` before its start.
    pub(crate) fn placement(&self, task: usize) -> Option<Placement> {
        self.lanes.get(task)?.placement(self.epoch_ns)
    }

    /// What the machine refused the threads of the tasks.
    pub(crate) fn refusals(&self) -> Vec<isochrone_cyclic::GrantRefusal> {
        let grants = self.lanes.iter().filter_map(|lane| lane.grant.as_ref());
        grants.flat_map(|grant| grant.refusals.iter().cloned()).collect()
    }

    /// Sends a request to its tasks.
    pub(crate) fn send(&mut self, prepared: PreparedRequest) -> Result<Sent, SendError> {
        if self.have_ended() {
            return Err(SendError::Ended);
        }
        let has_room = |lane: &Lane| {
            if prepared.is_reading() {
                lane.orders.has_room_to_read()
            } else if prepared.is_release() {
                lane.orders.has_room_to_release()
            } else {
                lane.orders.has_room()
            }
        };
        let full = prepared.tasks().find_map(|task| {
            let lane = self.lanes.get(task).filter(|lane| !has_room(lane))?;
            Some((task, lane))
        });
        if let Some((task, full)) = full {
            let by = if prepared.is_reading() {
                "readings".to_owned()
            } else {
                self.operator.waiting_for(task)
            };
            return Err(SendError::Busy { task: full.name.clone(), by });
        }
        let warnings = prepared.warnings.clone();
        let (number, orders) = self.operator.send(prepared);
        for (task, order) in orders {
            if let Some(lane) = self.lanes.get_mut(task) {
                lane.orders.send(order);
            }
        }
        Ok(Sent { number, warnings })
    }

    /// Keeps the parts of a configuration that is on its way to the tasks.
    pub(crate) fn expect(&mut self, parts: NewParts, snapshots: Snapshots) {
        self.expected = Some(parts);
        self.snapshots.expect(snapshots);
    }

    /// The parts of a configuration that all tasks have reached since the last call.
    pub(crate) fn arrived(&mut self) -> Option<NewParts> {
        if self.operator.changing().is_some() {
            return None;
        }
        let parts = self.expected.take()?;
        let Configuration { source, sha256, is_changed, .. } = &mut self.configuration;
        (*source, *sha256) = (parts.source.clone(), parts.source.sha256());
        *is_changed = true;
        self.twin.iter().for_each(|twin| twin.end_change(Some(sha256)));
        self.journal_at_takeover.iter_mut().for_each(|journal| journal.change_over(source));
        self.changes += 1;
        Some(parts)
    }

    /// Has the state of the node written, if that is due.
    pub(crate) fn retain(&mut self) {
        let cycle = self.lanes.first().and_then(|lane| lane.last).map_or(0, |last| last.cycle);
        let Self { state, operator, process_alarms, .. } = self;
        // While some tasks have another configuration and others have not, nothing is one whole.
        if let Some(state) = state.as_mut().filter(|_| operator.changing().is_none()) {
            state.look(cycle, || DeskState::of(operator, process_alarms));
        }
    }

    /// Takes out what writes the state, and what it is to write at the end, so that the disk is waited for without the
    /// lock. Each task has its state and the number of its configuration.
    pub(crate) fn take_state(
        &mut self,
        tasks: Vec<Option<(TaskState, u64)>>,
    ) -> Option<(StateWriting, FinalState)> {
        // The end may come when some tasks have changed to another configuration and others have not.
        let is_same = |of_task: &(TaskState, u64)| of_task.1 == self.changes;
        let own =
            |of_task: Option<(TaskState, u64)>| of_task.filter(is_same).map(|(state, _)| state);
        let tasks = tasks.into_iter().map(own).collect();
        let desk = self.desk_state();
        Some((self.state.take()?, FinalState { desk, tasks }))
    }

    /// What the desk has for the next run.
    pub(crate) fn desk_state(&self) -> DeskState {
        DeskState::of(&self.operator, &self.process_alarms)
    }

    /// Whether a request is on its way to a cycle, or waits for the journal or the standby.
    pub(crate) fn is_under_way(&self) -> bool {
        !self.awaited.is_empty()
            || self.keeping.holds_any()
            || self.lanes.iter().any(|lane| lane.orders.is_under_way())
    }

    /// Collects the requests that cycles have handled, and frees them; returns the outcomes that are final. Outcomes
    /// that the journal must have first are held until it has them. Only the supervisor calls this: it passes the
    /// outcomes on to those who asked.
    pub(crate) fn take_back(&mut self) -> Vec<RequestOutcome> {
        let mut returned = Vec::new();
        for (task, lane) in self.lanes.iter_mut().enumerate() {
            returned.extend(iter::from_fn(|| lane.orders.returned()).map(|it| (task, it)));
        }
        // Asked after them: what a cycle returned that took the node over is journaled.
        let holds = self.follow_role();
        let Self { operator, lanes, .. } = self;
        let mut came = Vec::new();
        for (task, returned) in returned {
            came.push(match returned {
                // One by which a standby follows, or of a holder that was taken over.
                Returned::Order(order) if !holds || !operator.has_sent(&order) => continue,
                Returned::Order(order) => operator.done(task, order, unix_ns()),
                Returned::Trace(tracer) => {
                    if let Some(lane) = lanes.get_mut(task) {
                        lane.traces.retain(|traced| traced.number != tracer.number);
                    }
                    continue;
                }
                Returned::Changed(changeover) => {
                    let Changeover { replacement, .. } = *changeover;
                    OrderOutcome::Applied(operator.replaced(task, replacement, unix_ns()))
                }
                Returned::Ended(ended, cycle) => {
                    OrderOutcome::Applied(operator.expired(task, ended, cycle, unix_ns()))
                }
            });
        }
        let mut outcomes = std::mem::take(&mut self.noted);
        for done in came {
            if let (OrderOutcome::Applied(entry), Some(recording)) = (&done, &mut self.recording) {
                recording.note(entry);
            }
            let done = self.keeping.hold(done);
            outcomes.extend(done.map(|done| RequestOutcome { done, unwritten: None }));
        }
        let last = self.lanes.first().and_then(|lane| lane.last);
        if let Some(progress) = self.keeping.look(last.map_or(0, |last| last.cycle)) {
            outcomes.extend(iter::from_fn(|| self.keeping.next(&progress)));
            self.operator.number_after(progress.last_transaction);
            self.operator.set_unwritten(progress.unwritten);
        }
        if self.twin.is_some() { self.await_standby(outcomes) } else { outcomes }
    }

    /// Records a cycle of a task.
    pub(crate) fn note_cycle(&mut self, task: usize, cycle: &Cycle) {
        let Some(lane) = self.lanes.get_mut(task) else { return };
        let record = &cycle.record;
        lane.last = Some(*record);
        lane.seconds.note(cycle);
        lane.responses.note(record);
    }
}
