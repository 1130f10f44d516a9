//! Checks that may refuse a new configuration.

use isochrone_model::{Code, Refusal, Value};

use super::Basis;
use crate::desk::operator::check::Check;
use crate::desk::permissions::Permissions;
use crate::desk::refusal::protected;
use crate::desk::signals::{ChangedPin, Kept, Signals};

impl Basis {
    pub(super) fn check_forces(&self, check: &mut Check<'_>, kept: &Kept) {
        let forces = self.forces.iter().enumerate();
        let forces = forces.flat_map(|(task, of)| of.iter().map(move |force| (task, force)));
        for (task, (slot, forced)) in forces {
            if kept.slot(task, *slot as usize).is_none() {
                let is_variable = self.signals.is_variable(task, *slot as usize);
                let what = if is_variable { "it" } else { "its block" };
                let message = format!(
                    "\"{forced}\" is forced, and the new configuration does not keep {what}"
                );
                let help = "release it first";
                check.refuse(Refusal::one(Code::CannotChange, forced, message, help));
            }
        }
    }

    /// Protected signals must stay as they are.
    pub(super) fn check_protected(
        &self,
        check: &mut Check<'_>,
        kept: &Kept,
        signals: &Signals,
        changed: &[Vec<ChangedPin>],
    ) {
        for (text, pattern) in self.permissions.protected() {
            let matches = self.signals.matching(pattern);
            let gone = matches.slots(0).find(|(task, slot)| kept.slot(*task, *slot).is_none());
            let signal = gone.and_then(|(task, slot)| self.signals.at(task, slot));
            if let Some(signal) = signal {
                check.refuse(protected(&signal.name, text));
            }
        }
        let pins = changed.iter().enumerate();
        let pins = pins.flat_map(|(task, pins)| pins.iter().map(move |pin| (task, pin.slot)));
        for signal in pins.filter_map(|(task, slot)| signals.at(task, slot)) {
            check.note(self.permissions.check_name(&signal));
        }
    }

    /// Values that were set and stay must lie within the new limits.
    pub(super) fn check_limits(
        &self,
        check: &mut Check<'_>,
        kept: &Kept,
        signals: &Signals,
        permissions: &Permissions,
        changed: &[Vec<ChangedPin>],
    ) {
        for (&(task, slot), &held) in &self.values {
            let Some(slot) = kept.slot(task, slot as usize) else { continue };
            let is_changed = changed
                .get(task)
                .is_some_and(|pins| pins.binary_search_by_key(&slot, |pin| pin.slot).is_ok());
            let Some(signal) = signals.at(task, slot).filter(|_| !is_changed) else { continue };
            let value = Value::of(held, signal.value_type);
            // Where nothing was given, nothing is bounded.
            if !held.is_nan() {
                check.note(permissions.bound(&signal, held, value));
            }
        }
    }
}
