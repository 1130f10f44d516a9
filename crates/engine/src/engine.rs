//! A task's process image and banks, and the call that steps them.

mod builder;
mod carried;
mod many;
mod orders;
mod parcel;
mod replacement;
mod row;
mod sharing;
mod state;
mod warm_start;
mod wires;

use std::ops::Range;

use isochrone_blocks::alarm::{AlarmReads, step_alarms};
use isochrone_blocks::{BlockType, Cycle, PinType};
use isochrone_model::Flags;
use triple_buffer::{Input as Sender, Output as Receiver};

use crate::orders::Forces;
use crate::plan::{InputPart, WirePlan};
use crate::worth::{Origins, Source, Worth};

pub use carried::CarriedInstance;
use many::Many;
pub use parcel::Parcel;
use parcel::Stamp;
pub use replacement::{CarriedForce, CarriedValue, Carry, CopySpan, Replacement};
pub use state::TaskState;
pub use warm_start::WarmStart;
pub use wires::Wires;

/// One task, ready to be stepped by the thread that owns it.
///
/// [`step`](Self::step) and everything that reads or writes values is for the real-time path: no
/// allocation, no lock, no system call, no panic.
pub struct TaskEngine {
    period_ns: u64,
    obs: Box<[(i16, u64)]>,
    /// Whoever writes an input slot of a bank calls `note_written`; whoever writes many, `forget_sharing` or
    /// `check_sharing`.
    image: Box<[f64]>,
    state: Box<[u64]>,
    inputs: Box<[Input]>,
    /// The sources of the values from outside: the inputs, then the imported values, as in the image.
    sources: Box<[Source]>,
    imports: Box<[Import]>,
    previous: Box<[WirePlan]>,
    banks: Box<[Bank]>,
    exports: Box<[Export]>,
    outputs: Box<[Output]>,
    /// For each bank how many of its blocks report an error in this cycle.
    bank_errors: Box<[u64]>,
    /// Whether any block does.
    has_errors: bool,
    forces: Forces,
    block_errors: u64,
    /// How many engines the task had before this one.
    changes: u64,
    /// The last cycle that was stepped, by this engine or one before it; `NO_CYCLE`: none.
    cycle: u64,
    /// How many journal entries there are of changes to it, not counting forces that ended by themselves.
    entries: u64,
    /// How many banks are to be checked for inputs that their instances share, and which was looked at last.
    unchecked: usize,
    next_checked: usize,
}

struct Input {
    value_type: PinType,
    /// Nothing of what its samples are worth is handed on.
    feedback: bool,
    /// The value that an operator set, until it is taken.
    given: Option<GivenSample>,
}

/// A value that an operator set an input to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenSample {
    /// The value.
    pub value: f64,
    /// When, in ns.
    pub source_ns: u64,
}

/// The value of an input in a cycle, and its quality.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputReading {
    /// Its value: of the newest sample, or a substitute.
    pub value: f64,
    /// Whether it is a fresh and good sample.
    pub ok: bool,
    /// Age of the sample at the start of the cycle, in seconds; infinite before the first one.
    pub age_s: f64,
    /// When the oldest sample behind the value was published, in ns; 0: there is none.
    pub source_ns: u64,
    /// The flags for everything that is computed from the value.
    pub flags: Flags,
}

/// A bank knows where its slots begin; they end where the next bank's begin.
struct Bank {
    block_type: BlockType,
    first_slot: usize,
    slots: usize,
    state_words: usize,
    /// Wires that are copied one by one.
    wires: Box<[WirePlan]>,
    stepping: Stepping,
}

/// How a bank is stepped.
enum Stepping {
    /// One instance after the other.
    Each,
    /// Many instances, which may share inputs.
    Many(Box<Many>),
    /// Alarms, by the wires that are not copied.
    Alarms(Box<[AlarmReads]>),
}

struct Output {
    slots: Box<[u32]>,
    origins: Origins,
}

struct Export {
    /// Index of the task that reads it.
    to: usize,
    slots: Box<[u32]>,
    /// For each value what it is computed from.
    origins: Box<[Origins]>,
    sender: Sender<Parcel>,
}

struct Import {
    /// Index of the task that it comes from.
    from: usize,
    first_slot: usize,
    first_source: usize,
    /// Of the values that stand in the image.
    stamp: Stamp,
    receiver: Receiver<Parcel>,
}

