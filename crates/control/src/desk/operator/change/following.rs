//! A new configuration taking effect, task by task.

use std::collections::HashMap;
use std::sync::Arc;

use isochrone_engine::orders::Replacement;
use isochrone_engine::orders::Store;
use isochrone_model::{Action, AskedBy, Entry};

use super::Next;
use crate::desk::journal::{Applied, Changed, Record, SignalPlace};
use crate::desk::operator::check::Check;
use crate::desk::operator::{Operator, ParameterValue};
use crate::desk::signals::Signal;

impl Operator {
    /// Takes back the box of a task that has its new engine. `unix_ns` is now, in ns of UTC since 1970.
    pub fn replaced(&mut self, task: usize, replacement: Replacement, unix_ns: u64) -> Entry {
        let (number, cycle) = (replacement.number(), replacement.cycle());
        let stores = replacement.stores();
        let applied = self.follow(task, stores);
        let mut by = AskedBy::default();
        if let Some(sent) = self.sent.get_mut(&number) {
            by.clone_from(&sent.by);
            sent.tasks -= 1;
            if sent.tasks == 0 {
                self.sent.remove(&number);
            }
        }
        let written = |store: &Store| Changed::of(store.slot, store.before, Some(store.value));
        let changes = stores.iter().map(written).collect();
        let at = (task, cycle.unwrap_or_default());
        let record = Record::new(number, at, unix_ns, Action::Apply, changes);
        let entry = self.add(Record { by, configuration: applied, ..record });
        let is_over = |next: &Next| next.returned.iter().all(|returned| *returned);
        if let Some(next) = self.next_plan.take_if(|next| is_over(next)) {
            let Next { signals, mut permissions, warnings, fixed, .. } = *next;
            permissions.unwritten = self.permissions.unwritten.take();
            (self.signals, self.permissions) = (signals, permissions);
            (self.warnings, self.fixed) = (warnings, fixed);
        }
        entry
    }

    /// The change of the configuration that is on its way to the tasks.
    pub fn changing(&self) -> Option<u64> {
        self.next_plan.as_ref().map(|next| next.number)
    }

    /// Refuses a further change while one is on its way.
    pub(in crate::desk::operator) fn check_settled(&self, check: &mut Check<'_>) {
        if let Some(next) = &self.next_plan {
            check.refuse(next.refusal());
        }
    }

    /// Moves the records about a task's values to their new slots. Returns the configuration.
    fn follow(&mut self, task: usize, stores: &[Store]) -> Option<Arc<Applied>> {
        let Self { signals, next_plan, values, forces, sent, journal, changes, .. } = self;
        let next = next_plan.as_deref_mut()?;
        let is_held = |slot: u32| {
            let is_settable = |signal: Signal<'_>| signal.role.is_settable();
            next.signals.at(task, slot as usize).is_some_and(is_settable)
                && stores.binary_search_by_key(&slot, |store| store.slot).is_err()
        };
        let follow = |((of, slot), held): ((usize, u32), ParameterValue)| {
            if of != task {
                return Some(((of, slot), held));
            }
            let slot = next.slot(task, slot).filter(|slot| is_held(*slot))?;
            Some(((task, slot), held))
        };
        *values = std::mem::take(values).into_iter().filter_map(follow).collect::<HashMap<_, _>>();
        if let Some(forces) = forces.get_mut(task) {
            let known = std::mem::take(forces).into_iter();
            *forces = known.filter_map(|(slot, f)| Some((next.slot(task, slot)?, f))).collect();
        }
        for sent in sent.values_mut() {
            let follow = |(of, slot): (usize, u32)| {
                let slot = if of == task { next.slot(task, slot)? } else { slot };
                Some((of, slot))
            };
            let writes = std::mem::take(&mut sent.writes).into_iter();
            sent.writes = writes.filter_map(|(at, value)| Some((follow(at)?, value))).collect();
            let releases = std::mem::take(&mut sent.releases).into_iter();
            sent.releases = releases.filter_map(follow).collect();
        }
        journal.follow(task, |slot| {
            let known = || signals.at(task, slot as usize);
            let gone = || {
                let signal = known().map(|signal| (signal.name, signal.value_type));
                signal.map_or(SignalPlace::Slot(slot), |signal| SignalPlace::Gone(Box::new(signal)))
            };
            next.slot(task, slot).map_or_else(gone, SignalPlace::Slot)
        });
        if let Some(changes) = changes.get_mut(task) {
            *changes += 1;
        }
        if let Some(returned) = next.returned.get_mut(task) {
            *returned = true;
        }
        Some(Arc::clone(&next.applied))
    }
}
