//! Checks requests and makes orders of them. Runs in an ordinary thread and reads no clock.

mod change;
mod check;
mod copied;
mod pending;
mod requests;
mod retained;
mod returned;
mod scheduled;
mod selection;
mod sending;
mod undo;
mod units;
mod written;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use isochrone_blocks::PinType;
use isochrone_engine::Plan;
use isochrone_engine::orders::Order;
use isochrone_model::{AskedBy, At, Change, Entry, Force, Value};

use super::announced::AnnouncedUnits;
use super::fixed::Fixed;
use super::journal::{Changed, Journal, Record, SignalPlace};
use super::permissions::{Permissions, Unwritten};
use super::quality::Behind;
use super::signals::{Signal, Signals};
use super::warnings::{ValueWarning, Warnings};
use change::Next;
pub(in crate::desk) use change::carry;
pub use change::{Basis, Draft, PreparedChange};
pub use copied::DeskCopy;
pub use retained::{RestoredValues, RetainedValue, Unexpected};
pub use returned::{OrderOutcome, Reading};
pub use selection::Selection;

/// Where the inputs get their values from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Feeds {
    /// Inputs that name a service are read from it; the program gives the others.
    Services,
    /// The program gives all of them.
    Program,
}

/// The terms of a request, besides its values.
#[derive(Debug, Clone, Default)]
pub struct RequestTerms {
    /// The cycle at whose start it is to be applied; `None`: the next.
    pub at: Option<At>,
    /// The client, and its comment.
    pub by: AskedBy,
    /// Whether it comes from another program than the one that runs the node, which may give inputs their values.
    pub is_remote: bool,
}

/// A checked request, with an order for each of its tasks.
#[derive(Debug)]
pub struct PreparedRequest {
    orders: Vec<(usize, Box<Order>)>,
    request: RequestTerms,
    kind: Kind,
    /// For a request that writes, the cycle of each task in which it is due.
    due: BTreeMap<usize, u64>,
    /// Warnings about the effect of its values on blocks.
    pub warnings: Vec<ValueWarning>,
    /// For a reading: the task of each value, in the order of the request.
    pub read_from: Vec<usize>,
    /// For a reading: for each task, what its values are computed from.
    behind: BTreeMap<usize, Behind>,
}

impl PreparedRequest {
    /// The tasks that it is for. Make sure that there is room for an order on the way to each before
    /// [`Operator::send`].
    pub fn tasks(&self) -> impl Iterator<Item = usize> {
        self.orders.iter().map(|(task, _)| *task)
    }

    /// The tasks of a request that writes, with the cycle in which it is due in each.
    pub fn cycles(&self) -> impl Iterator<Item = (usize, u64)> {
        self.due.iter().map(|(task, cycle)| (*task, *cycle))
    }

    /// Whether its orders read.
    pub fn is_reading(&self) -> bool {
        matches!(self.kind, Kind::Read)
    }

