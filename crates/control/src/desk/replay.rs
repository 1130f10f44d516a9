//! Repeats the changes that a journal records.

use std::fmt;
use std::sync::Arc;

use isochrone_blocks::PinType;
use isochrone_engine::orders::{Order, Replacement, Store, Work};
use isochrone_engine::{OwnedRules, Plan};
use isochrone_engine::{Source, TaskEngine, Wires};
use isochrone_model::{Action, Change, Entry, Refusal, Value};

use super::fixed::Fixed;
use super::journal::{self, Changed};
use super::operator::carry;
use super::refusal::{not_repeated, unknown, wrong_value};
use super::signals::{Kept, Signals};

/// Does to the tasks of a plan what a journal says was done to them, in the cycles that it says. Given
/// the same inputs in each cycle, a task that no other task's wire enters then computes bit for bit what
/// it did.
///
/// It does not check `control`, `[[protect]]` and `[limits]`: the changes in the journal were allowed.
#[derive(Debug)]
pub struct Replay {
    /// The names of each task's engine.
    signals: Vec<Arc<Signals>>,
    fixed: Fixed,
    rules: OwnedRules,
    file: String,
    next: Option<Next>,
    /// For each task, the engine that was prepared with its values already.
    ready: Vec<Option<Replacement>>,
}

/// Another configuration, until the next comes.
struct Next {
    transaction: u64,
    signals: Arc<Signals>,
    engines: Vec<Option<TaskEngine>>,
}

/// A value that differs from the journal: the inputs, or the node, are not the same.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Difference {
    /// Name of the signal.
    pub name: String,
    /// The value before the change, according to the journal.
    pub journaled: Value,
    /// The value in this replay.
    pub found: Value,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, journaled, found } = self;
        write!(f, "\"{name}\" was {journaled} before the change, and is {found} here")
    }
}

impl Replay {
    /// Makes a replay for the tasks of a plan.
    pub fn new(plan: &Plan) -> Self {
        let signals = Arc::new(Signals::of(plan));
        Self {
            signals: vec![signals; plan.tasks.len()],
            fixed: Fixed::of(plan),
            rules: plan.rules.clone(),
            file: plan.source.name.clone(),
            next: None,
            ready: plan.tasks.iter().map(|_| None).collect(),
        }
    }

    /// Checks whether an entry can be applied after those before it.
    ///
    /// # Errors
    /// A signal does not exist, is of another task, or cannot have the value, or the entry's configuration cannot
    /// replace the one before; everything that is wrong.
    pub fn check(&mut self, entry: &Entry) -> Result<(), Refusal> {
        let task = self.task(entry);
        if entry.action != Action::Apply {
            return self.work(entry).map(drop);
        }
        let signals = self.next(entry)?.signals.clone();
        self.enter(task, signals);
        Ok(())
    }

    /// The configuration of an entry.
    fn next(&mut self, entry: &Entry) -> Result<&mut Next, Refusal> {
        let transaction = entry.transaction;
        let next = match self.next.take_if(|next| next.transaction == transaction) {
            Some(next) => next,
            None => {
                let refused = |why: &str| not_repeated(transaction, why);
                let text = entry.configuration.clone();
                let text = text.ok_or_else(|| refused("the journal does not say to what"))?;
                let source = Source { name: self.file.clone(), text };
                let plan = self
                    .rules
                    .plan(source)
                    .map_err(|findings| refused(&format!("that has errors: {findings}")))?;
                all(self.fixed.differences(&Fixed::of(&plan)).into_iter().map(Err::<(), _>))?;
                let engines = TaskEngine::build(&plan);
                let engines = engines.map_err(|error| refused(&error.to_string()))?;
                let signals = Arc::new(Signals::of(&plan));
                Next { transaction, signals, engines: engines.into_iter().map(Some).collect() }
            }
        };
        Ok(self.next.insert(next))
    }

