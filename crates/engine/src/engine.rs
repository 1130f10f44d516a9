//! A task's process image and banks, and the call that steps them.

use isochrone_blocks::{BlockType, Cycle, PinType};
use triple_buffer::{Input as Sender, Output as Receiver, TripleBuffer};

use crate::build::{self, BuildError};
use crate::plan::{Plan, TaskPlan, WirePlan};

/// One task, ready to be stepped by the thread that owns it.
///
/// [`step`](Self::step) and everything that reads or writes values is for the real-time path: no
/// allocation, no lock, no system call, no panic.
pub struct TaskEngine {
    period_ns: u64,
    obs: Box<[(i16, u64)]>,
    image: Box<[f64]>,
    state: Box<[u64]>,
    inputs: Box<[Input]>,
    /// When the oldest sample behind each source's present value was published; 0: never. Inputs first, then the imported
    /// values, as in the image.
    sources_ns: Box<[u64]>,
    imports: Box<[Import]>,
    previous: Box<[WirePlan]>,
    banks: Box<[Bank]>,
    exports: Box<[Export]>,
    outputs: Box<[Output]>,
    block_errors: u64,
}

struct Input {
    value_type: PinType,
    default: f64,
}

/// A bank knows where its slots begin; they end where the next bank's begin.
struct Bank {
    block_type: BlockType,
    first_slot: usize,
    slots: usize,
    state_words: usize,
    wires: Box<[WirePlan]>,
}

struct Output {
    slots: Box<[u32]>,
    sources: Box<[usize]>,
}

/// Values on their way from one task to another.
#[derive(Clone)]
struct Parcel {
    values: Box<[f64]>,
    sources_ns: Box<[u64]>,
}

struct Export {
    slots: Box<[u32]>,
    /// For each value its sources.
    sources: Box<[Box<[usize]>]>,
    sender: Sender<Parcel>,
}

struct Import {
    /// First slot of the values, and first source of their times.
    first_slot: usize,
    receiver: Receiver<Parcel>,
}

impl TaskEngine {
    /// Builds the engines of a plan's tasks, in the plan's order, joined by wait-free buffers.
    ///
    /// # Errors
    /// Parts of the plan do not fit together, which one that [`Plan::new`] made always does.
    pub fn build(plan: &Plan) -> Result<Vec<Self>, BuildError> {
        build::check(plan)?;
        let mut engines: Vec<_> =
            plan.tasks.iter().map(|task| Builder::new(task, plan.obs.clone())).collect();
        for link in &plan.links {
            // Until the producer has finished a cycle, its inputs read their defaults here too.
            let image = plan.tasks.get(link.from).map_or(&[][..], |from| &from.image);
            let values = link.slots.iter().map(|slot| read(image, *slot)).collect();
            let sources_ns = vec![0; link.slots.len()].into();
            let (sender, receiver) = TripleBuffer::new(&Parcel { values, sources_ns }).split();
            if let Some(from) = engines.get_mut(link.from) {
                from.exports.push(Export {
                    slots: link.slots.as_slice().into(),
                    sources: link.sources.iter().map(|sources| sources.as_slice().into()).collect(),
                    sender,
                });
            }
            if let Some(to) = engines.get_mut(link.to) {
                to.imported += link.slots.len();
                to.imports.push(Import { first_slot: link.first_slot, receiver });
            }
        }
        Ok(engines.into_iter().map(Builder::finish).collect())
    }

    /// Steps every block of the task once. `cycle` is the index on the task's grid, skipped cycles
    /// included.
    ///
    /// Every slot that is looked up here is there: [`build`](Self::build) has seen to it.
    pub fn step(&mut self, cycle: u64) {
        let cycle = Cycle::new(cycle, self.period_ns, &self.obs);
        for import in &mut self.imports {
            let parcel = import.receiver.read();
            let slots = self.image.get_mut(import.first_slot..).unwrap_or_default();
            slots.iter_mut().zip(&parcel.values).for_each(|(slot, value)| *slot = *value);
            let sources_ns = self.sources_ns.get_mut(import.first_slot..).unwrap_or_default();
            sources_ns.iter_mut().zip(&parcel.sources_ns).for_each(|(to, from)| *to = *from);
        }
        for wire in &self.previous {
            let value = read(&self.image, wire.from);
            if let Some(slot) = self.image.get_mut(wire.to as usize) {
                *slot = value;
            }
        }
        let mut state = &mut *self.state;
        for bank in &self.banks {
            // Wires lead from banks of less depth, which stand before this one in the image.
            let (before, rest) =
                self.image.split_at_mut_checked(bank.first_slot).unwrap_or_default();
            let slots = rest.get_mut(..bank.slots).unwrap_or_default();
            let (words, later) = state.split_at_mut_checked(bank.state_words).unwrap_or_default();
            for wire in &bank.wires {
                if let Some(slot) = slots.get_mut(wire.to as usize) {
                    *slot = read(before, wire.from);
                }
            }
            self.block_errors += bank.block_type.step_bank(slots, words, &cycle);
            state = later;
        }
        for export in &mut self.exports {
            let parcel = export.sender.input_buffer_mut();
            for (value, slot) in parcel.values.iter_mut().zip(&export.slots) {
                *value = read(&self.image, *slot);
            }
            for (source_ns, sources) in parcel.sources_ns.iter_mut().zip(&export.sources) {
                *source_ns = oldest_ns(&self.sources_ns, sources);
            }
            export.sender.publish();
        }
    }

