//! The desk at which requests are checked, and orders made: for an ordinary thread, without a clock.

mod change;
mod check;
mod pending;
mod requests;
mod undo;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use super::Value;
use super::fixed::Fixed;
use super::forces::{AtEnd, Ended};
use super::journal::{Action, Change, Changed, Client, Entry, Journal, Place, Record};
use super::order::{Asked, Order, OrderState, Work};
use super::permissions::Permissions;
use super::signals::{Signal, Signals};
use super::store::Store;
use super::warnings::{Warning, Warnings};
use crate::plan::Plan;

use change::Next;
pub(in crate::operate) use change::carry;
pub use change::{ChangeSummary, Draft, PreparedChange};
pub use pending::Pending;

/// Who gives the inputs their values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feeds {
    /// Those that name a service are read from it, the others are given by the program.
    Services,
    /// All are given by the program.
    Program,
}

/// What a request says beside its values.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The cycle before which it is to happen; `None`: the next.
    pub at: Option<u64>,
    /// Who asks.
    pub client: Client,
    /// What is to be remembered of it.
    pub comment: Option<Arc<str>>,
}

/// How long a force lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hold {
    /// So many seconds, counted in cycles from the first with it.
    Seconds(f64),
    /// Until it is released, or the node ends.
    UntilReleased,
}

/// A request that was found right, and for which there is an order for each of its tasks.
#[derive(Debug)]
pub struct Prepared {
    orders: Vec<(usize, Box<Order>)>,
    request: Request,
    kind: Kind,
    /// What the values will make blocks do.
    pub warnings: Vec<Warning>,
    /// Of a reading: the task of each value, in the order of the request.
    pub read_from: Vec<usize>,
}

impl Prepared {
    /// The tasks that it is for. Make sure that there is room for an order on the way to each before
    /// [`Operator::send`].
    pub fn tasks(&self) -> impl Iterator<Item = usize> {
        self.orders.iter().map(|(task, _)| *task)
    }
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Set,
    Force,
    Release,
    Undo { of: u64 },
    Read,
    Change,
}

/// A transaction whose orders have not all come back.
#[derive(Debug)]
struct Sent {
    kind: Kind,
    client: Client,
    comment: Option<Arc<str>>,
    /// The cycle that it waits for, where it names one.
    at: Option<u64>,
    tasks: usize,
    /// For how many tasks it writes parameters.
    parts: usize,
    /// The parameters that it writes: task and slot.
    writes: HashSet<(usize, u32)>,
}

/// What is known of an order that has come back by the transaction that it is of.
struct Settled {
    kind: Kind,
    parts: usize,
    client: Client,
    comment: Option<Arc<str>>,
}

/// A force that is in place, or on its way.
#[derive(Debug, Clone, PartialEq)]
pub struct Forced {
    /// Name of the signal.
    pub name: String,
    /// The forced value.
    pub value: Value,
    /// Index of its task.
    pub task: usize,
    /// First cycle with it; `None`: it is on its way.
    pub since: Option<u64>,
    /// First cycle without it; `None`: until it is released, or it is on its way.
    pub until: Option<u64>,
    /// Who asked for it.
    pub client: Client,
    /// The transaction that made it.
    pub transaction: u64,
}

/// What has come of an order.
#[derive(Debug, Clone, PartialEq)]
pub enum Done {
    /// It was applied. Values that the program gave to inputs are in no journal, and not among the
    /// changes.
    Applied(Entry),
    /// Its cycle had begun before it came; nothing happened.
    TooLate {
        /// Its transaction.
        transaction: u64,
    },
    /// Values were read.
    Read(Reading),
}

/// Values of one task, all of one cycle, after its blocks have stepped.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Number of the request.
    pub number: u64,
    /// Index of the task.
    pub task: usize,
    /// The cycle.
    pub cycle: u64,
    /// Names and values.
    pub values: Vec<(String, Value)>,
}

/// A parameter that was set.
#[derive(Debug, Clone, Copy)]
struct Held {
    value: f64,
    /// The transaction that it is from.
    version: u64,
}

/// Checks what operators ask for, makes orders of it, and remembers what has come of them.
///
/// Every request is checked whole: either nothing is wrong with it, or all that is wrong is returned
/// and nothing happens.
#[derive(Debug)]
pub struct Operator {
    signals: Arc<Signals>,
    permissions: Permissions,
    warnings: Warnings,
    fixed: Fixed,
    /// The configuration that is on its way to the tasks.
    next_plan: Option<Box<Next>>,
    /// For each task how many changes of the configuration it has behind it.
    changes: Vec<u64>,
    feeds: Feeds,
    /// For each task its forces by slot: one in place, and those that are on their way.
    forces: Vec<BTreeMap<u32, Vec<Forced>>>,
    /// For each task how many of its forces are on their way to take the place of another: what ends
    /// by itself until they have come back has room in the ring that it comes back by.
    forced_again: Vec<usize>,
    values: HashMap<(usize, u32), Held>,
    sent: BTreeMap<u64, Sent>,
    /// Requests that write which were sent.
    writes: u64,
    journal: Journal,
    next: u64,
    /// Readings count down from the top, so that transactions are numbered without gaps.
    next_reading: u64,
}

