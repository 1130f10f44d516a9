//! What operators do to a running node: shared by the thread that polls it and the one that serves the
//! requests of others.

use std::collections::{BTreeMap, VecDeque};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use isochrone_cyclic::{Schedule, ThreadGrant};
use isochrone_engine::config::PhaseChoice;
use isochrone_engine::operate::{
    Action, Done, Entry, Operator, Prepared, Reading, Unwritten, Warning,
};
use isochrone_engine::{OwnedRules, Plan, Source};
use isochrone_timing::CycleRecord;

use crate::control::{Followed, Placement};
use crate::error::RequestError;
use crate::faults::{Active, Faults};
use crate::journal::{Fate, Journal, JournalError, Mark, Writing};
use crate::new_parts::NewParts;
use crate::orders::{self, Changeover, Returned};
use crate::recorder::Recording;
use crate::responses::Responses;
use crate::snapshots::Snapshots;
use crate::traces::Traced;
use crate::words::Words;

/// How late a cycle may be before its task is said to stand.
const PATIENCE_NS: u64 = 1_000_000_000;

/// A request that is on its way to its tasks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sent {
    /// Its number, by which [`Poll`](crate::Poll) says what has become of it.
    pub number: u64,
    /// What its values will make blocks do, for each block that will report an error.
    pub warnings: Vec<Warning>,
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
    journal: Option<Writing>,
    pub(crate) recording: Option<Recording>,
    /// What is acknowledged when it is known what has become of its line of the journal.
    held: VecDeque<(Mark, Done)>,
    /// How often the journal could not be written, and since which cycle of the first task it cannot be.
    journal_failures: u64,
    unwritten_since: Option<u64>,
    /// What the journal lacks for good, and since which cycle of the first task.
    lost: Option<(Arc<str>, u64)>,
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

/// One task's.
pub(crate) struct Lane {
    pub(crate) name: String,
    pub(crate) schedule: Schedule,
    pub(crate) phase_choice: PhaseChoice,
    pub(crate) followed_service: Option<String>,
    /// The services that it publishes.
    pub(crate) sends: Vec<String>,
    pub(crate) orders: orders::Sender,
    pub(crate) traces: Vec<Traced>,
    pub(crate) faults: Faults,
    /// To the log.
    pub(crate) words: Sender<Arc<Words>>,
    /// Its last cycle that was seen.
    pub(crate) last: Option<CycleRecord>,
    /// Why its CPU was chosen, if the configuration leaves it open.
    pub(crate) cpu_reason: Option<String>,
    pub(crate) responses: Responses,
    /// What the machine granted its thread; `None` while that is set up.
    pub(crate) grant: Option<ThreadGrant>,
}

/// The [`Operating`] of a node. It is locked for short work only, and never by a cycle.
#[derive(Clone)]
pub(crate) struct Shared(Arc<Mutex<Operating>>);

