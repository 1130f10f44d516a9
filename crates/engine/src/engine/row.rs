//! The row that a recording has for each cycle: everything that went into it, and its results.

use super::TaskEngine;
use crate::plan::InputPart;

impl TaskEngine {
    /// How many values a [row](Self::read_row) of this task has.
    pub fn row_len(&self) -> usize {
        let outputs = self.outputs.iter().map(|output| 1 + output.slots.len());
        let inputs = InputPart::ALL.len() * self.inputs.len();
        1 + inputs + 2 * self.imports.len() + outputs.sum::<usize>()
    }

    /// Copies the row of the cycle that was stepped last. With the configuration, the journal and these rows, a run
    /// can be repeated bit for bit. For the real-time path, after a step.
    ///
    /// The row has, in this order:
    /// - how many entries of a journal tell of what was done to the task so far, without those of forces
    ///   that ended by themselves;
    /// - for each input the value, `ok` (0 or 1) and age (in s) that it read, whether or not a force holds
    ///   something else;
    /// - for each task with wires to this one, in the order of the plan's links, the cycle whose values
    ///   were read (NaN: of none yet), and how many online changes that task had had then;
    /// - for each output its [flags](Self::output_flags) as a number, then its signals.
    pub fn read_row(&self, row: &mut [f64]) {
        let mut row = row.iter_mut();
        let mut put = |value: f64| {
            if let Some(place) = row.next() {
                *place = value;
            }
        };
        put(self.entries as f64);
        let inputs = self.inputs.len();
        for input in 0..inputs {
            for part in InputPart::ALL {
                put(self.written(part as usize * inputs + input));
            }
        }
        for import in &self.imports {
            put(import.stamp.cycle().map_or(f64::NAN, |cycle| cycle as f64));
            put(import.stamp.changes as f64);
        }
        for (index, output) in self.outputs.iter().enumerate() {
            put(self.output_flags(index).bits() as f64);
            for slot in &output.slots {
                put(super::read(&self.image, *slot));
            }
        }
    }
}
