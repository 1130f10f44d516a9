//! What the desk of a node's holder has, for that of the standby.

use std::collections::BTreeMap;

use isochrone_engine::orders::{Order, Store, Work};
use isochrone_model::{AskedBy, Value};
use serde::{Deserialize, Serialize};

use super::{ForceRecord, Operator, ParameterValue, RetainedValue};

/// What is set and forced at a node. The values themselves are in the states of its tasks.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct DeskCopy {
    /// The last entry of the journal.
    pub sequence: u64,
    /// The next transaction.
    transaction: u64,
    set: Vec<RetainedValue>,
    forces: Vec<CopiedForce>,
}

/// A force in place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct CopiedForce {
    name: String,
    value: Value,
    since: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    until: Option<u64>,
    transaction: u64,
    by: AskedBy,
}

impl Operator {
    /// The last entry of the journal.
    pub fn last_sequence(&self) -> u64 {
        self.journal.last_sequence()
    }

    /// What the desk has.
    pub fn copy(&self) -> DeskCopy {
        let in_place = |force: &ForceRecord| {
            let ForceRecord { name, value, since, until, by, transaction } = force.clone();
            Some(CopiedForce { name, value, since: since?, until, transaction, by })
        };
        let forces = self.forces.iter().flat_map(BTreeMap::values).flatten();
        DeskCopy {
            sequence: self.last_sequence(),
            transaction: self.next,
            set: self.retained_values(),
            forces: forces.filter_map(in_place).collect(),
        }
    }

    /// Continues the numbers of transactions after `last`, the last one in the node's journal.
    pub fn continue_after(&mut self, last: u64) {
        self.number_after(last);
        self.first = self.next;
    }

    /// Gives no transaction from now on a number up to `last`.
    pub fn number_after(&mut self, last: u64) {
        self.next = self.next.max(last.saturating_add(1));
    }

    /// Takes over what the desk of another process of the same configuration has; returns the orders by which the tasks
    /// get its forces in place of theirs. `next` is the next cycle of each task.
    pub fn adopt(&mut self, copy: &DeskCopy, next: &[u64]) -> Vec<(usize, Box<Order>)> {
        self.journal.go_on_after(copy.sequence);
        self.next = self.next.max(copy.transaction);
        self.values.clear();
        for RetainedValue { name, value, .. } in &copy.set {
            let Ok(signal) = self.signals.find(name) else { continue };
            let value = ParameterValue { value: f64::from_bits(*value), version: 0 };
            self.values.insert((signal.task, signal.slot as u32), value);
        }
        let mut forces: Vec<BTreeMap<u32, Vec<ForceRecord>>> =
            vec![BTreeMap::new(); self.forces.len()];
        let mut stores: BTreeMap<usize, Vec<(u64, Option<u64>, Store)>> = BTreeMap::new();
        for CopiedForce { name, value, since, until, transaction, by } in &copy.forces {
            let Ok(signal) = self.signals.find(name) else { continue };
            let (task, slot) = (signal.task, signal.slot);
            let Some(slot_value) = signal.slot_of(*value) else { continue };
            let record = ForceRecord {
                name: name.clone(),
                value: *value,
                since: Some(*since),
                until: *until,
                by: by.clone(),
                transaction: *transaction,
            };
            if let Some(of_task) = forces.get_mut(task) {
                of_task.insert(slot as u32, vec![record]);
            }
            let store = (*transaction, *until, Store::new(slot, slot_value));
            stores.entry(task).or_default().push(store);
        }
        let mut orders = Vec::new();
        for (task, (old, new)) in self.forces.iter().zip(&forces).enumerate() {
            if old == new {
                continue;
            }
            let slots: Vec<u32> = old.keys().copied().collect();
            if !slots.is_empty() {
                let count = slots.len();
                orders.push((task, Order::new(None, Work::release(slots, count))));
            }
            for (transaction, until, store) in stores.remove(&task).unwrap_or_default() {
                let now = next.get(task).copied().unwrap_or(0);
                let cycles = until.map(|until| until.saturating_sub(now));
                let mut order = Order::new(None, self.signals.force(task, [store].into(), cycles));
                order.address(transaction, 0, None);
                orders.push((task, order));
            }
        }
        self.forces = forces;
        orders
    }
}
