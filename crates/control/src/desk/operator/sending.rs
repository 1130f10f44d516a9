//! Sending requests to the cycles.

use std::collections::{BTreeMap, HashMap, HashSet};

use isochrone_engine::orders::{Order, SlotForce, Store, Work};
use isochrone_model::{AskedBy, Value};

use super::requests::sorted;
use super::{ForceRecord, Kind, Operator, PendingRequest, PreparedRequest};

impl Operator {
    /// Gives a request its number; returns it with its orders, for the caller to send to the tasks, which must have
    /// room for all of them.
    pub fn send(&mut self, prepared: PreparedRequest) -> (u64, Vec<(usize, Box<Order>)>) {
        let PreparedRequest { mut orders, request, kind, due, behind, .. } = prepared;
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
        let (mut writes, mut releases) = (HashMap::new(), HashSet::new());
        let mut again = BTreeMap::new();
        for (task, order) in &mut orders {
            let changes = self.changes.get(*task).copied().unwrap_or_default();
            let moved = self.follow_ahead(*task, &mut order.work);
            order.address(number, changes, moved);
            match &order.work {
                Work::Set { stores, .. } => {
                    writes.extend(stores.iter().map(|store| ((*task, store.slot), store.value)));
                }
                Work::Force { stores, .. } => {
                    let is_again =
                        |store: &&Store| self.note_force(*task, store, number, &request.by);
                    let count = stores.iter().filter(is_again).count();
                    if let Some(pending) = self.forced_again.get_mut(*task) {
                        *pending += count;
                    }
                    again.insert(*task, count);
                }
                Work::Release { slots, .. } => {
                    releases.extend(slots.iter().map(|slot| (*task, *slot)));
                }
                Work::Read { .. } => {}
            }
        }
        let is_write = match kind {
            Kind::Set => !writes.is_empty(),
            // If there is nothing to release, there is nothing to wait for.
            Kind::Release => !orders.is_empty(),
            Kind::Force | Kind::Undo { .. } | Kind::Change => true,
            Kind::Read => false,
        };
        self.writes += u64::from(is_write);
        let parts = writes.keys().map(|(task, _)| task).collect::<HashSet<_>>().len();
        let sent = PendingRequest::new(kind, request, orders.len());
        let sent = PendingRequest { due, parts, writes, releases, again, behind, ..sent };
        if sent.tasks > 0 {
            self.sent.insert(number, sent);
        }
        (number, orders)
    }

    /// The same work for the case that the task applies it after the change of the configuration on its way. That all
    /// its signals exist then has been checked.
    fn follow_ahead(&self, task: usize, work: &mut Work) -> Option<Work> {
        let next = self.next_of(task)?;
        let moved = |stores: &[Store]| -> Vec<Store> {
            let follow =
                |store: &Store| Some(Store { slot: next.slot(task, store.slot)?, ..*store });
            stores.iter().filter_map(follow).collect()
        };
        match work {
            Work::Set { feeds, stores } => {
                Some(Work::Set { feeds: feeds.clone(), stores: sorted(Some(moved(stores))) })
            }
            Work::Force { stores, forces, cycles } => {
                let of_next = || next.signals.force(task, sorted(Some(moved(stores))), *cycles);
                // Forces from before the change continue after it.
                if let Work::Force { forces: of_next, .. } = of_next() {
                    let mut of_next: HashMap<u32, SlotForce> =
                        of_next.into_iter().map(|force| (force.slot(), force)).collect();
                    for force in forces {
                        let slot = next.slot(task, force.slot());
                        force.moved = slot.and_then(|slot| of_next.remove(&slot)).map(Box::new);
                    }
                }
                Some(of_next())
            }
            Work::Release { slots, ended } => {
                let slots = slots.iter().filter_map(|slot| next.slot(task, *slot));
                Some(Work::release(slots.collect(), ended.capacity()))
            }
            Work::Read { .. } => None,
        }
    }

    /// Records a force on its way; whether it replaces another.
    fn note_force(&mut self, task: usize, store: &Store, number: u64, by: &AskedBy) -> bool {
        let Some(signal) = self.signal_at(task, store.slot) else { return false };
        let forced = ForceRecord {
            value: Value::of(store.value, signal.value_type),
            name: signal.name,
            since: None,
            until: None,
            by: by.clone(),
            transaction: number,
        };
        let Some(forces) = self.forces.get_mut(task) else { return false };
        let of_slot = forces.entry(store.slot).or_default();
        of_slot.push(forced);
        of_slot.len() > 1
    }
}