impl Operator {
    /// The desk of a node that is about to start.
    pub fn new(plan: &Plan, feeds: Feeds) -> Self {
        Self {
            signals: Arc::new(Signals::of(plan)),
            permissions: Permissions::of(plan),
            warnings: Warnings::of(plan),
            fixed: Fixed::of(plan),
            next_plan: None,
            changes: vec![0; plan.tasks.len()],
            feeds,
            forces: vec![BTreeMap::new(); plan.tasks.len()],
            forced_again: vec![0; plan.tasks.len()],
            values: HashMap::new(),
            sent: BTreeMap::new(),
            writes: 0,
            journal: Journal::default(),
            next: 1,
            next_reading: u64::MAX,
        }
    }

    /// Goes on counting transactions after `last`, the last that the node's journal knows.
    pub fn continue_after(&mut self, last: u64) {
        self.next = self.next.max(last.saturating_add(1));
    }

    /// Refuses all changes while a journal cannot be written, for this reason: part of a sentence,
    /// such as "the journal log.jsonl cannot be written (disk full)". `None`: it can be written.
    pub fn set_unwritten(&mut self, reason: Option<Arc<str>>) {
        self.permissions.unwritten = reason;
    }

    /// The node's names.
    pub fn signals(&self) -> &Arc<Signals> {
        &self.signals
    }

    /// Gives a request its number, and its orders to the one who hands them to the tasks: there must
    /// be room for all of them.
    pub fn send(&mut self, prepared: Prepared) -> (u64, Vec<(usize, Box<Order>)>) {
        let Prepared { mut orders, request, kind, .. } = prepared;
        let number = match kind {
            Kind::Read => {
                self.next_reading -= 1;
                self.next_reading
            }
            _ => {
                self.next += 1;
                self.next - 1
            }
        };
        let mut writes = HashSet::new();
        for (task, order) in &mut orders {
            order.number = number;
            order.changes = self.changes.get(*task).copied().unwrap_or_default();
            match &mut order.work {
                Work::Set { stores, .. } => {
                    writes.extend(stores.iter().map(|store| (*task, store.slot)));
                }
                Work::Force { stores, forces, again, .. } => {
                    forces.iter_mut().for_each(|force| force.number = number);
                    for store in stores.iter() {
                        let is_again = self.note_force(*task, store, number, &request.client);
                        *again += usize::from(is_again);
                    }
                    if let Some(pending) = self.forced_again.get_mut(*task) {
                        *pending += *again;
                    }
                }
                Work::Release { .. } | Work::Read(_) => {}
            }
        }
        let is_write = match kind {
            Kind::Set => !writes.is_empty(),
            Kind::Force | Kind::Release | Kind::Undo { .. } | Kind::Change => true,
            Kind::Read => false,
        };
        self.writes += u64::from(is_write);
        let parts = writes.iter().map(|(task, _)| task).collect::<HashSet<_>>().len();
        let Request { client, comment, at } = request;
        let sent = Sent { kind, client, comment, at, tasks: orders.len(), parts, writes };
        if sent.tasks > 0 {
            self.sent.insert(number, sent);
        }
        (number, orders)
    }

    /// Notes a force that is on its way; whether it takes the place of another.
    fn note_force(&mut self, task: usize, store: &Store, number: u64, client: &Client) -> bool {
        let Some(signal) = self.signal_at(task, store.slot) else { return false };
        let forced = Forced {
            value: Value::of(store.value, signal.value_type),
            name: signal.name,
            task,
            since: None,
            until: None,
            client: client.clone(),
            transaction: number,
        };
        let Some(forces) = self.forces.get_mut(task) else { return false };
        let of_slot = forces.entry(store.slot).or_default();
        of_slot.push(forced);
        of_slot.len() > 1
    }

