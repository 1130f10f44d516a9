//! Taking back what was set.

use std::collections::BTreeMap;

use super::check::Check;
use super::requests::{prepared, sorted};
use super::{Kind, Operator, Prepared, Request};
use crate::operate::Value;
use crate::operate::journal::{Changed, Place, Record};
use crate::operate::order::Work;
use crate::operate::permissions::Intent;
use crate::operate::refusal::{Refusal, Refusals};
use crate::operate::store::Store;

impl Operator {
    /// Prepares to take back what a transaction set. `next` as with [`set`](Self::set).
    ///
    /// # Errors
    /// It is not known whole or has not been applied in all its tasks, it set nothing, a parameter was
    /// changed since or is about to be, or a value from before is outside of the limits of now.
    pub fn undo(
        &self,
        transaction: u64,
        request: Request,
        next: &[u64],
    ) -> Result<Prepared, Refusals> {
        let mut check = Check::of_writing(self);
        check.is_empty = false;
        check.note(self.permissions.check(Intent::Set));
        check.note(self.check_undoable(transaction));
        let mut stores: BTreeMap<usize, Vec<Store>> = BTreeMap::new();
        for record in self.journal.changes_of(transaction) {
            for changed in &record.changes {
                let found = self.restored(record, changed);
                if let Some(store) = check.note(found) {
                    stores.entry(record.task).or_default().push(store);
                }
            }
        }
        // One reason for all that is taken back already.
        check.findings.dedup_by(|a, b| a == b && matches!(a, Refusal::TakenBack { .. }));
        self.check_at(&mut check, &request, stores.keys().copied(), next);
        check.end()?;
        let warnings = self.warn_of_set(&stores);
        let work =
            |(task, stores)| (task, Work::Set { feeds: [].into(), stores: sorted(Some(stores)) });
        let orders = stores.into_iter().map(work).collect();
        Ok(prepared(orders, request, Kind::Undo { of: transaction }, warnings).due(next))
    }

    /// Whether a transaction is one that sets, and is known whole.
    fn check_undoable(&self, transaction: u64) -> Result<(), Refusal> {
        if self.sent.contains_key(&transaction) {
            return Err(Refusal::Waiting { transaction });
        }
        let mut records = self.journal.changes_of(transaction);
        if let Some(record) = records.next() {
            // The journal forgets entry by entry.
            let is_whole = record.parts == records.count() + 1;
            return is_whole.then_some(()).ok_or(Refusal::UnknownTransaction { transaction });
        }
        Err(match self.journal.action_of(transaction) {
            Some(action) => Refusal::NoSet { transaction, action: action.as_str() },
            None if (1..self.first).contains(&transaction) => Refusal::EarlierRun { transaction },
            None => Refusal::UnknownTransaction { transaction },
        })
    }

    /// What takes a change back.
    fn restored(&self, record: &Record, changed: &Changed) -> Result<Store, Refusal> {
        let transaction = record.transaction;
        let slot = match &changed.place {
            Place::Slot(slot) => *slot,
            Place::Gone(signal) => {
                return Err(Refusal::Gone { name: signal.0.clone(), transaction });
            }
        };
        let key = (record.task, slot);
        let gone = || Refusal::UnknownTransaction { transaction };
        let signal = self.signal_at(record.task, slot).ok_or_else(gone)?;
        let held = self.values.get(&key);
        if held.is_none_or(|held| held.version != changed.versions.1) {
            return Err(match self.journal.taken_back_by(transaction) {
                Some(by) => Refusal::TakenBack { transaction, by },
                None => Refusal::Conflict { name: signal.name, transaction },
            });
        }
        let is_moving = |(_, sent): &(&u64, &super::Sent)| sent.writes.contains_key(&key);
        if let Some((&by, _)) = self.sent.iter().find(is_moving) {
            return Err(Refusal::Moving { name: signal.name, by });
        }
        self.permissions.check_name(&signal)?;
        self.check_not_given(&signal)?;
        // Where nothing was given, nothing is bounded.
        if !changed.before.is_nan() {
            let value = Value::of(changed.before, signal.value_type);
            for permissions in self.permissions_of(record.task) {
                permissions.bound(&signal, changed.before, value)?;
            }
        }
        Ok(Store::new(slot as usize, changed.before))
    }
}
