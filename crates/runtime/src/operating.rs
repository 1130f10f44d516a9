//! What operators do to a running node: shared by the thread that polls it and the one that serves the
//! requests of others.

mod keeping;
mod lane;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use isochrone_control::desk::{Done, Operator, PreparedRequest, Reading, Unwritten, ValueWarning};
use isochrone_engine::{OwnedRules, Plan, Source};
use isochrone_model::{Action, Entry};

use self::keeping::Keeping;
pub(crate) use self::lane::Lane;
use crate::error::SendError;
use crate::faults::Active;
use crate::journal::{Journal, JournalError, Writing};
use crate::new_parts::NewParts;
use crate::orders::{Changeover, Returned};
use crate::recorder::Recording;
use crate::records::Cycle;
use crate::snapshots::Snapshots;
use isochrone_control::Placement;

/// A request that is on its way to its tasks.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Sent {
    /// Its number, by which [`Poll`](crate::Poll) says what has become of it.
    pub number: u64,
    /// What its values will make blocks do, for each block that will report an error.
    pub warnings: Vec<ValueWarning>,
}

/// Who sends a request, and is told what has become of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// The program that runs the node.
    Program,
    /// The control service.
    Service,
}

/// What came back, for the program. Of what the service asked for, only what was changed is told.
#[derive(Debug, Default)]
pub(crate) struct Returns {
    pub(crate) applied: Vec<Entry>,
    /// The transactions of those that are not in the journal's file.
    pub(crate) unwritten: Vec<u64>,
    pub(crate) too_late: Vec<u64>,
    pub(crate) readings: Vec<Reading>,
}

/// What came back of a request.
#[derive(Debug)]
pub(crate) struct Told {
    pub(crate) done: Done,
    /// Why the journal does not have it, where it should.
    pub(crate) unwritten: Option<Unwritten>,
}

/// What a node was made from.
#[derive(Debug, Clone)]
pub(crate) struct Configuration {
    pub(crate) source: Source,
    pub(crate) sha256: String,
    /// Of the text that the node was started with.
    pub(crate) started_sha256: String,
    /// What it was checked against.
    pub(crate) rules: OwnedRules,
    /// Whether it is another one than at the start.
    pub(crate) is_changed: bool,
}

/// The operator of a node, and the ways to and from the cycles of its tasks.
pub(crate) struct Operating {
    pub(crate) operator: Operator,
    pub(crate) configuration: Configuration,
    pub(crate) lanes: Vec<Lane>,
    keeping: Keeping,
    pub(crate) recording: Option<Recording>,
    epoch_ns: u64,
    has_ended: bool,
    returns: Returns,
    /// The service's requests, and from how many tasks each has not come back.
    of_service: BTreeMap<u64, usize>,
    for_service: Vec<Told>,
    /// What goes with a configuration that is on its way to the tasks.
    expected: Option<NewParts>,
    /// What shows the signals of configurations that are on their way, until that is asked for.
    coming: Vec<Snapshots>,
    /// What goes with those that all tasks have since the program was told last.
    arrived: Vec<NewParts>,
}

/// The [`Operating`] of a node. It is locked for short work only, and never by a cycle.
#[derive(Clone)]
pub(crate) struct Shared(Arc<Mutex<Operating>>);

