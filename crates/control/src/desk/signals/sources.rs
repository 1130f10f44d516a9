//! The sources of the values of slots.

use std::ops::Range;

use isochrone_blocks::Indication;

use super::{Import, Signals};

impl Signals {
    /// The wires to some slots of a task: where each comes from, and where it leads to.
    pub(in crate::desk) fn wires_to(
        &self,
        task: usize,
        slots: Range<usize>,
    ) -> impl Iterator<Item = (usize, usize)> {
        let wires = self.tasks.get(task).map_or(&[][..], |task| &task.wires);
        let first = wires.partition_point(|wire| (wire.to as usize) < slots.start);
        let wires = wires.get(first..).unwrap_or_default().iter();
        let wires = wires.map(|wire| (wire.from as usize, wire.to as usize));
        wires.take_while(move |(_, to)| *to < slots.end)
    }

    /// The source of its task that a slot belongs to: an input, with all of its parts, or a value of another task.
    /// `None`: it is a pin.
    pub(in crate::desk) fn source_at(&self, task: usize, slot: usize) -> Option<usize> {
        let found = self.tasks.get(task)?;
        let inputs = found.inputs.len();
        if slot < found.first_variable() {
            return slot.checked_rem(inputs);
        }
        let of_import = |import: &Import| {
            slot.checked_sub(import.first_slot).is_some_and(|place| place < import.slots.len())
        };
        found.imports.iter().any(of_import).then(|| slot - found.first_import() + inputs)
    }

    /// The initial value of a variable, or the constant of an input pin, if no wire leads to it.
    pub(in crate::desk) fn constant(&self, task: usize, slot: usize) -> Option<f64> {
        if let Some(variable) = self.tasks.get(task)?.variable_at(slot) {
            return Some(variable.initial);
        }
        let instance = self.instance_of(task, slot).filter(|_| !self.is_wired(task, slot))?;
        instance.constants.get(slot - instance.first_slot).copied()
    }

    /// All pins of the instance that a pin's slot belongs to: their slots, how many of them are inputs, and how the
    /// block indicates errors.
    pub(in crate::desk) fn pins_of(
        &self,
        task: usize,
        slot: usize,
    ) -> Option<(Range<usize>, usize, Option<Indication>)> {
        let (run, offset, _) = self.pin_at(task, slot)?;
        let first = run.slot(offset, 0);
        let block_type = &run.block_type;
        let slots = first..first + block_type.slots();
        Some((slots, block_type.inputs.len(), block_type.indication()))
    }
}