    /// The index of the task of an entry; out of range if there is no such task.
    fn task(&self, entry: &Entry) -> usize {
        let signals = self.signals.first();
        let found = signals.and_then(|signals| signals.task_index(&entry.task));
        found.unwrap_or(usize::MAX)
    }

    fn enter(&mut self, task: usize, signals: Arc<Signals>) {
        if let Some(of_task) = self.signals.get_mut(task) {
            *of_task = signals;
        }
    }

    /// Hands over to the engine of a new configuration ahead of its cycle, as a node does after the last cycle before
    /// it, so that tasks that read this one meanwhile find the last values in the new wires. Returns the ends of
    /// these, which are [loose](TaskEngine::loosen). Values of other tasks are taken over when the entry is
    /// [applied](Self::apply).
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn hand_over(&mut self, entry: &Entry, engine: &mut TaskEngine) -> Result<Wires, Refusal> {
        let task = self.task(entry);
        let mut replacement = self.replacement(entry, engine)?;
        let wires = replacement.loosen();
        engine.hand_over(&mut replacement);
        if let Some(ready) = self.ready.get_mut(task) {
            *ready = Some(replacement);
        }
        Ok(wires)
    }

    /// The engine of a new configuration, and what it takes over.
    fn replacement(&mut self, entry: &Entry, engine: &TaskEngine) -> Result<Replacement, Refusal> {
        let task = self.task(entry);
        let next = self.next(entry)?;
        let (signals, new) = (next.signals.clone(), next.engines.get_mut(task));
        let not_repeated = |why: &str| not_repeated(entry.transaction, why);
        let new = new.and_then(Option::take);
        let new = new.ok_or_else(|| not_repeated("the journal says so twice of one task"))?;
        let old = self.signals.get(task).ok_or_else(|| not_repeated("there is no such task"))?;
        let kept = Kept::of(old, &signals);
        let changed = kept.changed(old, &signals, task);
        let carry = carry(task, (old, &signals), &kept, &changed, engine.forced_slots());
        Ok(Replacement::new(new, carry))
    }

    /// Puts the engine of a new configuration in place; returns the parameters that it set.
    fn replace(
        &mut self,
        entry: &Entry,
        engine: &mut TaskEngine,
    ) -> Result<Vec<journal::Changed>, Refusal> {
        let task = self.task(entry);
        let mut replacement = match self.ready.get_mut(task).and_then(Option::take) {
            Some(mut ready) => {
                engine.hand_imports_again(&mut ready);
                ready
            }
            None => self.replacement(entry, engine)?,
        };
        engine.replace(&mut replacement, entry.cycle);
        let signals = self.next(entry)?.signals.clone();
        self.enter(task, signals);
        let stores = replacement.stores().iter();
        Ok(stores.map(|store| Changed::of(store.slot, store.before, None)).collect())
    }