impl Shared {
    pub(crate) fn new(operator: Operator, plan: &Plan) -> Self {
        let Plan { source, rules, .. } = plan;
        let (source, sha256, rules) = (source.clone(), source.sha256(), rules.clone());
        let (started_sha256, is_changed) = (sha256.clone(), false);
        Self(Arc::new(Mutex::new(Operating {
            operator,
            configuration: Configuration { source, sha256, started_sha256, rules, is_changed },
            lanes: Vec::new(),
            keeping: Keeping::default(),
            recording: None,
            epoch_ns: u64::MAX,
            has_ended: false,
            returns: Returns::default(),
            of_service: BTreeMap::new(),
            for_service: Vec::new(),
            expected: None,
            coming: Vec::new(),
            arrived: Vec::new(),
        })))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, Operating> {
        // What a thread that panicked had sent is on its way all the same.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Operating {
    pub(crate) fn start(&mut self, epoch_ns: u64) {
        self.epoch_ns = epoch_ns;
    }

    /// Takes note that no task runs any more.
    pub(crate) fn end(&mut self) {
        self.has_ended = true;
    }

    pub(crate) fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// Whether no task runs any more, and all that was done has been told.
    pub(crate) fn is_over(&self) -> bool {
        self.has_ended && !self.keeping.holds_any()
    }

    /// The first cycle of each task that has not begun.
    pub(crate) fn next_cycles(&self, now_ns: u64) -> Vec<u64> {
        self.lanes.iter().map(|lane| lane.next_cycle(self.epoch_ns, now_ns)).collect()
    }

    /// The first cycle of each task that is due at an instant or later.
    pub(crate) fn first_cycles(&self, instant_ns: u64) -> Vec<u64> {
        self.lanes.iter().map(|lane| lane.first_cycle(self.epoch_ns, instant_ns)).collect()
    }

    /// When a task's cycle is due, in ns of `CLOCK_MONOTONIC`.
    pub(crate) fn release_ns(&self, task: usize, cycle: u64) -> u64 {
        self.lanes.get(task).map_or(0, |lane| lane.release_ns(self.epoch_ns, cycle))
    }

    /// How long a task has not run where it should have, in ns, see [`Lane::stands_ns`].
    pub(crate) fn stands_ns(&self, task: usize, now_ns: u64) -> Option<u64> {
        self.lanes.get(task)?.stands_ns(self.epoch_ns, now_ns)
    }

    /// When a task needs which CPU; `None` before its start.
    pub(crate) fn placement(&self, task: usize) -> Option<Placement> {
        self.lanes.get(task)?.placement(self.epoch_ns)
    }

    /// What the machine refused the tasks' threads.
    pub(crate) fn refusals(&self) -> Vec<isochrone_cyclic::GrantRefusal> {
        let grants = self.lanes.iter().filter_map(|lane| lane.grant.as_ref());
        grants.flat_map(|grant| grant.refusals.iter().cloned()).collect()
    }

    /// Sends a request to its tasks.
    pub(crate) fn send(
        &mut self,
        origin: Origin,
        prepared: PreparedRequest,
    ) -> Result<Sent, SendError> {
        if self.has_ended {
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
        self.note_sent(origin, number, orders.len());
        for (task, order) in orders {
            if let Some(lane) = self.lanes.get_mut(task) {
                lane.orders.send(order);
            }
        }
        Ok(Sent { number, warnings })
    }

    /// Takes note of a request that was sent to so many tasks.
    pub(crate) fn note_sent(&mut self, origin: Origin, number: u64, tasks: usize) {
        if origin == Origin::Service && tasks > 0 {
            self.of_service.insert(number, tasks);
        }
    }

    /// Takes note of what goes with a configuration that is on its way.
    pub(crate) fn expect(&mut self, parts: NewParts, snapshots: Snapshots) {
        self.expected = Some(parts);
        self.coming.push(snapshots);
    }

    /// What shows the signals of the configurations that were sent since the last time.
    pub(crate) fn coming(&mut self) -> Vec<Snapshots> {
        std::mem::take(&mut self.coming)
    }

    /// What goes with the configurations that all tasks have since the last time.
    pub(crate) fn arrived(&mut self) -> Vec<NewParts> {
        std::mem::take(&mut self.arrived)
    }

    /// Takes in and frees what the cycles gave back.
    pub(crate) fn take_back(&mut self) {
        let Self { operator, lanes, .. } = self;
        let mut came = Vec::new();
        for (task, lane) in lanes.iter_mut().enumerate() {
            while let Some(returned) = lane.orders.returned() {
                came.push(match returned {
                    Returned::Trace(tracer) => {
                        lane.traces.retain(|traced| traced.number != tracer.number);
                        continue;
                    }
                    Returned::Order(order) => operator.done(task, order, unix_ns()),
                    Returned::Changed(changeover) => {
                        let Changeover { replacement, .. } = *changeover;
                        Done::Applied(operator.replaced(task, replacement, unix_ns()))
                    }
                    Returned::Ended(ended, cycle) => {
                        Done::Applied(operator.expired(task, ended, cycle, unix_ns()))
                    }
                });
            }
        }
        if self.operator.changing().is_none()
            && let Some(parts) = self.expected.take()
        {
            let Configuration { source, sha256, is_changed, .. } = &mut self.configuration;
            (*source, *sha256) = (parts.source.clone(), parts.source.sha256());
            *is_changed = true;
            self.arrived.push(parts);
        }
        for done in came {
            if let (Done::Applied(entry), Some(recording)) = (&done, &mut self.recording) {
                recording.note(entry);
            }
            if let Some(done) = self.keeping.hold(done) {
                self.hand_out(Told { done, unwritten: None });
            }
        }
        let last = self.lanes.first().and_then(|lane| lane.last);
        if let Some(standing) = self.keeping.look(last.map_or(0, |last| last.cycle)) {
            while let Some(told) = self.keeping.next(&standing) {
                self.hand_out(told);
            }
            self.operator.set_unwritten(standing.unwritten);
        }
    }

    /// Writes what is done from now on into a journal that has begun.
    pub(crate) fn keep(&mut self, journal: Journal) -> Result<(), JournalError> {
        self.operator.continue_after(journal.last_transaction());
        self.keeping.start(journal)
    }

    /// Takes note of a cycle of a task.
    pub(crate) fn note_cycle(&mut self, task: usize, cycle: &Cycle) {
        let Some(lane) = self.lanes.get_mut(task) else { return };
        let record = &cycle.record;
        lane.last = Some(*record);
        lane.seconds.note(cycle);
        lane.responses.note(record);
    }

    /// That the journal cannot be written, while it cannot.
    pub(crate) fn journal_alarm(&self) -> Option<Active> {
        self.keeping.alarm(self.operator.unwritten())
    }

    /// Has the journal end, when the last cycles are noted.
    pub(crate) fn begin_journal_end(&mut self) {
        if self.has_ended {
            self.keeping.begin_end();
        }
    }

    /// The journal, whose end is to be waited for without a lock.
    pub(crate) fn take_journal(&mut self) -> Option<Writing> {
        self.keeping.take()
    }

    fn hand_out(&mut self, told: Told) {
        let done = &told.done;
        if let (Done::Applied(entry), Some(_)) = (done, &told.unwritten) {
            self.returns.unwritten.push(entry.transaction);
        }
        let number = match done {
            // It is of no request any more.
            Done::Applied(Entry { action: Action::Expiry, .. }) => None,
            Done::Applied(entry) => Some(entry.transaction),
            Done::TooLate { transaction } => Some(*transaction),
            Done::Read(reading) => Some(reading.number),
        };
        let of_service = number.and_then(|number| self.of_service.get_mut(&number));
        if let Some(missing) = of_service {
            *missing -= 1;
            if let (0, Some(number)) = (*missing, number) {
                self.of_service.remove(&number);
            }
            if let Done::Applied(entry) = done {
                self.returns.applied.push(entry.clone());
            }
            self.for_service.push(told);
            return;
        }
        match told.done {
            Done::Applied(entry) => self.returns.applied.push(entry),
            Done::TooLate { transaction } => self.returns.too_late.push(transaction),
            Done::Read(reading) => self.returns.readings.push(reading),
        }
    }

    /// What the program has not been told yet.
    pub(crate) fn returns(&mut self) -> Returns {
        std::mem::take(&mut self.returns)
    }

    /// What has come of the service's requests since the last time.
    pub(crate) fn for_service(&mut self) -> Vec<Told> {
        std::mem::take(&mut self.for_service)
    }
}

/// Now, in ns of UTC since 1970.
pub(crate) fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
