//! Carrying out orders of operators in a task's cycle.

use super::{TaskEngine, read};
use crate::orders::{EndedForce, Order, OrderState, SlotForce, Work};

impl TaskEngine {
    /// Carries out an order before the cycle reads its inputs at `now_ns`; the order then has the previous values.
    /// For the real-time path.
    pub fn apply(&mut self, order: &mut Order, cycle: u64, now_ns: u64) {
        order.state = OrderState::Applied { cycle };
        self.follow(order);
        match &mut order.work {
            Work::Set { feeds, stores } => {
                stores.iter().for_each(|store| self.note_written(store.slot as usize));
                for (input, value) in feeds.iter() {
                    self.give_input(*input as usize, *value, now_ns);
                }
                for store in stores.iter_mut() {
                    if let Some(place) = self.place(store.slot as usize) {
                        store.before = std::mem::replace(place, store.value);
                    }
                }
            }
            Work::Force { stores, forces, cycles } => {
                stores.iter().for_each(|store| self.note_written(store.slot as usize));
                let until = cycles.map_or(u64::MAX, |cycles| cycle.saturating_add(cycles));
                self.forces.insert(stores, forces, until, &mut self.image);
            }
            Work::Release { slots, ended } => {
                let is_named = |force: &SlotForce| slots.binary_search(&force.slot).is_ok();
                // There is room for all forces of an order.
                self.end_forces(is_named, |force| ended.push(force));
            }
            Work::Read { .. } => {}
        }
        self.entries += u64::from(order.work.has_changed());
    }

    /// Removes the signals of a release that was [applied](Self::apply) from an earlier order that is due later, so
    /// that they are not forced after the release. For the real-time path.
    pub(crate) fn cancel(&self, earlier: &mut Order, release: &mut Order) {
        if release.state == OrderState::TooLate {
            return;
        }
        self.follow(earlier);
        earlier.work.cancel(&mut release.work, &self.image);
        if let (Some(earlier), Some(release)) = (&mut earlier.moved, &mut release.moved) {
            earlier.cancel(release, &self.image);
        }
        if earlier.work.is_released() {
            earlier.state = OrderState::Released;
        }
    }

    /// Replaces the work for the previous engine by the work for this one.
    fn follow(&self, order: &mut Order) {
        if order.changes != self.changes
            && let Some(moved) = &mut order.moved
        {
            std::mem::swap(&mut order.work, moved);
            order.changes = self.changes;
        }
    }

    /// Ends the forces that do not reach this cycle; before [`apply`](Self::apply). While none is due,
    /// it is a comparison. For the real-time path, if `ended` is.
    #[inline]
    pub fn expire(&mut self, cycle: u64, ended: impl FnMut(EndedForce)) {
        if self.forces.is_due(cycle) {
            self.end_forces(|force| force.until <= cycle, ended);
        }
    }

    /// Copies the values that an order asks for, after the blocks have stepped. For the real-time
    /// path.
    pub fn read(&self, order: &mut Order, cycle: u64) {
        order.state = OrderState::Applied { cycle };
        let is_moved = order.changes != self.changes;
        if let Work::Read { values, evidence } = &mut order.work {
            for wanted in values.iter_mut() {
                let slot = if is_moved { wanted.moved } else { wanted.slot };
                wanted.value = read(&self.image, slot);
            }
            // In another configuration, values are computed from other sources.
            if let Some(evidence) = evidence.as_mut().filter(|_| !is_moved) {
                evidence.fill(&self.sources, &self.image);
            }
        }
    }

    /// The place to write a value that may be forced.
    #[inline]
    pub(super) fn place(&mut self, slot: usize) -> Option<&mut f64> {
        if self.forces.is_empty() {
            return self.image.get_mut(slot);
        }
        match self.forces.shadow_mut(slot) {
            Some(shadow) => Some(shadow),
            None => self.image.get_mut(slot),
        }
    }

    /// The value that was written to a slot, also while a force holds another one there.
    #[inline]
    pub(super) fn written(&self, slot: usize) -> f64 {
        let shadow = if self.forces.is_empty() { None } else { self.forces.shadow(slot) };
        shadow.or_else(|| self.image.get(slot).copied()).unwrap_or_default()
    }
}
