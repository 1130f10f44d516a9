//! Orders that come back from the cycles, and their results.

use std::collections::{HashMap, HashSet};

use isochrone_engine::orders::{EndedForce, Evidence, Order, OrderState, ReadSlot, Store, Work};
use isochrone_model::{Action, AskedBy, Entry, Flags, Value};

use super::{ForceRecord, Kind, Operator, ParameterValue, PendingRequest};
use crate::desk::journal::{Changed, Record, SignalPlace};
use crate::desk::quality::Behind;

/// The result of an order.
#[expect(clippy::large_enum_variant, reason = "there is one for an order, which is moved once")]
#[derive(Debug, Clone, PartialEq)]
pub enum OrderOutcome {
    /// It was applied. Values that the program gave to inputs are neither journaled nor among the changes.
    Applied(Entry),
    /// It arrived after its cycle had begun; nothing was changed.
    TooLate {
        /// Its transaction.
        transaction: u64,
    },
    /// All its forces were released before its cycle; nothing was changed.
    Released {
        /// Its transaction.
        transaction: u64,
    },
    /// Values were read.
    Read(Reading),
}

/// Values of one task, all of one cycle, after its blocks have stepped.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Number of the request.
    pub number: u64,
    /// Index of the task.
    pub task: usize,
    /// The cycle.
    pub cycle: u64,
    /// Names and values.
    pub values: Vec<(String, Value)>,
    /// How many requested values are missing: the configuration changed before the task came to the request, and
    /// their signals are gone, or their new slots were not known yet.
    pub lost: usize,
    /// For each value, the flags that a frame with only this value would carry. The `ok` and `age` of an input never
    /// have any. `None`: the configuration changed meanwhile, or the values are computed from too many blocks.
    pub quality: Option<Vec<Flags>>,
}

/// The data of a transaction for an order that has come back.
struct Settled {
    kind: Kind,
    parts: usize,
    by: AskedBy,
    /// For a reading: what its values are computed from.
    behind: Option<Behind>,
}

impl Operator {
    /// Whether an order is of a request to this desk, and not one by which it follows another.
    pub fn has_sent(&self, order: &Order) -> bool {
        self.sent.contains_key(&order.number())
    }

    /// Takes an order back. `unix_ns` is now, in ns of UTC since 1970.
    pub fn done(&mut self, task: usize, order: Box<Order>, unix_ns: u64) -> OrderOutcome {
        let number = order.number();
        let Settled { kind, parts, by, behind } = self.settle(task, &order);
        if order.state() == OrderState::Released {
            return OrderOutcome::Released { transaction: number };
        }
        let OrderState::Applied { cycle } = order.state() else {
            if let Work::Force { .. } = &order.work {
                // Its slots may be those of the previous engine.
                let forces = self.forces.get(task).into_iter().flatten();
                let slots: Vec<u32> = forces.map(|(slot, _)| *slot).collect();
                self.forget(task, slots, number);
            }
            return OrderOutcome::TooLate { transaction: number };
        };
        let undone = match kind {
            Kind::Undo { of } => Some(of),
            _ => None,
        };
        let mut until = None;
        let changes_before = order.changes();
        let (action, changes) = match order.work {
            Work::Read { values, evidence } => {
                let is_moved = self.changes.get(task).is_some_and(|now| *now != changes_before);
                let mut reading = self.reading(number, task, cycle, &values, is_moved);
                reading.quality = behind
                    .zip(evidence.filter(|_| !is_moved))
                    .and_then(|(behind, evidence)| self.quality(task, &behind, &evidence));
                return OrderOutcome::Read(reading);
            }
            Work::Set { stores, .. } => {
                let action = if undone.is_some() { Action::Undo } else { Action::Set };
                (action, self.written(task, number, undone, &stores))
            }
            Work::Force { stores, cycles, .. } => {
                until = cycles.map(|cycles| cycle.saturating_add(cycles));
                for store in &stores {
                    let forces = self.forces.get_mut(task).and_then(|of| of.get_mut(&store.slot));
                    let Some(forces) = forces else { continue };
                    // It has replaced the one before.
                    forces.retain(|forced| forced.since.is_none());
                    for forced in forces.iter_mut().filter(|of| of.transaction == number) {
                        (forced.since, forced.until) = (Some(cycle), until);
                    }
                }
                let changed =
                    |store: &Store| Changed::of(store.slot, store.before, Some(store.value));
                let forced = stores.iter().filter(|store| !store.is_released());
                (Action::Force, forced.map(changed).collect())
            }
            Work::Release { ended, .. } => {
                for force in &ended {
                    self.forget(task, [force.slot()], force.number());
                }
                // One in place comes before one of the same signal that was still to come.
                let mut seen = HashSet::new();
                let ended = ended.iter().filter(|force| seen.insert(force.slot()));
                (Action::Release, ended.map(Changed::by_release).collect())
            }
        };
        let record = Record::new(number, (task, cycle), unix_ns, action, changes);
        let record = Record { parts, by, until, undone, ..record };
        // Values that the program gives to inputs are no changes by an operator.
        if record.changes.is_empty() && action != Action::Release {
            return OrderOutcome::Applied(self.entry(&record));
        }
        OrderOutcome::Applied(self.add(record))
    }

