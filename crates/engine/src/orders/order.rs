//! Orders from an operator to a task's cycle: made and freed in an ordinary thread, filled in by the
//! cycle.

use super::evidence::Evidence;
use super::forces::{EndedForce, SlotForce};
use super::store::Store;

/// One box of work for one task. The cycle writes what it found into it, and gives it back.
#[derive(Debug)]
pub struct Order {
    number: u64,
    pub(crate) at: Option<u64>,
    /// What is to be done; once it is applied, what was done.
    pub work: Work,
    /// The same for the engine that is on its way to the task; the cycle that does it puts it in the
    /// place of the other.
    pub(crate) moved: Option<Work>,
    pub(crate) state: OrderState,
    pub(crate) changes: u64,
}

/// How far an order is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
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
    /// All of its forces were released before its cycle. Nothing happened.
    Released,
}

/// What is to be done. A slot stands once in it.
#[derive(Debug)]
pub enum Work {
    /// Give values to inputs and parameters.
    Set {
        /// Inputs, by their index in the plan, and their values.
        feeds: Box<[(u32, f64)]>,
        /// Parameters.
        stores: Box<[Store]>,
    },
    /// Hold values.
    Force {
        /// The values, by slot in ascending order.
        stores: Box<[Store]>,
        /// One for each store.
        forces: Box<[SlotForce]>,
        /// How many cycles; `None`: until released.
        cycles: Option<u64>,
    },
    /// End forces, also those that were asked for before and are still to come; made by [`Work::release`].
    Release {
        /// In ascending order.
        slots: Box<[u32]>,
        /// The forces that ended: those in place, then those that will not come. Has room for all.
        ended: Vec<EndedForce>,
    },
    /// Copy values.
    Read {
        /// The values.
        values: Box<[ReadSlot]>,
        /// From which follows what they are worth; `None`: that is not asked for.
        evidence: Option<Box<Evidence>>,
    },
}

/// A value that is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadSlot {
    /// Its slot.
    pub slot: u32,
    /// Its slot in the engine that is on its way to take the place of this one; [`GONE`](Self::GONE):
    /// it is not there.
    pub moved: u32,
    /// The value, once it is read.
    pub value: f64,
}

impl ReadSlot {
    /// Stands for no slot.
    pub const GONE: u32 = u32::MAX;
}

impl Work {
    /// Ends the forces of these slots: so many, with those that are still to come.
    pub fn release(mut slots: Vec<u32>, forces: usize) -> Self {
        slots.sort_unstable();
        slots.dedup();
        Self::Release { slots: slots.into(), ended: Vec::with_capacity(forces) }
    }

    /// Takes what a release names out of forces that are still to come. For the real-time path.
    pub(crate) fn cancel(&mut self, release: &mut Self, image: &[f64]) {
        let (Self::Force { stores, forces, .. }, Self::Release { slots, ended }) = (self, release)
        else {
            return;
        };
        for (store, force) in stores.iter_mut().zip(forces) {
            let is_named = slots.binary_search(&store.slot).is_ok();
            // The sender counts forces, so there is room.
            if is_named && ended.len() < ended.capacity() {
                ended.push(EndedForce::before_it_began(std::mem::take(force), image));
                store.slot = Store::RELEASED;
            }
        }
    }

    /// Whether there is nothing left of forces that were still to come.
    pub(crate) fn is_released(&self) -> bool {
        matches!(self, Self::Force { stores, .. } if stores.iter().all(Store::is_released))
    }

    /// Whether it changed something that belongs in a journal.
    pub(crate) fn has_changed(&self) -> bool {
        match self {
            Self::Set { stores, .. } | Self::Force { stores, .. } => !stores.is_empty(),
            // It is journalled also where the forces have ended meanwhile.
            Self::Release { .. } => true,
            Self::Read { .. } => false,
        }
    }

    fn number_forces(&mut self, number: u64) {
        if let Self::Force { forces, .. } = self {
            forces.iter_mut().for_each(|force| force.number = number);
        }
    }
}

impl Order {
    /// Work for the cycle `at`, or for the next one.
    pub fn new(at: Option<u64>, work: Work) -> Box<Self> {
        let (number, moved, state, changes) = (0, None, OrderState::Waiting, 0);
        Box::new(Self { number, at, work, moved, state, changes })
    }

    /// Gives it the number of its transaction or reading, and says how often the task's engine had been replaced
    /// when it was made. `moved` is the same work for the engine that is on its way to the task, if there is one.
    pub fn address(&mut self, number: u64, changes: u64, moved: Option<Work>) {
        (self.number, self.changes, self.moved) = (number, changes, moved);
        self.work.number_forces(number);
        self.moved.iter_mut().for_each(|moved| moved.number_forces(number));
    }

    /// Number of its transaction or reading.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// How often the task's engine had been replaced when it was made.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// How far it is.
    pub fn state(&self) -> OrderState {
        self.state
    }

    /// Whether it reads; all others write.
    pub fn is_reading(&self) -> bool {
        matches!(self.work, Work::Read { .. })
    }
}
