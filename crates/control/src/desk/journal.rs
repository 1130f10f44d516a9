//! The journal of a running node: changes by operators, in order.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use isochrone_blocks::PinType;
use isochrone_engine::orders::EndedForce;
use isochrone_model::{Action, AppliedChange, AskedBy, ChangeSummary};

/// The most entries that are kept.
const MAX_ENTRIES: usize = 10_000;
/// The most values that all kept entries hold together.
const MAX_VALUES: usize = 1_000_000;

/// A configuration that replaced another one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Applied {
    /// Its text.
    pub(super) text: Arc<str>,
    /// SHA-256 of that, hexadecimal.
    pub(super) sha256: String,
    /// Where its author keeps it, according to the request.
    pub(super) file: Option<String>,
    /// What it changed.
    pub(super) summary: ChangeSummary,
}

impl Applied {
    /// How much of the configuration is new.
    pub(super) fn extent(&self) -> AppliedChange {
        let summary = &self.summary;
        AppliedChange {
            file: self.file.clone(),
            sha256: self.sha256.clone(),
            added: summary.added.len() as u64,
            removed: summary.removed.len() as u64,
            changed: summary.changed.len() as u64,
            limits: summary.limits.clone(),
        }
    }
}

/// An entry as it is kept.
#[derive(Debug)]
pub(super) struct Record {
    pub(super) sequence: u64,
    pub(super) transaction: u64,
    pub(super) task: usize,
    pub(super) cycle: u64,
    pub(super) unix_ns: u64,
    pub(super) action: Action,
    /// For a force: the first cycle without it, unless it lasts until it is released.
    pub(super) until: Option<u64>,
    /// For an undo: the transaction that it took back.
    pub(super) undone: Option<u64>,
    /// How many entries of its transaction change parameters, this one among them.
    pub(super) parts: usize,
    pub(super) changes: Box<[Changed]>,
    pub(super) by: AskedBy,
    pub(super) configuration: Option<Arc<Applied>>,
}

impl Record {
    /// What the program did to a task, in a part of its own.
    pub(super) fn new(
        transaction: u64,
        (task, cycle): (usize, u64),
        unix_ns: u64,
        action: Action,
        changes: Box<[Changed]>,
    ) -> Self {
        Self {
            sequence: 0,
            transaction,
            task,
            cycle,
            unix_ns,
            action,
            until: None,
            undone: None,
            parts: 1,
            changes,
            by: AskedBy::default(),
            configuration: None,
        }
    }

    /// How many values it counts as.
    fn values(&self) -> usize {
        let text = self.configuration.as_ref().map_or(0, |applied| applied.text.len());
        self.changes.len() + text / size_of::<Changed>()
    }
}

/// Where the signal of a change is.
#[derive(Debug, Clone)]
pub(super) enum SignalPlace {
    Slot(u32),
    /// The configuration that had it is gone; its name and type remain.
    Gone(Box<(String, PinType)>),
}

/// A change as it is kept.
#[derive(Debug, Clone)]
pub(super) struct Changed {
    pub(super) place: SignalPlace,
    pub(super) before: f64,
    pub(super) after: Option<f64>,
    /// The version of the value that was replaced, and of the new one.
    pub(super) versions: (u64, u64),
}

impl Changed {
    /// A change of the signal in this slot.
    pub(super) fn of(slot: u32, before: f64, after: Option<f64>) -> Self {
        Self { place: SignalPlace::Slot(slot), before, after, versions: (0, 0) }
    }

    /// What the end of a force has changed.
    pub(super) fn by_release(force: &EndedForce) -> Self {
        Self::of(force.slot(), force.value(), force.after())
    }
}

/// The newest entries.
#[derive(Debug, Default)]
pub(super) struct Journal {
    records: VecDeque<Record>,
    values: usize,
    sequence: u64,
}

impl Journal {
    /// Adds an entry, and gives it its number.
    pub(super) fn add(&mut self, record: Record) -> u64 {
        self.sequence += 1;
        self.values += record.values();
        self.records.push_back(Record { sequence: self.sequence, ..record });
        while self.records.len() > 1
            && (self.records.len() > MAX_ENTRIES || self.values > MAX_VALUES)
        {
            self.values -= self.records.pop_front().map_or(0, |oldest| oldest.values());
        }
        self.sequence
    }

    /// The number of the last entry.
    pub(super) fn last_sequence(&self) -> u64 {
        self.sequence
    }

    /// Numbers the next entries after this one, if they are not further already.
    pub(super) fn go_on_after(&mut self, sequence: u64) {
        self.sequence = self.sequence.max(sequence);
    }

    /// The entries from a number on.
    pub(super) fn since(&self, sequence: u64) -> impl ExactSizeIterator<Item = &Record> {
        let first = self.records.partition_point(|record| record.sequence < sequence);
        self.records.range(first..)
    }

    /// Follows the signals of a task to their places in another configuration.
    pub(super) fn follow(&mut self, task: usize, place: impl Fn(u32) -> SignalPlace) {
        let records = self.records.iter_mut().filter(|record| record.task == task);
        for changed in records.flat_map(|record| &mut record.changes) {
            if let SignalPlace::Slot(slot) = changed.place {
                changed.place = place(slot);
            }
        }
    }

    /// The entries of a transaction that changed parameters.
    pub(super) fn changes_of(&self, transaction: u64) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |record| {
            record.transaction == transaction && matches!(record.action, Action::Set | Action::Undo)
        })
    }

    /// What a transaction did that is known.
    pub(super) fn action_of(&self, transaction: u64) -> Option<Action> {
        let record = self.records.iter().find(|record| record.transaction == transaction);
        record.map(|record| record.action)
    }

    /// The transaction that undid another one, unless it was undone itself.
    pub(super) fn taken_back_by(&self, transaction: u64) -> Option<u64> {
        let mut undone = BTreeMap::new();
        // An undo comes after the transaction that it takes back.
        for record in self.records.iter().rev() {
            if let Some(of) = record.undone
                && !undone.contains_key(&record.transaction)
            {
                undone.entry(of).or_insert(record.transaction);
            }
        }
        undone.get(&transaction).copied()
    }
}
