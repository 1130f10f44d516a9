//! Undoing transactions.

use std::collections::BTreeMap;

use isochrone_engine::orders::Store;
use isochrone_engine::orders::Work;
use isochrone_model::{Action, Code, Refusal, Value};

use super::check::Check;
use super::requests::{prepared, sorted};
use super::{Kind, Operator, PreparedRequest, RequestTerms};
use crate::desk::journal::{Changed, Record, SignalPlace};
use crate::desk::permissions::Intent;
use crate::desk::refusal;

impl Operator {
    /// Prepares to undo a transaction. `next` as with [`set`](Self::set).
    ///
    /// # Errors
    /// It is not completely known or has not been applied in all its tasks, it set nothing, a parameter has changed
    /// since or is about to, or a previous value is outside the current limits.
    pub fn undo(
        &self,
        transaction: u64,
        request: RequestTerms,
        next: &[u64],
    ) -> Result<PreparedRequest, Refusal> {
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
        // If it is undone already, that would be a finding for each of its signals; one is enough.
        check.dedup();
        let at = self.check_at(&mut check, &request, stores.keys().copied(), next);
        check.end()?;
        let warnings = self.warn_of_set(&stores);
        let work =
            |(task, stores)| (task, Work::Set { feeds: [].into(), stores: sorted(Some(stores)) });
        let orders = stores.into_iter().map(work).collect();
        let kind = Kind::Undo { of: transaction };
        Ok(prepared(orders, request, kind, warnings, at).due(at, next))
    }

    /// Whether a transaction sets parameters and is completely known.
    fn check_undoable(&self, transaction: u64) -> Result<(), Refusal> {
        if self.sent.contains_key(&transaction) {
            return Err(refusal::waiting(transaction));
        }
        let mut records = self.journal.changes_of(transaction);
        if let Some(record) = records.next() {
            // The journal drops old entries one by one, so a part may be missing.
            let is_whole = record.parts == records.count() + 1;
            return is_whole.then_some(()).ok_or_else(|| refusal::unknown_transaction(transaction));
        }
        Err(match self.journal.action_of(transaction) {
            Some(action) => no_set(transaction, action),
            None if (1..self.first).contains(&transaction) => {
                let message = format!(
                    "transaction {transaction} is of an earlier run of the node, which cannot be undone"
                );
                let help = "set what it changed; `isochrone journal FILE.jsonl` shows that";
                Refusal::one(Code::UnknownName, "", message, help)
            }
            None => refusal::unknown_transaction(transaction),
        })
    }

    /// The store that undoes a change.
    fn restored(&self, record: &Record, changed: &Changed) -> Result<Store, Refusal> {
        let transaction = record.transaction;
        let slot = match &changed.place {
            SignalPlace::Slot(slot) => *slot,
            SignalPlace::Gone(signal) => {
                let name = &signal.0;
                let message =
                    format!("\"{name}\", which transaction {transaction} set, is gone since");
                let help = "set what took its place";
                return Err(Refusal::one(Code::Conflict, name, message, help));
            }
        };
        let key = (record.task, slot);
        let gone = || refusal::unknown_transaction(transaction);
        let signal = self.signal_at(record.task, slot).ok_or_else(gone)?;
        let held = self.values.get(&key);
        if held.is_none_or(|held| held.version != changed.versions.1) {
            return Err(match self.journal.taken_back_by(transaction) {
                Some(by) => {
                    let message =
                        format!("transaction {transaction} is already undone, by transaction {by}");
                    let help = format!("undo {by} to have its values again");
                    Refusal::one(Code::Conflict, "", message, help)
                }
                None => {
                    let name = signal.name;
                    let message = format!("\"{name}\" was changed since transaction {transaction}");
                    let help = "undo what changed it first, or set it";
                    Refusal::one(Code::Conflict, name, message, help)
                }
            });
        }
        let is_moving = |(_, sent): &(&u64, &super::PendingRequest)| sent.writes.contains_key(&key);
        if let Some((&by, _)) = self.sent.iter().find(is_moving) {
            let name = signal.name;
            let message = format!("transaction {by} is about to change \"{name}\"");
            let help = format!("undo {by} first, once it has been applied");
            return Err(Refusal::one(Code::Conflict, name, message, help));
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

/// The refusal if a transaction did not set values.
fn no_set(transaction: u64, action: Action) -> Refusal {
    let (deed, help) = match action {
        Action::Apply => ("an apply", "apply the configuration from before it to go back"),
        Action::Force => ("a force", "release what it forces"),
        Action::Ack => ("an acknowledgement", "the alarm needs another one when it comes again"),
        Action::Expiry => ("an expiry", "force it again"),
        Action::Release | Action::Set | Action::Undo => ("a release", "force it again"),
    };
    let message = format!("transaction {transaction} is {deed}, which cannot be undone");
    Refusal::one(Code::NotWritable, "", message, help)
}