    /// Sets an input, by its index in the plan, to a sample that stems from `source_ns`: when the
    /// oldest sample that it was computed from was published, or it itself. `false`: its type cannot
    /// hold the sample, and the last good value stays.
    pub fn set_input(&mut self, input: usize, sample: f64, source_ns: u64) -> bool {
        let holds = self.inputs.get(input).is_some_and(|input| input.value_type.holds(sample));
        if holds {
            self.write_input(input, sample, source_ns);
        }
        holds
    }

    /// Sets an input back to its default, as if no sample had come yet.
    pub fn reset_input(&mut self, input: usize) {
        if let Some(default) = self.inputs.get(input).map(|input| input.default) {
            self.write_input(input, default, 0);
        }
    }

    /// Writes a set-point found by [`Pins`](crate::Pins) to its slot; an input's is from `source_ns`, as
    /// with [`set_input`](Self::set_input). A wire that leads to the slot writes over it.
    pub fn set(&mut self, slot: usize, value: f64, source_ns: u64) {
        if slot < self.inputs.len() {
            self.write_input(slot, value, source_ns);
        } else if let Some(place) = self.image.get_mut(slot) {
            *place = value;
        }
    }

    fn write_input(&mut self, input: usize, value: f64, source_ns: u64) {
        if let Some(slot) = self.image.get_mut(input) {
            *slot = value;
        }
        if let Some(source) = self.sources_ns.get_mut(input) {
            *source = source_ns;
        }
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
        let sources = self.outputs.get(output).map_or(&[][..], |output| &output.sources);
        oldest_ns(&self.sources_ns, sources)
    }

    /// How many steps of blocks have reported an error since the start.
    pub fn block_errors(&self) -> u64 {
        self.block_errors
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

#[inline]
fn read(image: &[f64], slot: u32) -> f64 {
    image.get(slot as usize).copied().unwrap_or_default()
}

fn oldest_ns(sources_ns: &[u64], sources: &[usize]) -> u64 {
    sources
        .iter()
        .filter_map(|source| sources_ns.get(*source).copied())
        .filter(|source_ns| *source_ns > 0)
        .min()
        .unwrap_or_default()
}

/// An engine whose links are being connected.
struct Builder<'a> {
    task: &'a TaskPlan,
    obs: Vec<(i16, u64)>,
    imports: Vec<Import>,
    imported: usize,
    exports: Vec<Export>,
}

impl<'a> Builder<'a> {
    fn new(task: &'a TaskPlan, obs: Vec<(i16, u64)>) -> Self {
        Self { task, obs, imports: Vec::new(), imported: 0, exports: Vec::new() }
    }

    fn finish(self) -> TaskEngine {
        let task = self.task;
        let banks: Vec<Bank> = task
            .banks
            .iter()
            .map(|bank| Bank {
                block_type: bank.block_type,
                first_slot: bank.first_slot,
                slots: bank.instances.len() * bank.block_type.slots(),
                state_words: bank.instances.len() * bank.block_type.state_words,
                // The bank sees its own slots only, so its wires count from there.
                wires: bank
                    .wires
                    .iter()
                    .map(|wire| WirePlan { to: wire.to - bank.first_slot as u32, ..*wire })
                    .collect(),
            })
            .collect();
        let inputs: Box<[Input]> = task
            .inputs
            .iter()
            .map(|input| Input { value_type: input.value_type, default: input.default })
            .collect();
        let imported = self.imported;
        TaskEngine {
            period_ns: task.schedule.period_ns,
            obs: self.obs.into(),
            image: task.image.as_slice().into(),
            state: vec![0; banks.iter().map(|bank| bank.state_words).sum()].into(),
            sources_ns: vec![0; inputs.len() + imported].into(),
            inputs,
            imports: self.imports.into(),
            previous: task.previous.as_slice().into(),
            banks: banks.into(),
            exports: self.exports.into(),
            outputs: task
                .outputs
                .iter()
                .map(|output| Output {
                    slots: output.signals.iter().map(|signal| signal.slot as u32).collect(),
                    sources: output.sources.as_slice().into(),
                })
                .collect(),
            block_errors: 0,
        }
    }
}
