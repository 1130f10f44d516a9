//! The input pins that a change of the configuration gives other constants or wires, and the variables that it gives
//! other initial values.

use std::collections::HashMap;

use isochrone_blocks::{BlockType, Pin};
use isochrone_engine::WirePlan;
use isochrone_engine::orders::CopySpan;

use super::super::{Signals, Task, split};
use super::{Kept, Stretch};

/// An input pin of an instance that is in both plans, and that has another constant or wire; or an output with another
/// expression, or a variable that has another initial value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::desk) struct ChangedPin {
    /// In the second plan.
    pub(in crate::desk) slot: usize,
    /// Its constant or initial value there, if no wire leads to it.
    pub(in crate::desk) constant: Option<f64>,
}

impl Kept {
    /// The input pins of a task that have another constant or wire, and the variables with another initial value, in
    /// the order of the new image.
    pub(in crate::desk) fn changed(
        &self,
        old: &Signals,
        new: &Signals,
        task: usize,
    ) -> Vec<ChangedPin> {
        let (Some(of_old), Some(of_new)) = (old.tasks.get(task), new.tasks.get(task)) else {
            return Vec::new();
        };
        let places = new.imported(task);
        let origin = |wire: WirePlan| {
            let from = wire.from as usize;
            self.slot(task, from).or_else(|| {
                let (from, slot) = of_old.import_at(from)?;
                places.get(&(from, self.slot(from, slot)?)).copied()
            })
        };
        let initial = |(from, slot): (usize, usize)| {
            let (before, now) =
                (of_old.variable_at(from)?.initial, of_new.variable_at(slot)?.initial);
            let is_same = before.to_bits() == now.to_bits();
            (!is_same).then_some(ChangedPin { slot, constant: Some(now) })
        };
        let mut changed: Vec<ChangedPin> = self.variables(task).filter_map(initial).collect();
        for stretch in self.stretches(task) {
            changed.extend(stretch.changed_expressions());
            let (Some((from, ..)), Some((to, ..))) =
                (old.pin_at(task, stretch.from), new.pin_at(task, stretch.to))
            else {
                continue;
            };
            let (stride, inputs) =
                (stretch.block_type.slots(), stretch.block_type.parameters().len());
            for instance in 0..stretch.instances {
                for pin in 0..inputs {
                    let offset = instance * stride + pin;
                    let (known, slot) = (stretch.from + offset, stretch.to + offset);
                    let constant = to.constants.get(pin).copied().unwrap_or_default();
                    let is_same = match (of_old.wire_to(known), of_new.wire_to(slot)) {
                        (None, None) => {
                            let before = from.constants.get(pin).copied().unwrap_or_default();
                            before.to_bits() == constant.to_bits()
                        }
                        (Some(before), Some(now)) => {
                            origin(before) == Some(now.from as usize)
                                && of_old.is_delayed(known) == of_new.is_delayed(slot)
                        }
                        _ => false,
                    };
                    if !is_same {
                        let constant = of_new.wire_to(slot).is_none().then_some(constant);
                        changed.push(ChangedPin { slot, constant });
                    }
                }
            }
        }
        changed.sort_unstable_by_key(|pin| pin.slot);
        changed
    }
}

impl Stretch {
    /// The outputs of an `Expr` that are in both plans, with another expression.
    fn changed_expressions(&self) -> Vec<ChangedPin> {
        let (before, now) = (self.from_type, self.block_type);
        if before.id() == now.id() || now.formulas().is_none() {
            return Vec::new();
        }
        let text =
            |of: &BlockType, place: usize| of.outputs.get(place - of.inputs.len()).map(Pin::doc);
        let is_other = |span: &&CopySpan| text(&before, span.from) != text(&now, span.to);
        let changed = self.carried.outputs.iter().filter(is_other).map(|span| span.to);
        let changed: Vec<usize> = changed.collect();
        let of_instance = |instance| {
            let first = self.to + instance * now.slots();
            changed.iter().map(move |place| ChangedPin { slot: first + place, constant: None })
        };
        (0..self.instances).flat_map(of_instance).collect()
    }
}

impl Signals {
    /// Names of variables and pins by their slots; one that stands for all instances of a block has a `*`.
    pub(in crate::desk) fn pin_names(&self, task: usize, slots: &[usize]) -> Vec<String> {
        let (mut names, mut order) = (Vec::new(), Vec::new());
        let mut pins: HashMap<(u32, usize), Vec<usize>> = HashMap::new();
        for &slot in slots {
            let Some((run, _, pin)) = self.pin_at(task, slot) else {
                names.extend(self.at(task, slot).map(|signal| signal.name));
                continue;
            };
            let of_pin = pins.entry((run.block, pin)).or_default();
            if of_pin.is_empty() {
                order.push((run.block, pin));
            }
            of_pin.push(slot);
        }
        for key in order {
            let slots = pins.remove(&key).unwrap_or_default();
            let count = self.blocks.get(key.0 as usize).map_or(0, |block| block.count);
            let mut signals = slots.iter().filter_map(|slot| self.at(task, *slot));
            if slots.len() == count && count > 1 {
                let parts = signals.next().and_then(|signal| {
                    let (instance, pin) = signal.name.rsplit_once('.')?;
                    Some(format!("{}.*.{pin}", split(instance)?.0))
                });
                names.extend(parts);
            } else {
                names.extend(signals.map(|signal| signal.name));
            }
        }
        names
    }
}

impl Task {
    /// Whether the wire to a slot is of the cycle before.
    fn is_delayed(&self, slot: usize) -> bool {
        self.delayed.binary_search_by_key(&slot, |to| *to as usize).is_ok()
    }

    /// The task and slot that another task's value comes from.
    fn import_at(&self, slot: usize) -> Option<(usize, usize)> {
        self.imports.iter().find_map(|import| {
            let from = *import.slots.get(slot.checked_sub(import.first_slot)?)?;
            Some((import.from, from as usize))
        })
    }
}