impl TaskEngine {
    /// Steps every block of the task once. `cycle` is the index on the task's grid, skipped cycles
    /// included.
    ///
    /// Every slot that is looked up here exists: [`build`](Self::build) has checked it.
    pub fn step(&mut self, cycle: u64) {
        self.cycle = cycle;
        let cycle = Cycle::new(cycle, self.period_ns, &self.obs);
        for import in &mut self.imports {
            // Earlier values are in the image already.
            if !import.receiver.update() {
                continue;
            }
            let parcel = import.receiver.output_buffer();
            import.stamp = parcel.stamp;
            let slots = self.image.get_mut(import.first_slot..).unwrap_or_default();
            slots.iter_mut().zip(&parcel.values).for_each(|(slot, value)| *slot = *value);
            let sources = self.sources.get_mut(import.first_source..).unwrap_or_default();
            sources.iter_mut().zip(&parcel.sources).for_each(|(to, from)| *to = *from);
        }
        for wire in &self.previous {
            let value = read(&self.image, wire.from);
            if let Some(slot) = self.image.get_mut(wire.to as usize) {
                *slot = value;
            }
        }
        let errors_before = self.block_errors;
        let forces = &self.forces;
        let (banks, image, state) = (&self.banks, &mut self.image, &mut self.state);
        let errors = &mut self.bank_errors;
        self.block_errors += if forces.is_empty() {
            step_banks(banks, image, state, errors, &cycle, |_, _| {})
        } else {
            step_banks(banks, image, state, errors, &cycle, |first, slots| {
                forces.hold(first, slots)
            })
        };
        self.has_errors = self.block_errors != errors_before;
        self.publish();
    }

    /// Sends the other tasks the values that they read.
    #[inline(always)]
    fn publish(&mut self) {
        let mut given = self.outputs.len();
        let stamp = Stamp { cycle: self.cycle, changes: self.changes };
        for export in &mut self.exports {
            let parcel = export.sender.input_buffer_mut();
            parcel.stamp = stamp;
            for (value, slot) in parcel.values.iter_mut().zip(&export.slots) {
                *value = read(&self.image, *slot);
            }
            let worth = Worth {
                sources: &self.sources,
                bank_errors: self.has_errors.then_some(&*self.bank_errors),
                image: &self.image,
            };
            for (source, origins) in parcel.sources.iter_mut().zip(&export.origins) {
                *source = worth.of(origins);
            }
            if !self.forces.is_empty() {
                for (source, given) in parcel.sources.iter_mut().zip(given..) {
                    source.flags |= self.forces.flags(given);
                }
            }
            given += export.slots.len();
            export.sender.publish();
        }
    }

    /// Sets the value and the quality of an input, by its index in the plan, for the next step. `false`: the input's
    /// type cannot hold the value, and nothing has changed.
    pub fn read_input(&mut self, input: usize, reading: &InputReading) -> bool {
        let Some(known) = self.inputs.get(input).filter(|it| it.value_type.holds(reading.value))
        else {
            return false;
        };
        let source = Source { source_ns: reading.source_ns, flags: reading.flags };
        let source = if known.feedback { Source::CONSTANT } else { source };
        let inputs = self.inputs.len();
        let parts = [reading.value, f64::from(u8::from(reading.ok)), reading.age_s];
        for (part, value) in parts.into_iter().enumerate() {
            if let Some(slot) = self.place(part * inputs + input) {
                *slot = value;
            }
        }
        if let Some(known) = self.sources.get_mut(input) {
            *known = source;
        }
        true
    }

    /// Gives an input a fresh and good sample that stems from `source_ns`: when the oldest sample that
    /// it was computed from was published, or it itself; otherwise as [`read_input`](Self::read_input).
    pub fn set_input(&mut self, input: usize, sample: f64, source_ns: u64) -> bool {
        let (flags, age_s) = (Flags::NONE, 0.0);
        self.read_input(input, &InputReading { value: sample, ok: true, age_s, source_ns, flags })
    }

    /// As [`set_input`](Self::set_input), for a sample that was set by hand at `now_ns`.
    fn give_input(&mut self, input: usize, value: f64, now_ns: u64) {
        if let Some(known) = self.inputs.get_mut(input) {
            known.given = Some(GivenSample { value, source_ns: now_ns });
        }
        self.set_input(input, value, now_ns);
    }

    /// Gives a variable, by its index in the plan, a value from the next step on. An operator's value comes with an
    /// order instead.
    pub fn give_variable(&mut self, variable: usize, value: f64) {
        let slot = InputPart::ALL.len() * self.inputs.len() + variable;
        if let Some(place) = self.place(slot) {
            *place = value;
        }
    }

    /// Takes the value that an operator set an input to; `None`: none since the last call.
    pub fn take_given(&mut self, input: usize) -> Option<GivenSample> {
        self.inputs.get_mut(input)?.given.take()
    }

