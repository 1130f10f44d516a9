//! The forces of a task, as its cycle applies them.

use std::ops::Range;

use isochrone_model::Flags;

use super::store::Store;

/// The most signals of a task that can be forced at a time.
pub const MAX_FORCES: usize = 1024;

/// A slot that is held at a value, whatever else writes it.
#[derive(Debug)]
pub struct SlotForce {
    pub(crate) slot: u32,
    pub(crate) value: f64,
    /// The value that the signal would have: the one that was written while it is forced.
    pub(crate) shadow: f64,
    /// First cycle without it; `u64::MAX`: until released.
    pub(crate) until: u64,
    /// The transaction that made it.
    pub(crate) number: u64,
    pub(crate) at_end: AtEnd,
    /// What it affects: outputs, then values for other tasks.
    pub(crate) taints: Box<[u32]>,
    /// The same in the engine that will replace this one.
    pub moved: Option<Box<SlotForce>>,
}

/// The value of a signal after its force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AtEnd {
    /// It gets the value that was written meanwhile.
    Restore,
    /// Wires or its block write it in the next step; until then it is what the cycle before has left.
    Recompute,
}

impl SlotForce {
    /// A force of this slot, as an order brings it: its value is the order's. `taints` are the indexes of the
    /// outputs that are computed from the slot, then those of the values for other tasks behind them.
    pub fn new(slot: u32, at_end: AtEnd, taints: Box<[u32]>) -> Self {
        Self { slot, at_end, taints, ..Self::default() }
    }

    /// Its slot.
    pub fn slot(&self) -> u32 {
        self.slot
    }
}

impl Default for SlotForce {
    fn default() -> Self {
        let (value, shadow, taints) = (0.0, 0.0, [].into());
        let (until, number, at_end, moved) = (0, 0, AtEnd::Recompute, None);
        Self { slot: 0, value, shadow, until, number, at_end, taints, moved }
    }
}

/// A force that has ended.
#[derive(Debug)]
pub struct EndedForce(SlotForce);

impl EndedForce {
    /// A force that will not be applied: its signal keeps its value.
    pub(crate) fn before_it_began(force: SlotForce, image: &[f64]) -> Self {
        let value = image.get(force.slot as usize).copied().unwrap_or_default();
        Self(SlotForce { value, shadow: value, ..force })
    }

    /// The slot that it held.
    pub fn slot(&self) -> u32 {
        self.0.slot
    }

    /// The transaction that made it.
    pub fn number(&self) -> u64 {
        self.0.number
    }

    /// The value that it held there; of one that was still to come, the value of the signal.
    pub fn value(&self) -> f64 {
        self.0.value
    }

    /// The value that the slot has instead; `None`: the next step computes it.
    pub fn after(&self) -> Option<f64> {
        (self.0.at_end == AtEnd::Restore).then_some(self.0.shadow)
    }
}

/// All forces of a task. Nothing here allocates or frees but [`new`](Self::new).
pub(crate) struct Forces {
    /// By slot.
    table: Vec<SlotForce>,
    next_until: u64,
    /// How many forces act on each output, then on each value for another task.
    tainted: Box<[u16]>,
}

impl Forces {
    /// No forces, and room for all. `given`: how many outputs and values for other tasks there are.
    pub(crate) fn new(given: usize) -> Self {
        // Written once, so that the cycle causes no page fault there.
        let mut table: Vec<SlotForce> = (0..MAX_FORCES).map(|_| SlotForce::default()).collect();
        table.clear();
        Self { table, next_until: u64::MAX, tainted: vec![0; given].into() }
    }

    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// The flags that forces add to an output, or to a value for another task.
    #[inline]
    pub(crate) fn flags(&self, given: usize) -> Flags {
        let is_forced = self.tainted.get(given).is_some_and(|forces| *forces > 0);
        if is_forced { Flags::FORCED } else { Flags::NONE }
    }

    /// Whether one of these slots is forced.
    pub(crate) fn holds_any(&self, slots: &Range<usize>) -> bool {
        self.of(slots).next().is_some()
    }

    /// Those of these slots that are forced.
    pub(crate) fn of(&self, slots: &Range<usize>) -> impl Iterator<Item = usize> {
        let (Ok(from) | Err(from)) = self.find(slots.start);
        let forces = self.table.get(from..).unwrap_or_default().iter();
        forces.map(|force| force.slot as usize).take_while(|slot| *slot < slots.end)
    }

    /// The value that was written to a slot while it is forced.
    pub(crate) fn shadow(&self, slot: usize) -> Option<f64> {
        let found = self.find(slot).ok()?;
        self.table.get(found).map(|force| force.shadow)
    }

    /// Writes the values beneath the forces into a copy of the image.
    pub(crate) fn uncover(&self, image: &mut [f64]) {
        for force in &self.table {
            if let Some(slot) = image.get_mut(force.slot as usize) {
                *slot = force.shadow;
            }
        }
    }

    /// Goes on above an image that has the values beneath the forces.
    pub(crate) fn cover(&mut self, image: &mut [f64]) {
        for force in &mut self.table {
            if let Some(slot) = image.get_mut(force.slot as usize) {
                force.shadow = std::mem::replace(slot, force.value);
            }
        }
    }