    /// Applies an entry. Call it before the cycle of the entry reads its inputs, for entries of one cycle in their
    /// order, after [`TaskEngine::expire`]. Returns the values that differ from the journal.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn apply(
        &mut self,
        entry: &Entry,
        engine: &mut TaskEngine,
    ) -> Result<Vec<Difference>, Refusal> {
        let task = self.task(entry);
        let done = match entry.action {
            Action::Apply => self.replace(entry, engine)?,
            _ => self.order(entry, engine)?,
        };
        let Some(signals) = self.signals.get(task) else { return Ok(Vec::new()) };
        let differs = |change: &Change| {
            let signal = signals.find(&change.name).ok()?;
            let slot = |done: &journal::Changed| match done.place {
                journal::SignalPlace::Slot(slot) => Some(slot as usize),
                journal::SignalPlace::Gone(_) => None,
            };
            let found = done.iter().find(|done| slot(done) == Some(signal.slot))?;
            let found = Value::of(found.before, signal.value_type);
            let Change { name, before, .. } = change.clone();
            (!is_same(before, found)).then_some(Difference { name, journaled: before, found })
        };
        Ok(entry.changes.iter().filter_map(differs).collect())
    }

    /// Applies an entry with an order; returns what it changed.
    fn order(
        &self,
        entry: &Entry,
        engine: &mut TaskEngine,
    ) -> Result<Vec<journal::Changed>, Refusal> {
        let Some(work) = self.work(entry)? else { return Ok(Vec::new()) };
        let mut order = Order::new(None, work);
        engine.apply(&mut order, entry.cycle, 0);
        Ok(match &order.work {
            Work::Set { stores, .. } | Work::Force { stores, .. } => {
                stores.iter().map(|store| Changed::of(store.slot, store.before, None)).collect()
            }
            Work::Release { ended, .. } => ended.iter().map(Changed::by_release).collect(),
            Work::Read { .. } => Vec::new(),
        })
    }

    /// `None`: forces end by themselves, and no cycle knows what people acknowledged.
    fn work(&self, entry: &Entry) -> Result<Option<Work>, Refusal> {
        let task = self.task(entry);
        let stores = || {
            let mut stores = all(entry.changes.iter().map(|change| self.store(entry, change)))?;
            stores.sort_unstable_by_key(|store| store.slot);
            Ok::<Box<[Store]>, Refusal>(stores.into())
        };
        Ok(Some(match entry.action {
            Action::Expiry | Action::Apply | Action::Ack => return Ok(None),
            Action::Release => {
                let slots = all(entry.changes.iter().map(|change| self.slot(entry, change)))?;
                let forces = slots.len();
                Work::release(slots, forces)
            }
            Action::Set | Action::Undo => Work::Set { feeds: [].into(), stores: stores()? },
            Action::Force => {
                let cycles = entry.until_cycle.map(|until| until.saturating_sub(entry.cycle));
                let Some(signals) = self.signals.get(task) else { return Ok(None) };
                signals.force(task, stores()?, cycles)
            }
        }))
    }

    fn slot(&self, entry: &Entry, change: &Change) -> Result<u32, Refusal> {
        let task = self.task(entry);
        let unknown = |help: String| unknown(&change.name, help);
        let signals = self.signals.get(task);
        let signals = signals.ok_or_else(|| unknown("there is no such task".into()))?;
        let signal = signals.find(&change.name)?;
        if signal.task == task {
            return Ok(signal.slot as u32);
        }
        let task = signals.task_name(signal.task);
        Err(unknown(format!("it is a signal of task \"{task}\"")))
    }

    fn store(&self, entry: &Entry, change: &Change) -> Result<Store, Refusal> {
        let task = self.task(entry);
        let slot = self.slot(entry, change)?;
        let of_task = self.signals.get(task);
        let signal = of_task.and_then(|signals| signals.at(task, slot as usize));
        let value_type = signal.as_ref().map_or(PinType::Lreal, |signal| signal.value_type);
        let stored = signal.zip(change.after).and_then(|(signal, after)| signal.slot_of(after));
        stored.map(|value| Store::new(slot as usize, value)).ok_or_else(|| {
            // A missing value counts as one that the signal cannot have.
            let value = change.after.unwrap_or(Value::Number(f64::NAN));
            wrong_value(&change.name, value, value_type)
        })
    }
}

/// All values, or everything that is wrong.
fn all<T>(found: impl Iterator<Item = Result<T, Refusal>>) -> Result<Vec<T>, Refusal> {
    let mut refused: Option<Refusal> = None;
    let mut note = |refusal: Refusal| match &mut refused {
        Some(refused) => refused.findings.extend(refusal.findings),
        None => refused = Some(refusal),
    };
    let found = found.filter_map(|found| found.map_err(&mut note).ok()).collect();
    match refused {
        Some(Refusal { code, findings, .. }) => Err(Refusal::of(code, findings)),
        None => Ok(found),
    }
}

/// Whether two values are equal to the bit.
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

impl fmt::Debug for Next {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Next").field("transaction", &self.transaction).finish_non_exhaustive()
    }
}