impl Shared {
    pub(crate) fn new(operator: Operator, plan: &Plan) -> Self {
        let Plan { source, rules, .. } = plan;
        let (source, sha256, rules) = (source.clone(), source.sha256(), rules.clone());
        Self(Arc::new(Mutex::new(Operating {
            operator,
            configuration: Configuration { source, sha256, rules, is_changed: false },
            lanes: Vec::new(),
            journal: None,
            recording: None,
            held: VecDeque::new(),
            journal_failures: 0,
            unwritten_since: None,
            lost: None,
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
        self.has_ended && self.held.is_empty()
    }

    /// The first cycle of each task that has not begun.
    pub(crate) fn next_cycles(&self, now_ns: u64) -> Vec<u64> {
        let next = |lane: &Lane| {
            let since = now_ns.checked_sub(lane.first_ns(self.epoch_ns));
            since.map_or(0, |since| since / lane.schedule.period_ns + 1)
        };
        self.lanes.iter().map(next).collect()
    }

    /// The first cycle of each task that is due at an instant or later.
    pub(crate) fn first_cycles(&self, instant_ns: u64) -> Vec<u64> {
        let first = |lane: &Lane| {
            let since_ns = instant_ns.saturating_sub(lane.first_ns(self.epoch_ns));
            since_ns.div_ceil(lane.schedule.period_ns)
        };
        self.lanes.iter().map(first).collect()
    }

    /// When a task's cycle is due, in ns of `CLOCK_MONOTONIC`.
    pub(crate) fn release_ns(&self, task: usize, cycle: u64) -> u64 {
        self.lanes.get(task).map_or(0, |lane| {
            let offset_ns = cycle.saturating_mul(lane.schedule.period_ns);
            lane.first_ns(self.epoch_ns).saturating_add(offset_ns)
        })
    }

    /// How long a task has not run where it should have, in ns: more than a second and three periods after the
    /// release that follows its last cycle. `None`: it runs.
    pub(crate) fn stands_ns(&self, task: usize, now_ns: u64) -> Option<u64> {
        let lane = self.lanes.get(task)?;
        let next = lane.last.map_or(0, |last| last.cycle.saturating_add(1));
        let stands_ns = now_ns.checked_sub(self.release_ns(task, next))?;
        let patience_ns = lane.schedule.period_ns.saturating_mul(3).saturating_add(PATIENCE_NS);
        Some(stands_ns).filter(|stands_ns| *stands_ns > patience_ns)
    }

    /// When a task needs which CPU; `None` before its start.
    pub(crate) fn placement(&self, task: usize) -> Option<Placement> {
        let lane = self.lanes.get(task)?;
        let grant = lane.grant.as_ref()?;
        Some(Placement {
            cpu: grant.cpu.and_then(|cpu| u32::try_from(cpu).ok()),
            scheduler: grant.scheduler.clone(),
            wake: lane.schedule.wake.as_str().to_owned(),
            first_release_ns: lane.first_ns(self.epoch_ns),
            longest_watch_ns: lane.schedule.longest_watch_ns(),
            response_ns: lane.responses.median_ns(),
            phase_reason: lane.phase_choice.reason().map(str::to_owned),
            cpu_reason: lane.cpu_reason.clone(),
            follow: Followed::of(&lane.schedule, lane.followed_service.as_deref()),
            sends: lane.sends.clone(),
        })
    }

    /// Sends a request to its tasks.
    pub(crate) fn send(
        &mut self,
        origin: Origin,
        prepared: Prepared,
    ) -> Result<Sent, RequestError> {
        if self.has_ended {
            return Err(RequestError::Ended);
        }
        let lanes = prepared.tasks().filter_map(|task| self.lanes.get(task));
        let is_reading = prepared.is_reading();
        let has_room = |lane: &Lane| match is_reading {
            true => lane.orders.has_room_to_read(),
            false => lane.orders.has_room(),
        };
        if let Some(full) = lanes.into_iter().find(|lane| !has_room(lane)) {
            return Err(RequestError::Busy { task: full.name.clone() });
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
            if let (Done::Applied(entry), Some(recording)) = (&done, &mut self.recording)
                && let Some(lane) = self.lanes.get(entry.task)
            {
                recording.note(entry, &lane.name);
            }
            let mark = match (&done, &mut self.journal) {
                (Done::Applied(entry), Some(journal)) => {
                    let lane = self.lanes.get(entry.task);
                    lane.and_then(|lane| journal.note(entry, &lane.name))
                }
                _ => None,
            };
            match mark {
                Some(mark) => self.held.push_back((mark, done)),
                None => self.hand_out(Told { done, unwritten: None }),
            }
        }
        self.heed_journal();
    }

    /// Writes what is done from now on into a journal that has begun.
    pub(crate) fn keep(&mut self, journal: Journal) -> Result<(), JournalError> {
        self.operator.continue_after(journal.last_transaction());
        self.journal = Some(Writing::start(journal, self.lanes.len())?);
        Ok(())
    }

    /// Takes note of a cycle of a task.
    pub(crate) fn note_cycle(&mut self, task: usize, record: &CycleRecord) {
        let Some(lane) = self.lanes.get_mut(task) else { return };
        lane.last = Some(*record);
        lane.responses.note(record);
        if let Some(journal) = &mut self.journal {
            journal.note_cycle(task, &lane.name, record);
        }
    }

    /// Acknowledges what the journal has, and what it cannot have now; while it cannot be written, changes are
    /// refused.
    fn heed_journal(&mut self) {
        let Some(journal) = &mut self.journal else { return };
        let standing = journal.standing();
        let last = self.lanes.first().and_then(|lane| lane.last);
        let cycle = last.map_or(0, |last| last.cycle);
        if self.lost.is_none() {
            self.lost = standing.lost.clone().map(|lost| (lost, cycle));
        }
        match (&standing.unwritten, self.unwritten_since) {
            (Some(_), None) => {
                self.unwritten_since = Some(cycle);
                self.journal_failures += 1;
            }
            (None, Some(_)) => self.unwritten_since = None,
            _ => {}
        }
        while let Some((mark, _)) = self.held.front() {
            let unwritten = match standing.fate(*mark) {
                Fate::Waits => break,
                Fate::Written => None,
                Fate::Unwritten(why) => Some(why),
            };
            let Some((_, done)) = self.held.pop_front() else { break };
            self.hand_out(Told { done, unwritten });
        }
        self.operator.set_unwritten(standing.unwritten);
    }

    /// That the journal cannot be written, while it cannot.
    pub(crate) fn journal_alarm(&self) -> Option<Active> {
        let (meaning, since_cycle, count) = match (self.operator.unwritten(), &self.lost) {
            (Some(why), _) => {
                let until = match why {
                    Unwritten::ForNow(_) => "it can be",
                    Unwritten::ForGood(_) => "the node is started again",
                };
                let meaning = format!("{}; changes are refused until {until}", why.reason());
                (meaning, self.unwritten_since?, self.journal_failures)
            }
            // It is told until the node ends.
            (None, Some((lost, since))) => (lost.to_string(), *since, 1),
            (None, None) => return None,
        };
        let name = "journal".to_owned();
        Some(Active { name, code: None, status: None, meaning, since_cycle, count })
    }

    /// Has the journal end, when the last cycles are noted.
    pub(crate) fn begin_journal_end(&mut self) {
        if let Some(journal) = self.journal.as_mut().filter(|_| self.has_ended) {
            journal.begin_end(unix_ns());
        }
    }

    /// The journal, whose end is to be waited for without a lock.
    pub(crate) fn take_journal(&mut self) -> Option<Writing> {
        self.journal.take()
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

impl Lane {
    /// When its first cycle is due.
    fn first_ns(&self, epoch_ns: u64) -> u64 {
        epoch_ns.saturating_add(self.schedule.phase_ns)
    }
}

/// Now, in ns of UTC since 1970.
pub(crate) fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