    /// Takes an order back. `unix_ns` is now, in ns of UTC since 1970.
    pub fn done(&mut self, task: usize, order: Box<Order>, unix_ns: u64) -> Done {
        let number = order.number;
        let Settled { kind, parts, client, comment } = self.settle(task, &order);
        let OrderState::Applied { cycle } = order.state else {
            if let Work::Force { stores, .. } = &order.work {
                self.forget(task, stores.iter().map(|store| store.slot), number);
            }
            return Done::TooLate { transaction: number };
        };
        let (action, changes) = match order.work {
            Work::Read(values) => {
                let is_moved = self.changes.get(task).is_some_and(|now| *now != order.changes);
                return Done::Read(self.reading(number, task, cycle, &values, is_moved));
            }
            Work::Set { stores, .. } => {
                let action = match kind {
                    Kind::Undo { of } => Action::Undo { of },
                    _ => Action::Set,
                };
                (action, self.written(task, number, action, &stores))
            }
            Work::Force { stores, cycles, .. } => {
                let until = cycles.map(|cycles| cycle.saturating_add(cycles));
                for store in &stores {
                    let forces = self.forces.get_mut(task).and_then(|of| of.get_mut(&store.slot));
                    let Some(forces) = forces else { continue };
                    // It has taken the place of the one before.
                    forces.retain(|forced| forced.since.is_none());
                    for forced in forces.iter_mut().filter(|of| of.transaction == number) {
                        (forced.since, forced.until) = (Some(cycle), until);
                    }
                }
                let changed = |store: &Store| changed(store.slot, store.before, Some(store.value));
                (Action::Force { until }, stores.iter().map(changed).collect())
            }
            Work::Release { ended, .. } => {
                for Ended(force) in &ended {
                    self.forget(task, [force.slot], force.number);
                }
                (Action::Release, ended.iter().map(released).collect())
            }
        };
        let (sequence, configuration) = (0, None);
        let record = Record {
            sequence,
            transaction: number,
            task,
            cycle,
            unix_ns,
            action,
            parts,
            changes,
            client,
            comment,
            configuration,
        };
        // What the program gives to inputs is no operator's doing.
        if record.changes.is_empty() {
            return Done::Applied(self.entry(&record));
        }
        Done::Applied(self.add(record))
    }

    /// Takes note of a force that came to its end before `cycle`.
    pub fn expired(&mut self, task: usize, ended: Ended, cycle: u64, unix_ns: u64) -> Entry {
        let Ended(force) = &ended;
        let transaction = force.number;
        let forced = self.forget(task, [force.slot], force.number);
        let client = forced.map_or(Client::Program, |forced| forced.client);
        let changes = [released(&ended)].into();
        let (sequence, action, comment, configuration) = (0, Action::Expiry, None, None);
        let parts = 1;
        let record = Record {
            sequence,
            transaction,
            task,
            cycle,
            unix_ns,
            action,
            parts,
            changes,
            client,
            comment,
            configuration,
        };
        self.add(record)
    }

    /// The forces that are in place, and those that are on their way where none is.
    pub fn forces(&self) -> impl Iterator<Item = &Forced> {
        // The one in place, if there is one, is the first that was applied.
        self.forces.iter().flat_map(BTreeMap::values).filter_map(|forces| {
            forces.iter().find(|forced| forced.since.is_some()).or(forces.first())
        })
    }

    /// Whether a signal is forced, or about to be.
    pub fn is_forced(&self, signal: &Signal<'_>) -> bool {
        let forces = self.forces.get(signal.task);
        forces.is_some_and(|forces| forces.contains_key(&(signal.slot as u32)))
    }

    /// Whether a parameter has another value than the configuration gave it.
    pub fn has_changed(&self) -> bool {
        self.changes().next().is_some()
    }

    /// The parameters that differ from their constants, in the order of the images.
    pub(super) fn changed(&self) -> Vec<(Signal<'_>, Value)> {
        let mut changes: Vec<_> = self.changes().collect();
        changes.sort_unstable_by_key(|(signal, _)| (signal.task, signal.slot));
        changes
    }

    fn changes(&self) -> impl Iterator<Item = (Signal<'_>, Value)> {
        self.values.iter().filter_map(|(&(task, slot), held)| {
            let slot = slot as usize;
            let signals = self.signals_of(task);
            let instance = signals.instance_of(task, slot)?;
            let constant = instance.constants.get(slot - instance.first_slot)?;
            if constant.to_bits() == held.value.to_bits() {
                return None;
            }
            let signal = signals.at(task, slot)?;
            let value = Value::of(held.value, signal.value_type);
            Some((signal, value))
        })
    }

    /// The entries of the journal from a sequence number on: the last 10,000, or fewer if they have
    /// changed more than a million values.
    pub fn journal(&self, since: u64) -> impl ExactSizeIterator<Item = Entry> {
        self.journal.since(since).map(|record| self.entry(record))
    }

    /// The index of a task's names: those of its engine, which may be of another configuration than
    /// that of the task beside it while a change is on its way.
    fn signals_of(&self, task: usize) -> &Signals {
        let next = self.next_plan.as_ref().filter(|next| next.has_returned(task));
        next.map_or(&self.signals, |next| &next.signals)
    }

