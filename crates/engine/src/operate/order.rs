//! What an operator sends to a task's cycle: made and freed in an ordinary thread, filled in by the
//! cycle.

use isochrone_model::Role;

use super::forces::{AtEnd, Ended, Force};
use super::quality::Behind;
use super::signals::Signals;
use super::store::Store;

/// One box of work for one task. The cycle writes what it found into it, and gives it back.
#[derive(Debug)]
pub struct Order {
    pub(crate) number: u64,
    pub(crate) at: Option<u64>,
    pub(crate) work: Work,
    /// The same for the engine that is on its way to the task; the cycle that does it puts it in the
    /// place of the other.
    pub(crate) moved: Option<Work>,
    pub(crate) state: OrderState,
    /// How often the task's engine had been replaced when the order was made.
    pub(crate) changes: u64,
}

/// What has become of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderState {
    /// It has not been applied yet.
    Waiting,
    /// It was applied before the blocks of this cycle stepped; a reading was taken after they did.
    Applied {
        /// The cycle.
        cycle: u64,
    },
    /// The cycle that it was meant for had begun before it came. Nothing happened.
    TooLate,
}

/// What is to be done.
#[derive(Debug)]
pub(crate) enum Work {
    /// Give values to inputs and parameters.
    Set {
        /// Inputs and their values.
        feeds: Box<[(u32, f64)]>,
        /// Parameters, by slot.
        stores: Box<[Store]>,
    },
    /// Hold values.
    Force {
        /// By slot.
        stores: Box<[Store]>,
        /// One for each store.
        forces: Box<[Force]>,
        /// How many cycles; `None`: until released.
        cycles: Option<u64>,
        /// How many of them replace another; the cycle does not look at it.
        again: usize,
    },
    /// Let go of values.
    Release {
        /// In ascending order.
        slots: Box<[u32]>,
        /// What was let go of; has room for all.
        ended: Vec<Ended>,
    },
    /// Copy values.
    Read(Look),
}

/// Values that are asked for, and what they are worth.
#[derive(Debug)]
pub(crate) struct Look {
    pub(crate) values: Box<[Asked]>,
    /// `None`: that is not asked for.
    pub(crate) behind: Option<Box<Behind>>,
}

/// A value that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Asked {
    pub(crate) slot: u32,
    /// Its slot in the engine that is on its way to take the place of this one; [`GONE`](Self::GONE):
    /// it is not there.
    pub(crate) moved: u32,
    pub(crate) value: f64,
}

impl Asked {
    /// Stands for no slot.
    pub(crate) const GONE: u32 = u32::MAX;
}

impl Work {
    /// Holds values that are given by slot.
    pub(super) fn force(
        signals: &Signals,
        task: usize,
        stores: Box<[Store]>,
        cycles: Option<u64>,
    ) -> Self {
        let slots: Vec<usize> = stores.iter().map(|store| store.slot as usize).collect();
        let taints = signals.taints(task, &slots);
        let force = |(&slot, taints): (&usize, Box<[u32]>)| {
            let at_end = match signals.at(task, slot).map(|signal| signal.role) {
                Some(Role::Wired | Role::Output) => AtEnd::Recompute,
                _ => AtEnd::Restore,
            };
            Force { slot: slot as u32, at_end, taints, ..Force::default() }
        };
        let forces = slots.iter().zip(taints).map(force).collect();
        Self::Force { stores, forces, cycles, again: 0 }
    }

    /// Whether it has changed something, so that a journal tells of it.
    pub(crate) fn has_changed(&self) -> bool {
        match self {
            Self::Set { stores, .. } | Self::Force { stores, .. } => !stores.is_empty(),
            Self::Release { ended, .. } => !ended.is_empty(),
            Self::Read(_) => false,
        }
    }

    /// Lets go of values.
    pub(super) fn release(mut slots: Vec<u32>) -> Self {
        slots.sort_unstable();
        slots.dedup();
        let ended = Vec::with_capacity(slots.len());
        Self::Release { slots: slots.into(), ended }
    }
}

impl Order {
    pub(super) fn new(number: u64, work: Work) -> Box<Self> {
        Box::new(Self {
            number,
            at: None,
            work,
            moved: None,
            state: OrderState::Waiting,
            changes: 0,
        })
    }

    /// Number of its transaction or reading.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// What has become of it.
    pub fn state(&self) -> OrderState {
        self.state
    }

    /// Whether it reads; all others write.
    pub fn is_reading(&self) -> bool {
        matches!(self.work, Work::Read(_))
    }
}
