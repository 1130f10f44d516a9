//! What another configuration does to values, and which of those that were set it leaves alone.

use std::collections::HashMap;

use isochrone_blocks::PinType;
use isochrone_model::{ChangedValue, Given, Tuned, Value};

use super::Basis;
use crate::desk::signals::{ChangedPin, Kept, Signal, Signals};

/// Most pins that are listed one by one: naming one takes some microseconds.
const TOLD: usize = 10_000;

impl Basis {
    /// Values of the pins that are changed; empty if there are too many to list.
    pub(super) fn changed_values(
        &self,
        new: &Signals,
        changed: &[Vec<ChangedPin>],
    ) -> Vec<ChangedValue> {
        if changed.iter().map(Vec::len).sum::<usize>() > TOLD {
            return Vec::new();
        }
        let mut told = Vec::new();
        for (task, pins) in changed.iter().enumerate() {
            // A change that is the same for all instances of a block is listed once.
            let mut order: Vec<(Given, Given, PinType)> = Vec::new();
            let mut slots: HashMap<String, (usize, Vec<usize>)> = HashMap::new();
            for pin in pins {
                let Some(signal) = new.at(task, pin.slot) else { continue };
                let after = match pin.constant {
                    Some(constant) => Given::Value(Value::of(constant, signal.value_type)),
                    None => Given::Wire { wire: new.source_name(task, pin.slot) },
                };
                let Some(before) = self.given(&signal) else { continue };
                let (_, alike) = slots
                    .entry(format!("{before:?} {after:?} {}", signal.value_type))
                    .or_insert_with(|| {
                        order.push((before, after, signal.value_type));
                        (order.len() - 1, Vec::new())
                    });
                alike.push(pin.slot);
            }
            let mut alike: Vec<_> = slots.into_values().collect();
            alike.sort_unstable();
            for ((before, after, value_type), (_, slots)) in order.into_iter().zip(alike) {
                let names = new.pin_names(task, &slots).into_iter();
                told.extend(names.map(|name| ChangedValue {
                    name,
                    before: before.clone(),
                    after: after.clone(),
                    value_type: Some(value_type.to_string()),
                }));
            }
        }
        told
    }

    /// What the pin of this name has now.
    fn given(&self, signal: &Signal<'_>) -> Option<Given> {
        let old = self.signals.locate(&signal.name)?;
        if self.signals.is_wired(old.task, old.slot) {
            return Some(Given::Wire { wire: self.signals.source_name(old.task, old.slot) });
        }
        let held = self.values.get(&(old.task, old.slot as u32)).copied();
        let value = held.or_else(|| self.signals.constant(old.task, old.slot))?;
        Some(Given::Value(Value::of(value, old.value_type)))
    }

    /// The values that were set and stay, though the new configuration has others.
    pub(super) fn tuned(
        &self,
        kept: &Kept,
        new: &Signals,
        changed: &[Vec<ChangedPin>],
    ) -> Vec<Tuned> {
        let tuned = self.values.iter().filter_map(|(&(task, slot), &value)| {
            let slot = kept.slot(task, slot as usize)?;
            let pins = changed.get(task)?;
            let is_changed = pins.binary_search_by_key(&slot, |pin| pin.slot).is_ok();
            let configured = new.constant(task, slot)?;
            if is_changed || configured.to_bits() == value.to_bits() {
                return None;
            }
            let Signal { name, value_type, .. } = new.at(task, slot)?;
            let [value, configured] = [value, configured].map(|slot| Value::of(slot, value_type));
            Some(Tuned { name, value, configured, value_type: Some(value_type.to_string()) })
        });
        tuned.take(TOLD).collect()
    }
}