    fn signal_at(&self, task: usize, slot: u32) -> Option<Signal<'_>> {
        self.signals_of(task).at(task, slot as usize)
    }

    /// Adds an entry to the journal.
    fn add(&mut self, record: Record) -> Entry {
        let entry = self.entry(&record);
        Entry { sequence: self.journal.add(record), ..entry }
    }

    fn entry(&self, record: &Record) -> Entry {
        let change = |changed: &Changed| {
            let (name, value_type) = match &changed.place {
                Place::Slot(slot) => {
                    let signal = self.signal_at(record.task, *slot)?;
                    (signal.name, signal.value_type)
                }
                Place::Gone(signal) => (**signal).clone(),
            };
            let value = |slot| Value::of(slot, value_type);
            let (before, after) = (value(changed.before), changed.after.map(value));
            Some(Change { name, before, after })
        };
        Entry {
            sequence: record.sequence,
            transaction: record.transaction,
            task: record.task,
            cycle: record.cycle,
            unix_ns: record.unix_ns,
            action: record.action,
            changes: record.changes.iter().filter_map(change).collect(),
            client: record.client.clone(),
            comment: record.comment.clone(),
            configuration: record.configuration.clone(),
        }
    }

    /// Notes that one of a transaction's orders has come back.
    fn settle(&mut self, task: usize, order: &Order) -> Settled {
        let Some(sent) = self.sent.get_mut(&order.number) else {
            return Settled { kind: Kind::Read, parts: 1, client: Client::Program, comment: None };
        };
        match &order.work {
            Work::Set { stores, .. } => {
                for store in stores {
                    sent.writes.remove(&(task, store.slot));
                }
            }
            Work::Force { again, .. } => {
                if let Some(pending) = self.forced_again.get_mut(task) {
                    *pending -= again;
                }
            }
            Work::Release { .. } | Work::Read(_) => {}
        }
        sent.tasks -= 1;
        let Sent { kind, parts, .. } = *sent;
        let (client, comment) = (sent.client.clone(), sent.comment.clone());
        let settled = Settled { kind, parts, client, comment };
        if sent.tasks == 0 {
            self.sent.remove(&order.number);
        }
        settled
    }

    /// Forgets forces of a transaction; returns the last.
    fn forget(
        &mut self,
        task: usize,
        slots: impl IntoIterator<Item = u32>,
        transaction: u64,
    ) -> Option<Forced> {
        let of_task = self.forces.get_mut(task)?;
        let mut last = None;
        for slot in slots {
            let Some(forces) = of_task.get_mut(&slot) else { continue };
            let found = forces.iter().position(|forced| forced.transaction == transaction);
            last = found.map(|found| forces.remove(found)).or(last);
            if forces.is_empty() {
                of_task.remove(&slot);
            }
        }
        last
    }

    /// Notes the values that were set, each with its version: the transaction that it is from. What is
    /// taken back has the version from before that transaction again.
    fn written(
        &mut self,
        task: usize,
        number: u64,
        action: Action,
        stores: &[Store],
    ) -> Box<[Changed]> {
        let restored: HashMap<u32, u64> = match action {
            Action::Undo { of } => {
                let records = self.journal.changes_of(of).filter(|record| record.task == task);
                let changes = records.flat_map(|record| &record.changes);
                let restored = |changed: &Changed| match changed.place {
                    Place::Slot(slot) => Some((slot, changed.versions.0)),
                    Place::Gone(_) => None,
                };
                changes.filter_map(restored).collect()
            }
            _ => HashMap::new(),
        };
        let mut write = |store: &Store| {
            let version = restored.get(&store.slot).copied().unwrap_or(number);
            let held = Held { value: store.value, version };
            let before = self.values.insert((task, store.slot), held);
            let versions = (before.map_or(0, |held| held.version), version);
            Changed { versions, ..changed(store.slot, store.before, Some(store.value)) }
        };
        stores.iter().map(&mut write).collect()
    }

    fn reading(
        &self,
        number: u64,
        task: usize,
        cycle: u64,
        values: &[Asked],
        is_moved: bool,
    ) -> Reading {
        let value = |asked: &Asked| {
            let slot = if is_moved { asked.moved } else { asked.slot };
            let signal = self.signal_at(task, slot)?;
            Some((signal.name, Value::of(asked.value, signal.value_type)))
        };
        Reading { number, task, cycle, values: values.iter().filter_map(value).collect() }
    }
}

pub(in crate::operate) fn changed(slot: u32, before: f64, after: Option<f64>) -> Changed {
    Changed { place: Place::Slot(slot), before, after, versions: (0, 0) }
}

pub(in crate::operate) fn released(Ended(force): &Ended) -> Changed {
    let after = (force.at_end == AtEnd::Restore).then_some(force.shadow);
    changed(force.slot, force.value, after)
}