    /// Records a force that ended by itself before `cycle`.
    pub fn expired(&mut self, task: usize, ended: EndedForce, cycle: u64, unix_ns: u64) -> Entry {
        let transaction = ended.number();
        let forced = self.forget(task, [ended.slot()], transaction);
        let by = forced.map(|forced| AskedBy { comment: None, ..forced.by }).unwrap_or_default();
        let changes = [Changed::by_release(&ended)].into();
        let record = Record::new(transaction, (task, cycle), unix_ns, Action::Expiry, changes);
        let record = Record { by, ..record };
        self.add(record)
    }

    /// Records that one of a transaction's orders has come back.
    fn settle(&mut self, task: usize, order: &Order) -> Settled {
        let Some(sent) = self.sent.get_mut(&order.number()) else {
            let (kind, by, behind) = (Kind::Read, AskedBy::default(), None);
            return Settled { kind, parts: 1, by, behind };
        };
        match &order.work {
            Work::Set { stores, .. } => {
                for store in stores {
                    sent.writes.remove(&(task, store.slot));
                }
            }
            Work::Force { .. } => {
                if let Some(pending) = self.forced_again.get_mut(task) {
                    *pending -= sent.again.remove(&task).unwrap_or_default();
                }
            }
            Work::Release { .. } | Work::Read { .. } => {}
        }
        sent.due.remove(&task);
        let behind = sent.behind.remove(&task);
        sent.tasks -= 1;
        let PendingRequest { kind, parts, .. } = *sent;
        let settled = Settled { kind, parts, by: sent.by.clone(), behind };
        if sent.tasks == 0 {
            self.sent.remove(&order.number());
        }
        settled
    }

    /// Forgets forces of a transaction; returns the last.
    fn forget(
        &mut self,
        task: usize,
        slots: impl IntoIterator<Item = u32>,
        transaction: u64,
    ) -> Option<ForceRecord> {
        let of_task = self.forces.get_mut(task)?;
        let mut last = None;
        for slot in slots {
            let Some(forces) = of_task.get_mut(&slot) else { continue };
            let found = forces.iter().position(|forced| forced.transaction == transaction);
            last = found.map(|found| forces.remove(found)).or(last);
            if forces.is_empty() {
                of_task.remove(&slot);
            }
        }
        last
    }

    /// Records the values that were set, each with its version: the transaction that set it. A value that is taken
    /// back gets the version from before that transaction.
    fn written(
        &mut self,
        task: usize,
        number: u64,
        undone: Option<u64>,
        stores: &[Store],
    ) -> Box<[Changed]> {
        let restored: HashMap<u32, u64> = match undone {
            Some(of) => {
                let records = self.journal.changes_of(of).filter(|record| record.task == task);
                let changes = records.flat_map(|record| &record.changes);
                let restored = |changed: &Changed| match changed.place {
                    SignalPlace::Slot(slot) => Some((slot, changed.versions.0)),
                    SignalPlace::Gone(_) => None,
                };
                changes.filter_map(restored).collect()
            }
            None => HashMap::new(),
        };
        let mut write = |store: &Store| {
            let version = restored.get(&store.slot).copied().unwrap_or(number);
            let held = ParameterValue { value: store.value, version };
            let before = self.values.insert((task, store.slot), held);
            let versions = (before.map_or(0, |held| held.version), version);
            Changed { versions, ..Changed::of(store.slot, store.before, Some(store.value)) }
        };
        stores.iter().map(&mut write).collect()
    }

    fn reading(
        &self,
        number: u64,
        task: usize,
        cycle: u64,
        read: &[ReadSlot],
        is_moved: bool,
    ) -> Reading {
        let value = |read: &ReadSlot| {
            let slot = if is_moved { read.moved } else { read.slot };
            let signal = self.signal_at(task, slot)?;
            Some((signal.name, Value::of(read.value, signal.value_type)))
        };
        let values: Vec<_> = read.iter().filter_map(value).collect();
        let lost = read.len() - values.len();
        Reading { number, task, cycle, values, lost, quality: None }
    }

    /// The quality of each value of a reading.
    fn quality(&self, task: usize, behind: &Behind, evidence: &Evidence) -> Option<Vec<Flags>> {
        let forces = self.forces.get(task);
        let is_forced = |slots: std::ops::Range<usize>| {
            let slots = slots.start as u32..slots.end as u32;
            let mut held = forces.into_iter().flat_map(|forces| forces.range(slots.clone()));
            held.any(|(_, forces)| forces.iter().any(|forced| forced.since.is_some()))
        };
        behind.flags(evidence, is_forced)
    }
}
