//! Replacing a task's running engine by a new one: what is taken over, and when.

use super::{TaskEngine, Wires};
use crate::orders::{SlotForce, Store};

/// A task's new engine, and what it takes over from the running one: made and freed in an ordinary
/// thread.
///
/// The task's thread copies in the slack ([`TaskEngine::hand_over`]) and has the new engine in place
/// with the next cycle ([`TaskEngine::replace`]). The old engine then stands in the box.
pub struct Replacement {
    number: u64,
    at: u64,
    engine: TaskEngine,
    carry: Carry,
    is_ready: bool,
    cycle: Option<u64>,
}

/// The parts of the old engine that go into the new one.
#[derive(Debug, Default)]
pub struct Carry {
    /// Slots of the image.
    pub image: Box<[CopySpan]>,
    /// Words of the blocks' private state.
    pub state: Box<[CopySpan]>,
    /// The latest values of other tasks.
    pub imports: Box<[CarriedValue]>,
    /// In the order of the new slots.
    pub forces: Box<[CarriedForce]>,
    /// Parameters that have another value from now on.
    pub stores: Box<[Store]>,
}

/// Words that are consecutive in both engines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CopySpan {
    /// The first in the old engine.
    pub from: usize,
    /// The first in the new engine.
    pub to: usize,
    /// How many.
    pub len: usize,
}

/// A value of another task that is read before and after.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CarriedValue {
    /// The old engine's link that brings it, by its index among those to the task.
    pub import: usize,
    /// Its index among the values of that link.
    pub position: usize,
    /// Its slot in the new engine.
    pub slot: usize,
    /// Its source in the new engine: inputs come first, then the values of other tasks.
    pub source: usize,
}

/// A force that continues.
#[derive(Debug)]
pub struct CarriedForce {
    /// Its slot in the old engine.
    pub from: u32,
    /// The force in the new engine, except for the data that only the cycle knows.
    pub force: SlotForce,
}

impl Replacement {
    /// A task's new engine, and what it takes over.
    pub fn new(engine: TaskEngine, carry: Carry) -> Self {
        Self { number: 0, at: 0, engine, carry, is_ready: false, cycle: None }
    }

    /// Sets the number of its transaction, and the first cycle that should have it.
    pub fn address(&mut self, number: u64, at: u64) {
        (self.number, self.at) = (number, at);
    }

    /// The new engine, until it is in place.
    pub fn engine(&self) -> &TaskEngine {
        &self.engine
    }

    /// The parameters that have another value from now on.
    pub fn stores(&self) -> &[Store] {
        &self.carry.stores
    }

    /// Number of its transaction.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The first cycle that should have the new engine; if it is missed, the next that runs.
    pub fn at(&self) -> u64 {
        self.at
    }

    /// The first cycle that had the new engine; `None`: none had yet.
    pub fn cycle(&self) -> Option<u64> {
        self.cycle
    }

    /// Cuts the wires between the new engine and other tasks, as [`TaskEngine::loosen`] does.
    pub fn loosen(&mut self) -> Wires {
        self.engine.loosen()
    }

    /// Words that the task's thread copies.
    pub fn words(&self) -> usize {
        let spans = self.carry.image.iter().chain(&self.carry.state);
        spans.map(|span| span.len).sum::<usize>() + self.carry.imports.len()
    }

    /// Copies as much as [`TaskEngine::hand_over`] will, so that an ordinary thread can measure how long that takes.
    /// Call it before sending.
    pub fn rehearse(&mut self) {
        let end = |spans: &[CopySpan]| spans.iter().map(|span| span.from + span.len).max();
        let image = vec![0.0; end(&self.carry.image).unwrap_or_default()];
        let state = vec![0; end(&self.carry.state).unwrap_or_default()];
        copy(&image, &mut self.engine.image, &self.carry.image);
        copy(&state, &mut self.engine.state, &self.carry.state);
        self.store();
        self.engine.check_sharing();
    }

