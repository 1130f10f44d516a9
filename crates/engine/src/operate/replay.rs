//! What a journal says was done, done again.

use std::fmt;

use super::forces::Ended;
use super::journal::{Action, Change, Entry};
use super::operator::{changed, released};
use super::order::{Order, Store, Work};
use super::refusal::{Refusal, Refusals};
use super::signals::Signals;
use super::{Value, journal};
use crate::TaskEngine;
use crate::plan::Plan;

/// Does to the tasks of a plan what a journal says was done to them, in the cycles that it says. Given
/// the same inputs in each cycle, a task that no other task's wire enters then computes bit for bit what
/// it did.
///
/// Nothing is asked of `control`, `[[protect]]` and `[limits]`: what was done was allowed.
#[derive(Debug)]
pub struct Replay {
    signals: Signals,
}

/// A value that was not what the journal says it was: the inputs, or the node, are others.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Name of the signal.
    pub name: String,
    /// What it was before the change, as the journal says.
    pub journaled: Value,
    /// What it was now.
    pub found: Value,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, journaled, found } = self;
        write!(f, "\"{name}\" was {journaled} before the change, and is {found} here")
    }
}

impl Replay {
    /// For the tasks of a plan.
    pub fn new(plan: &Plan) -> Self {
        Self { signals: Signals::of(plan) }
    }

    /// Whether what an entry says can be done.
    ///
    /// # Errors
    /// A signal is not there, is of another task, or cannot have the value; all that is wrong.
    pub fn check(&self, entry: &Entry) -> Result<(), Refusals> {
        self.work(entry).map(drop)
    }

    /// Does what an entry says, before the cycle that it names reads its inputs; entries of one cycle
    /// in their order, after [`TaskEngine::expire`]. Returns the values that were others before.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn apply(
        &self,
        entry: &Entry,
        engine: &mut TaskEngine,
    ) -> Result<Vec<Difference>, Refusals> {
        let Some(work) = self.work(entry)? else { return Ok(Vec::new()) };
        let mut order = Order::new(entry.transaction, None, work);
        engine.apply(&mut order, entry.cycle, 0);
        let done: Vec<journal::Changed> = match &order.work {
            Work::Set { stores, .. } | Work::Force { stores, .. } => {
                stores.iter().map(|store| changed(store.slot, store.before, None)).collect()
            }
            Work::Release { ended, .. } => {
                ended.iter().map(|ended: &Ended| released(ended)).collect()
            }
            Work::Read(_) => Vec::new(),
        };
        let differs = |change: &Change| {
            let signal = self.signals.find(&change.name).ok()?;
            let slot = |done: &journal::Changed| match done.place {
                journal::Place::Slot(slot) => Some(slot as usize),
                journal::Place::Gone(_) => None,
            };
            let found = done.iter().find(|done| slot(done) == Some(signal.slot))?;
            let found = Value::of(found.before, signal.value_type);
            let Change { name, before, .. } = change.clone();
            (!is_same(before, found)).then_some(Difference { name, journaled: before, found })
        };
        Ok(entry.changes.iter().filter_map(differs).collect())
    }

    /// `None`: forces end by themselves.
    fn work(&self, entry: &Entry) -> Result<Option<Work>, Refusals> {
        let stores = || {
            let mut stores = all(entry.changes.iter().map(|change| self.store(entry, change)))?;
            stores.sort_unstable_by_key(|store| store.slot);
            Ok::<Box<[Store]>, Refusals>(stores.into())
        };
        Ok(Some(match entry.action {
            Action::Expiry => return Ok(None),
            Action::Apply => {
                let transaction = entry.transaction;
                return Err(Refusal::NotRepeated { transaction }.into());
            }
            Action::Release => {
                Work::release(all(entry.changes.iter().map(|change| self.slot(entry, change)))?)
            }
            Action::Set | Action::Undo { .. } => Work::Set { feeds: [].into(), stores: stores()? },
            Action::Force { until } => {
                let cycles = until.map(|until| until.saturating_sub(entry.cycle));
                Work::force(&self.signals, entry.task, stores()?, cycles)
            }
        }))
    }

    fn slot(&self, entry: &Entry, change: &Change) -> Result<u32, Refusal> {
        let signal = self.signals.find(&change.name)?;
        if signal.task == entry.task {
            return Ok(signal.slot as u32);
        }
        let help = format!("it is a signal of task \"{}\"", self.signals.task_name(signal.task));
        Err(Refusal::Unknown { name: change.name.clone(), help })
    }

    fn store(&self, entry: &Entry, change: &Change) -> Result<Store, Refusal> {
        let slot = self.slot(entry, change)?;
        let value_type = self.signals.find(&change.name)?.value_type;
        // A value that is missing cannot be had by a signal either.
        let value = change.after.unwrap_or(Value::Number(f64::NAN));
        match value.slot(value_type) {
            // A pin that nothing was given before a transaction has nothing again after its undo.
            None if matches!(change.after, Some(Value::Number(after)) if after.is_nan()) => {
                Ok(Store::new(slot as usize, f64::NAN))
            }
            Some(value) => Ok(Store::new(slot as usize, value)),
            None => Err(Refusal::Value { name: change.name.clone(), value, value_type }),
        }
    }
}

/// All of them, or all that is wrong.
fn all<T>(found: impl Iterator<Item = Result<T, Refusal>>) -> Result<Vec<T>, Refusals> {
    let mut findings = Vec::new();
    let found = found.filter_map(|found| found.map_err(|it| findings.push(it)).ok()).collect();
    Refusals::check(findings).map(|()| found)
}

/// Whether two values are one, to the bit.
fn is_same(a: Value, b: Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.to_bits() == b.to_bits(),
        // A number may have been written without a decimal point.
        (Value::Integer(a), Value::Number(b)) | (Value::Number(b), Value::Integer(a)) => {
            a as f64 == b
        }
        (a, b) => a == b,
    }
}
