//! What operators did, in the order in which it happened.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use isochrone_blocks::PinType;

use super::{ChangeSummary, Value};

/// Most entries that are kept.
const MAX_ENTRIES: usize = 10_000;
/// Most values that the entries that are kept hold together.
const MAX_VALUES: usize = 1_000_000;

/// Who asks for something.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Client {
    /// The program that runs the node.
    #[default]
    Program,
    /// Somebody else.
    Other {
        /// As they call themselves, if they do.
        name: Option<Arc<str>>,
        /// Their process, where iceoryx2 tells it.
        process: Option<u32>,
    },
}

impl Client {
    /// As they call themselves, if they do.
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Program => None,
            Self::Other { name, .. } => name.as_deref(),
        }
    }

    /// Their process, where that is known and another than the node's.
    pub fn process(&self) -> Option<u32> {
        match self {
            Self::Program => None,
            Self::Other { process, .. } => *process,
        }
    }
}

/// What was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Parameters were set.
    Set,
    /// Signals were forced.
    Force {
        /// First cycle without the force; `None`: until it is released.
        until: Option<u64>,
    },
    /// Forces were released.
    Release,
    /// A force came to its end.
    Expiry,
    /// A transaction was taken back.
    Undo {
        /// The transaction.
        of: u64,
    },
    /// The configuration was changed. Its changes are the parameters that have a new constant.
    Apply,
}

impl Action {
    /// Its word in a journal: `set`, `force`, `release`, `expiry`, `undo`, `apply`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Set => "set",
            Self::Force { .. } => "force",
            Self::Release => "release",
            Self::Expiry => "expiry",
            Self::Undo { .. } => "undo",
            Self::Apply => "apply",
        }
    }
}

/// What was done to one task before one of its cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Counts the entries of a node, from 1.
    pub sequence: u64,
    /// The transaction that it belongs to; that of the force, for an expiry.
    pub transaction: u64,
    /// Index of the task.
    pub task: usize,
    /// The first cycle with it.
    pub cycle: u64,
    /// When that was known, in ns of UTC since 1970.
    pub unix_ns: u64,
    /// What was done.
    pub action: Action,
    /// The values that it changed.
    pub changes: Vec<Change>,
    /// Who asked for it.
    pub client: Client,
    /// What they said of it.
    pub comment: Option<Arc<str>>,
    /// Of a change of the configuration, what it was changed to.
    pub configuration: Option<Arc<Applied>>,
}

/// A configuration that was put in the place of another.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Applied {
    /// Its text.
    pub text: Arc<str>,
    /// SHA-256 of that, hexadecimal.
    pub sha256: String,
    /// Where its author has it, as they say.
    pub file: Option<Arc<str>>,
    /// What it changed.
    pub summary: ChangeSummary,
}

/// A value that was changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Name of the signal.
    pub name: String,
    /// What it was.
    pub before: Value,
    /// What it is; `None` where a wire or a block says so.
    pub after: Option<Value>,
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
    /// How many entries of its transaction change parameters, this one among them.
    pub(super) parts: usize,
    pub(super) changes: Box<[Changed]>,
    pub(super) client: Client,
    pub(super) comment: Option<Arc<str>>,
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
        let (sequence, parts, client) = (0, 1, Client::Program);
        let (comment, configuration) = (None, None);
        Self {
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
        }
    }

    /// How many values it takes the place of.
    fn values(&self) -> usize {
        let text = self.configuration.as_ref().map_or(0, |applied| applied.text.len());
        self.changes.len() + text / size_of::<Changed>()
    }
}

/// Where the signal of a change stands.
#[derive(Debug, Clone)]
pub(super) enum Place {
    Slot(u32),
    /// The configuration that had it is gone: its name and type.
    Gone(Box<(String, PinType)>),
}

/// A change as it is kept.
#[derive(Debug, Clone)]
pub(super) struct Changed {
    pub(super) place: Place,
    pub(super) before: f64,
    pub(super) after: Option<f64>,
    /// The version of the value that this one replaced, and its own.
    pub(super) versions: (u64, u64),
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

    /// The entries from a number on.
    pub(super) fn since(&self, sequence: u64) -> impl ExactSizeIterator<Item = &Record> {
        let first = self.records.partition_point(|record| record.sequence < sequence);
        self.records.range(first..)
    }

    /// Follows the signals of a task to their places in another configuration.
    pub(super) fn follow(&mut self, task: usize, place: impl Fn(u32) -> Place) {
        let records = self.records.iter_mut().filter(|record| record.task == task);
        for changed in records.flat_map(|record| &mut record.changes) {
            if let Place::Slot(slot) = changed.place {
                changed.place = place(slot);
            }
        }
    }

    /// The entries of a transaction that changed parameters.
    pub(super) fn changes_of(&self, transaction: u64) -> impl Iterator<Item = &Record> {
        self.records.iter().filter(move |record| {
            record.transaction == transaction
                && matches!(record.action, Action::Set | Action::Undo { .. })
        })
    }

    /// What a transaction did that is known.
    pub(super) fn action_of(&self, transaction: u64) -> Option<Action> {
        let record = self.records.iter().find(|record| record.transaction == transaction);
        record.map(|record| record.action)
    }

    /// The transaction that has taken another one back, and was not taken back itself.
    pub(super) fn taken_back_by(&self, transaction: u64) -> Option<u64> {
        let mut undone = BTreeMap::new();
        // An undo is younger than what it takes back.
        for record in self.records.iter().rev() {
            if let Action::Undo { of } = record.action
                && !undone.contains_key(&record.transaction)
            {
                undone.entry(of).or_insert(record.transaction);
            }
        }
        undone.get(&transaction).copied()
    }
}