    /// Whether its orders release forces.
    pub fn is_release(&self) -> bool {
        matches!(self.kind, Kind::Release)
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
struct PendingRequest {
    kind: Kind,
    by: AskedBy,
    is_remote: bool,
    /// Whether it names the cycle that it is for.
    is_scheduled: bool,
    /// The tasks that have not applied it yet, and the cycle that each waits for.
    due: BTreeMap<usize, u64>,
    tasks: usize,
    /// For how many tasks it writes parameters.
    parts: usize,
    /// The parameters and variables that it writes, by task and slot, and their new values.
    writes: HashMap<(usize, u32), f64>,
    /// The forces that it releases: task and slot.
    releases: HashSet<(usize, u32)>,
    /// For each task, how many of its forces replace another.
    again: BTreeMap<usize, usize>,
    /// For each task, what the values that it reads are computed from.
    behind: BTreeMap<usize, Behind>,
}

impl PendingRequest {
    /// A request of which no order has come back, and which writes nothing.
    fn new(kind: Kind, terms: RequestTerms, tasks: usize) -> Self {
        let RequestTerms { at, by, is_remote } = terms;
        Self {
            kind,
            by,
            is_remote,
            is_scheduled: at.is_some(),
            due: BTreeMap::new(),
            tasks,
            parts: 0,
            writes: HashMap::new(),
            releases: HashSet::new(),
            again: BTreeMap::new(),
            behind: BTreeMap::new(),
        }
    }
}

/// The desk's record of a force, from the request until it ends. [`Force`] is what answers say of a force in place.
#[derive(Debug, Clone, PartialEq)]
struct ForceRecord {
    /// Name of the signal.
    name: String,
    /// The forced value.
    value: Value,
    /// First cycle with it; `None` while it is on its way.
    since: Option<u64>,
    /// First cycle without it; `None` while it is on its way, or if it lasts until it is released.
    until: Option<u64>,
    /// Who asked for it.
    by: AskedBy,
    /// The transaction that made it.
    transaction: u64,
}

/// The value of a parameter or a variable that was set.
#[derive(Debug, Clone, Copy)]
struct ParameterValue {
    value: f64,
    /// The transaction that set it.
    version: u64,
}

/// Checks what operators ask for, turns it into orders, and keeps their results.
///
/// A request is checked as a whole: if anything is wrong with it, everything that is wrong is returned and
/// nothing happens.
#[derive(Debug)]
pub struct Operator {
    signals: Arc<Signals>,
    announced: AnnouncedUnits,
    pub(super) permissions: Permissions,
    warnings: Warnings,
    fixed: Arc<Fixed>,
    /// The configuration that is on its way to the tasks.
    next_plan: Option<Box<Next>>,
    /// For each task, how many changes of the configuration it has made.
    changes: Vec<u64>,
    feeds: Feeds,
    /// For each task, its forces by slot: the one in place, and those on their way.
    forces: Vec<BTreeMap<u32, Vec<ForceRecord>>>,
    /// For each task how many of its forces are on their way to take the place of another: what ends
    /// by itself until they have come back has room in the ring that it comes back by.
    forced_again: Vec<usize>,
    values: HashMap<(usize, u32), ParameterValue>,
    sent: BTreeMap<u64, PendingRequest>,
    /// How many requests that write were sent.
    writes: u64,
    journal: Journal,
    /// The first transaction of this run of the node.
    first: u64,
    pub(super) next: u64,
    /// Readings are numbered downwards from the highest number, so that transactions have no gaps.
    next_reading: u64,
}

impl Operator {
    /// The desk of a node that is about to start.
    pub fn new(plan: &Plan, feeds: Feeds) -> Self {
        Self {
            signals: Arc::new(Signals::of(plan)),
            announced: AnnouncedUnits::default(),
            permissions: Permissions::of(plan),
            warnings: Warnings::of(plan),
            fixed: Arc::new(Fixed::of(plan)),
            next_plan: None,
            changes: vec![0; plan.tasks.len()],
            feeds,
            forces: vec![BTreeMap::new(); plan.tasks.len()],
            forced_again: vec![0; plan.tasks.len()],
            values: HashMap::new(),
            sent: BTreeMap::new(),
            writes: 0,
            journal: Journal::default(),
            first: 1,
            next: 1,
            next_reading: u64::MAX,
        }
    }

    /// Refuses all changes but releases while the journal cannot be written. `None`: it can.
    pub fn set_unwritten(&mut self, why: Option<Unwritten>) {
        self.permissions.unwritten = why;
    }

    /// Why changes are refused, while the journal cannot be written.
    pub fn unwritten(&self) -> Option<&Unwritten> {
        self.permissions.unwritten.as_ref()
    }

    /// Whether `[[protect]]` covers a signal.
    pub fn is_protected(&self, signal: &Signal<'_>) -> bool {
        self.permissions.check_name(signal).is_err()
    }

    /// The limits of a parameter or a variable, if the configuration gives it any: least and greatest value.
    pub fn limits(&self, signal: &Signal<'_>) -> Option<[f64; 2]> {
        self.permissions.limits(signal)
    }

    /// The type of a signal, of this configuration or of one on its way.
    fn value_type(&self, name: &str) -> Option<PinType> {
        let next = || self.next_plan.as_ref()?.signals.locate(name);
        self.signals.locate(name).or_else(next).map(|signal| signal.value_type)
    }

    /// The node's names.
    pub fn signals(&self) -> &Arc<Signals> {
        &self.signals
    }

    /// The forces that are in place.
    pub fn forces(&self) -> impl Iterator<Item = Force> {
        let in_place = |(task, (slot, forces)): (usize, (&u32, &Vec<ForceRecord>))| {
            let (forced, since_cycle) =
                forces.iter().find_map(|forced| Some((forced, forced.since?)))?;
            let signal = self.signal_at(task, *slot);
            Some(Force {
                name: forced.name.clone(),
                value: forced.value,
                value_type: signal.map(|signal| signal.value_type.to_string()),
                since_cycle,
                until_cycle: forced.until,
                client: forced.by.client.clone(),
            })
        };
        let tasks = self.forces.iter().enumerate();
        tasks.flat_map(|(task, of)| of.iter().map(move |one| (task, one))).filter_map(in_place)
    }

    /// How many signals of a task are forced, or about to be.
    pub fn forced(&self, task: usize) -> usize {
        self.forces.get(task).map_or(0, BTreeMap::len)
    }

    /// Whether one of [`signals`](Self::signals) is forced, or about to be.
    pub fn is_forced(&self, signal: &Signal<'_>) -> bool {
        let Signal { task, slot, .. } = *signal;
        let next = self.next_plan.as_ref().filter(|next| next.has_returned(task));
        let slot = next.map_or(Some(slot as u32), |next| next.slot(task, slot as u32));
        let forces = self.forces.get(task);
        forces.zip(slot).is_some_and(|(forces, slot)| forces.contains_key(&slot))
    }

    /// How many parameters a task has now.
    pub fn parameters(&self, task: usize) -> usize {
        self.signals_of(task).parameters(task)
    }

    /// Whether any parameter or variable has another value than the configuration gave it.
    pub fn has_changed(&self) -> bool {
        self.changes().next().is_some()
    }

    /// The parameters and variables that differ from the configuration, in the order of the images.
    pub(super) fn changed(&self) -> Vec<(Signal<'_>, Value)> {
        let mut changes: Vec<_> = self.changes().collect();
        changes.sort_unstable_by_key(|(signal, _)| (signal.task, signal.slot));
        changes
    }

    fn changes(&self) -> impl Iterator<Item = (Signal<'_>, Value)> {
        self.values.iter().filter_map(|(&(task, slot), held)| {
            let slot = slot as usize;
            let signals = self.signals_of(task);
            if signals.constant(task, slot)?.to_bits() == held.value.to_bits() {
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

    /// The index of a task's names: those of its engine. While a change is on its way, tasks may have different
    /// configurations.
    fn signals_of(&self, task: usize) -> &Signals {
        let next = self.next_plan.as_ref().filter(|next| next.has_returned(task));
        next.map_or(&self.signals, |next| &next.signals)
    }

    /// The configuration that is on its way to a task.
    fn next_of(&self, task: usize) -> Option<&Next> {
        self.next_plan.as_deref().filter(|next| !next.has_returned(task))
    }

    /// The permissions for the values of a task, including those of a configuration on its way to it.
    fn permissions_of(&self, task: usize) -> impl Iterator<Item = &Permissions> {
        let next = self.next_plan.as_deref();
        let has_next = next.is_some_and(|next| next.has_returned(task));
        let now = (!has_next).then_some(&self.permissions);
        now.into_iter().chain(next.map(Next::permissions))
    }

    fn signal_at(&self, task: usize, slot: u32) -> Option<Signal<'_>> {
        self.signals_of(task).at(task, slot as usize)
    }

    /// Adds an entry to the journal.
    pub(super) fn add(&mut self, record: Record) -> Entry {
        let entry = self.entry(&record);
        Entry { sequence: self.journal.add(record), ..entry }
    }

    fn entry(&self, record: &Record) -> Entry {
        let change = |changed: &Changed| {
            let (name, value_type) = match &changed.place {
                SignalPlace::Slot(slot) => {
                    let signal = self.signal_at(record.task, *slot)?;
                    (signal.name, signal.value_type)
                }
                SignalPlace::Gone(signal) => (**signal).clone(),
            };
            let value = |slot| Value::of(slot, value_type);
            let (before, after) = (value(changed.before), changed.after.map(value));
            Some(Change { name, before, after, value_type: Some(value_type.to_string()) })
        };
        Entry {
            sequence: record.sequence,
            transaction: record.transaction,
            action: record.action,
            task: self.signals.task_name(record.task).to_owned(),
            cycle: record.cycle,
            unix_ns: record.unix_ns,
            until_cycle: record.until,
            undone: record.undone,
            changes: record.changes.iter().filter_map(change).collect(),
            left_out: 0,
            by: record.by.clone(),
            configuration: record.configuration.as_ref().map(|applied| applied.text.clone()),
            applied: record.configuration.as_ref().map(|applied| applied.extent()),
        }
    }
}
