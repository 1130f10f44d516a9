//! Requests on their way to the cycles.

use std::collections::HashSet;

use super::{Forced, Kind, Operator, Prepared, Request, Sent};
use crate::operate::Value;
use crate::operate::journal::Client;
use crate::operate::order::{Order, Work};
use crate::operate::store::Store;

impl Operator {
    /// Gives a request its number, and its orders to the one who hands them to the tasks: there must
    /// be room for all of them.
    pub fn send(&mut self, prepared: Prepared) -> (u64, Vec<(usize, Box<Order>)>) {
        let Prepared { mut orders, request, kind, .. } = prepared;
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
        let mut writes = HashSet::new();
        for (task, order) in &mut orders {
            order.number = number;
            order.changes = self.changes.get(*task).copied().unwrap_or_default();
            match &mut order.work {
                Work::Set { stores, .. } => {
                    writes.extend(stores.iter().map(|store| (*task, store.slot)));
                }
                Work::Force { stores, forces, again, .. } => {
                    forces.iter_mut().for_each(|force| force.number = number);
                    for store in stores.iter() {
                        let is_again = self.note_force(*task, store, number, &request.client);
                        *again += usize::from(is_again);
                    }
                    if let Some(pending) = self.forced_again.get_mut(*task) {
                        *pending += *again;
                    }
                }
                Work::Release { .. } | Work::Read(_) => {}
            }
        }
        let is_write = match kind {
            Kind::Set => !writes.is_empty(),
            Kind::Force | Kind::Release | Kind::Undo { .. } | Kind::Change => true,
            Kind::Read => false,
        };
        self.writes += u64::from(is_write);
        let parts = writes.iter().map(|(task, _)| task).collect::<HashSet<_>>().len();
        let Request { client, comment, at } = request;
        let sent = Sent { kind, client, comment, at, tasks: orders.len(), parts, writes };
        if sent.tasks > 0 {
            self.sent.insert(number, sent);
        }
        (number, orders)
    }

    /// Notes a force that is on its way; whether it takes the place of another.
    fn note_force(&mut self, task: usize, store: &Store, number: u64, client: &Client) -> bool {
        let Some(signal) = self.signal_at(task, store.slot) else { return false };
        let forced = Forced {
            value: Value::of(store.value, signal.value_type),
            name: signal.name,
            task,
            since: None,
            until: None,
            client: client.clone(),
            transaction: number,
        };
        let Some(forces) = self.forces.get_mut(task) else { return false };
        let of_slot = forces.entry(store.slot).or_default();
        of_slot.push(forced);
        of_slot.len() > 1
    }
}