    fn store(&mut self) {
        for store in &mut self.carry.stores {
            if let Some(place) = self.engine.place(store.slot as usize) {
                store.before = std::mem::replace(place, store.value);
            }
        }
    }
}

impl TaskEngine {
    /// Copies the state of this engine into a new one. This one must not be stepped again before
    /// [`replace`](Self::replace). For the slack before that cycle; allocates and frees nothing.
    pub fn hand_over(&mut self, replacement: &mut Replacement) {
        let Replacement { engine: new, carry, .. } = replacement;
        copy(&self.image, &mut new.image, &carry.image);
        copy(&self.state, &mut new.state, &carry.state);
        let inputs = self.inputs.len();
        if let (Some(from), Some(to)) = (self.sources.get(..inputs), new.sources.get_mut(..inputs))
        {
            to.copy_from_slice(from);
        }
        for (to, from) in new.inputs.iter_mut().zip(&self.inputs) {
            to.given = from.given;
        }
        self.hand_imports(new, &carry.imports);
        for CarriedForce { from, force } in &mut carry.forces {
            new.forces.adopt(&self.forces, *from, force);
        }
        new.forces.adopt_new(&mut self.forces);
        (new.block_errors, new.changes) = (self.block_errors, self.changes + 1);
        (new.cycle, new.entries) = (self.cycle, self.entries + 1);
        replacement.store();
        replacement.engine.check_sharing();
        // Tasks that read them at the same instant find the last values in the new links. Only the blocks can say
        // which banks have an error.
        let new = &mut replacement.engine;
        new.has_errors = self.has_errors;
        new.bank_errors.fill(u64::from(self.has_errors));
        new.publish();
        new.bank_errors.fill(0);
        replacement.is_ready = true;
    }

    /// As [`hand_over`](Self::hand_over), for values that other tasks have sent since.
    pub fn hand_imports_again(&mut self, replacement: &mut Replacement) {
        let Replacement { engine: new, carry, .. } = replacement;
        self.hand_imports(new, &carry.imports);
    }

    fn hand_imports(&mut self, new: &mut Self, imports: &[CarriedValue]) {
        for carried in imports {
            let Some(import) = self.imports.get_mut(carried.import) else { continue };
            let parcel = import.receiver.read();
            let (value, source) =
                (parcel.values.get(carried.position), parcel.sources.get(carried.position));
            if let (Some(to), Some(value)) = (new.image.get_mut(carried.slot), value) {
                *to = *value;
            }
            if let (Some(to), Some(source)) = (new.sources.get_mut(carried.source), source) {
                *to = *source;
            }
        }
        for import in &mut new.imports {
            if let Some(before) = self.imports.iter_mut().find(|before| before.from == import.from)
            {
                import.stamp = before.receiver.read().stamp;
            }
        }
    }

    /// The slots that are forced, in ascending order.
    pub fn forced_slots(&self) -> impl Iterator<Item = u32> {
        self.forces.slots()
    }

    /// Replaces this engine by the new one, before a cycle applies orders and reads its inputs. If
    /// [`hand_over`](Self::hand_over) was not called, the state is copied now.
    pub fn replace(&mut self, replacement: &mut Replacement, cycle: u64) {
        if !replacement.is_ready {
            self.hand_over(replacement);
        }
        std::mem::swap(self, &mut replacement.engine);
        replacement.cycle = Some(cycle);
    }
}

fn copy<T: Copy>(from: &[T], to: &mut [T], spans: &[CopySpan]) {
    for span in spans {
        let words = from.get(span.from..span.from + span.len);
        let place = to.get_mut(span.to..span.to + span.len);
        if let (Some(words), Some(place)) = (words, place) {
            place.copy_from_slice(words);
        }
    }
}

impl std::fmt::Debug for Replacement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { number, at, cycle, .. } = self;
        let mut debug = f.debug_struct("Replacement");
        debug.field("number", number).field("at", at).field("cycle", cycle);
        debug.field("words", &self.words()).finish_non_exhaustive()
    }
}
