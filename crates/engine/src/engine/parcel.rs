//! Values on their way between tasks, and what they are of.

use crate::worth::Source;

/// Stands for the cycle of a task that has finished none.
pub(super) const NO_CYCLE: u64 = u64::MAX;

/// The cycle and configuration of a task's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stamp {
    /// The cycle that computed them; [`NO_CYCLE`]: none has yet.
    pub(super) cycle: u64,
    /// How many online changes that task had had.
    pub(super) changes: u64,
}

/// Values from one task to another.
#[derive(Clone)]
pub struct Parcel {
    pub(super) stamp: Stamp,
    pub(super) values: Box<[f64]>,
    pub(super) sources: Box<[Source]>,
}

impl Parcel {
    /// The cycle that computed them; `None`: none has yet.
    pub fn cycle(&self) -> Option<u64> {
        self.stamp.cycle()
    }

    /// How many online changes the task that computed them had had.
    pub fn changes(&self) -> u64 {
        self.stamp.changes
    }

    /// How many bytes it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.values.len() * (size_of::<f64>() + size_of::<Source>())
    }
}

impl Stamp {
    pub(super) fn cycle(self) -> Option<u64> {
        (self.cycle != NO_CYCLE).then_some(self.cycle)
    }
}