    /// Copies an output's signals, by its index in the plan, into a frame.
    pub fn read_output(&self, output: usize, frame: &mut [f64]) {
        let slots = self.outputs.get(output).map_or(&[][..], |output| &output.slots);
        for (value, slot) in frame.iter_mut().zip(slots) {
            *value = read(&self.image, *slot);
        }
    }

    /// When the oldest sample that an output is computed from was published, in this node or in one
    /// before it; 0: from none.
    pub fn output_source_ns(&self, output: usize) -> u64 {
        self.output_worth(output).source_ns
    }

    /// The flags of an output after a step: those of all sources that it is computed from, `ERROR` if one of the
    /// blocks that it is computed by reports an error, and `FORCED` if a force acts on it.
    pub fn output_flags(&self, output: usize) -> Flags {
        self.output_worth(output).flags
    }

    fn output_worth(&self, output: usize) -> Source {
        let worth = Worth {
            sources: &self.sources,
            bank_errors: self.has_errors.then_some(&*self.bank_errors),
            image: &self.image,
        };
        let Some(found) = self.outputs.get(output) else { return Source::CONSTANT };
        let Source { source_ns, flags } = worth.of(&found.origins);
        Source { source_ns, flags: flags | self.forces.flags(output) }
    }

    /// How many steps of blocks have reported an error since the start.
    pub fn block_errors(&self) -> u64 {
        self.block_errors
    }

    /// The bank, by its index in the plan, whose step did not return: the one with the block that
    /// panicked. `None` between steps.
    pub fn stepping(&self) -> Option<usize> {
        self.bank_errors.iter().position(|errors| *errors == STEPPING)
    }

    /// Whether a force holds one of these slots.
    pub fn is_forced(&self, slots: &Range<usize>) -> bool {
        self.forces.holds_any(slots)
    }

    /// The process image.
    pub fn image(&self) -> &[f64] {
        &self.image
    }

    /// The blocks' private state. Image and state together are all that the next cycle depends on.
    pub fn state(&self) -> &[u64] {
        &self.state
    }
}

/// Steps banks in order; returns how many instances reported an error. `hold` is called with the first slot and the
/// slots of each bank, after its wires were copied and again after it has stepped.
#[inline(always)]
fn step_banks(
    banks: &[Bank],
    image: &mut [f64],
    mut state: &mut [u64],
    bank_errors: &mut [u64],
    cycle: &Cycle<'_>,
    hold: impl Fn(usize, &mut [f64]),
) -> u64 {
    let mut all_errors = 0;
    for (bank, errors) in banks.iter().zip(bank_errors) {
        // Wires lead from banks of lower depth, which come before this one in the image.
        let (before, rest) = image.split_at_mut_checked(bank.first_slot).unwrap_or_default();
        let slots = rest.get_mut(..bank.slots).unwrap_or_default();
        let (words, later) = state.split_at_mut_checked(bank.state_words).unwrap_or_default();
        for wire in &bank.wires {
            if let Some(slot) = slots.get_mut(wire.to as usize) {
                *slot = read(before, wire.from);
            }
        }
        *errors = STEPPING;
        *errors = if let Stepping::Each = bank.stepping {
            hold(bank.first_slot, slots);
            bank.block_type.step_bank(slots, words, cycle)
        } else {
            bank.step(before, slots, words, cycle, &hold)
        };
        all_errors += *errors;
        hold(bank.first_slot, slots);
        state = later;
    }
    all_errors
}

impl Bank {
    // Not inlined: it would make the loop over banks of few instances slower.
    #[inline(never)]
    fn step(
        &self,
        before: &[f64],
        slots: &mut [f64],
        words: &mut [u64],
        cycle: &Cycle<'_>,
        hold: &impl Fn(usize, &mut [f64]),
    ) -> u64 {
        let feed = match &self.stepping {
            Stepping::Many(many) => many.copy_wires(&self.block_type, before, slots),
            Stepping::Each | Stepping::Alarms(_) => None,
        };
        hold(self.first_slot, slots);
        match &self.stepping {
            Stepping::Each => self.block_type.step_bank(slots, words, cycle),
            Stepping::Many(many) => many.step(&self.block_type, feed, slots, words, cycle),
            Stepping::Alarms(reads) => {
                step_alarms(before, reads, slots, words, cycle);
                0
            }
        }
    }
}

/// Stands for the errors of the bank that is being stepped.
const STEPPING: u64 = u64::MAX;

#[inline]
fn read(image: &[f64], slot: u32) -> f64 {
    image.get(slot as usize).copied().unwrap_or_default()
}
