//! The values that a new configuration changes, and the values set at run time that it keeps.

use std::collections::HashMap;

use isochrone_blocks::PinType;
use isochrone_model::{ChangedValue, Given, Tuned, Value};

use super::Basis;
use crate::desk::signals::{ChangedPin, Kept, Signal, Signals};

/// The most pins that are listed: naming one takes some microseconds.
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
        let mut changed_values = Vec::new();
        for (task, pins) in changed.iter().enumerate() {
            // A change that is the same for all instances of a block is listed once.
            let mut order: Vec<(Given, Given, PinType)> = Vec::new();
            let mut slots: HashMap<String, (usize, Vec<usize>)> = HashMap::new();
            for pin in pins {
                let Some(signal) = new.at(task, pin.slot) else { continue };
                let after = match pin.constant {
                    Some(constant) => Given::Value(Value::of(constant, signal.value_type)),
                    None => {
                        let wire = new.source_name(task, pin.slot);
                        Given::Wire { wire: wire.unwrap_or_default() }
                    }
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
                changed_values.extend(names.map(|name| ChangedValue {
                    name,
                    before: before.clone(),
                    after: after.clone(),
                    value_type: Some(value_type.to_string()),
                }));
            }
        }
        changed_values
    }

    /// The constant, wire or expression that the pin of this name has now.
    fn given(&self, signal: &Signal<'_>) -> Option<Given> {
        let old = self.signals.locate(&signal.name)?;
        if let Some(wire) = self.signals.source_name(old.task, old.slot) {
            return Some(Given::Wire { wire });
        }
        let held = self.values.get(&(old.task, old.slot as u32)).copied();
        let value = held.or_else(|| self.signals.constant(old.task, old.slot))?;
        Some(Given::Value(Value::of(value, old.value_type)))
    }

    /// Values that were set at run time and stay, although the new configuration gives others.
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