    /// The place to write a slot while it is forced.
    pub(crate) fn shadow_mut(&mut self, slot: usize) -> Option<&mut f64> {
        let found = self.find(slot).ok()?;
        self.table.get_mut(found).map(|force| &mut force.shadow)
    }

    /// Writes the forced values of a part of the image.
    pub(crate) fn hold(&self, first_slot: usize, slots: &mut [f64]) {
        let (Ok(from) | Err(from)) = self.find(first_slot);
        for force in self.table.get(from..).unwrap_or_default() {
            let Some(slot) = slots.get_mut(force.slot as usize - first_slot) else { break };
            *slot = force.value;
        }
    }

    /// Forces slots of an image. What is given for a slot that is forced already stays with the
    /// caller, to be freed there.
    pub(crate) fn insert(
        &mut self,
        stores: &mut [Store],
        given: &mut [SlotForce],
        until: u64,
        image: &mut [f64],
    ) {
        let known = self.table.len();
        for (store, new) in stores.iter_mut().zip(given) {
            // One that was released before has no slot.
            let Some(slot) = image.get_mut(store.slot as usize) else { continue };
            store.before = *slot;
            let table = self.table.get_mut(..known).unwrap_or_default();
            let found = table.binary_search_by_key(&store.slot, |force| force.slot);
            let at_end = if let Some(force) = found.ok().and_then(|found| table.get_mut(found)) {
                (force.value, force.until, force.number) = (store.value, until, new.number);
                force.at_end
            } else if self.table.len() < MAX_FORCES {
                let (slot, value, shadow) = (store.slot, store.value, *slot);
                let new = SlotForce { slot, value, shadow, until, ..std::mem::take(new) };
                let at_end = new.at_end;
                count(&mut self.tainted, &new.taints, 1);
                self.table.push(new);
                at_end
            } else {
                // The sender counts forces, so this does not happen.
                continue;
            };
            // A computed slot keeps its value until then, for wires that read the cycle before.
            if at_end == AtEnd::Restore {
                *slot = store.value;
            }
        }
        if self.table.len() > known {
            self.table.sort_unstable_by_key(|force| force.slot);
        }
        self.note_next();
    }

    /// Goes on with a force of another table: the one of `slot`, if it is still there. `new` says where
    /// it is here, and stays empty with the caller. By slots in ascending order.
    pub(crate) fn adopt(&mut self, others: &Self, slot: u32, new: &mut SlotForce) {
        let found = others.find(slot as usize).ok().and_then(|found| others.table.get(found));
        found.into_iter().for_each(|force| self.go_on(force, new));
    }

    /// Goes on with those forces of another table that were made since it is known that this one takes
    /// its place; after [`adopt`](Self::adopt).
    pub(crate) fn adopt_new(&mut self, others: &mut Self) {
        let carried = self.table.len();
        for force in &mut others.table {
            let Some(mut moved) = force.moved.take() else { continue };
            let known = self.table.get(..carried).unwrap_or_default();
            if known.binary_search_by_key(&moved.slot, |force| force.slot).is_err() {
                self.go_on(force, &mut moved);
            }
            // Freed where the table is.
            force.moved = Some(moved);
        }
        if self.table.len() > carried {
            self.table.sort_unstable_by_key(|force| force.slot);
        }
    }

    fn go_on(&mut self, force: &SlotForce, new: &mut SlotForce) {
        if self.table.len() >= MAX_FORCES {
            return;
        }
        count(&mut self.tainted, &new.taints, 1);
        let &SlotForce { value, shadow, until, number, .. } = force;
        self.table.push(SlotForce { value, shadow, until, number, ..std::mem::take(new) });
        self.next_until = self.next_until.min(until);
    }

    /// Ends forces, and gives the image what was written meanwhile.
    pub(crate) fn end(
        &mut self,
        mut ends: impl FnMut(&SlotForce) -> bool,
        image: &mut [f64],
        mut ended: impl FnMut(EndedForce),
    ) {
        for force in self.table.extract_if(.., |force| ends(force)) {
            count(&mut self.tainted, &force.taints, -1);
            if force.at_end == AtEnd::Restore
                && let Some(slot) = image.get_mut(force.slot as usize)
            {
                *slot = force.shadow;
            }
            ended(EndedForce(force));
        }
        self.note_next();
    }

    /// The slots that are forced, in ascending order.
    pub(crate) fn slots(&self) -> impl Iterator<Item = u32> {
        self.table.iter().map(|force| force.slot)
    }

    /// Whether a force ends at a cycle.
    #[inline]
    pub(crate) fn is_due(&self, cycle: u64) -> bool {
        cycle >= self.next_until
    }

    fn note_next(&mut self) {
        self.next_until = self.table.iter().map(|force| force.until).min().unwrap_or(u64::MAX);
    }

    fn find(&self, slot: usize) -> Result<usize, usize> {
        self.table.binary_search_by_key(&slot, |force| force.slot as usize)
    }
}

fn count(tainted: &mut [u16], taints: &[u32], change: i16) {
    for given in taints {
        if let Some(forces) = tainted.get_mut(*given as usize) {
            *forces = forces.saturating_add_signed(change);
        }
    }
}
