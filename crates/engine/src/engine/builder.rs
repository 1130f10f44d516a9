//! The engines of a plan's tasks, and the buffers that join them.

use isochrone_blocks::alarm::AlarmReads;
use triple_buffer::TripleBuffer;

use super::parcel::{NO_CYCLE, Parcel, Stamp};
use super::{Bank, Export, Import, Input, Many, Output, Stepping, TaskEngine, read};
use crate::build::{self, BuildError};
use crate::orders::Forces;
use crate::plan::{BankPlan, Plan, TaskPlan, WirePlan};
use crate::worth::{Origins, Source};

impl TaskEngine {
    /// Builds the engines of a plan's tasks, in the plan's order, joined by wait-free buffers.
    ///
    /// # Errors
    /// Parts of the plan do not fit together, which cannot happen with an unchanged plan of [`Plan::new`].
    pub fn build(plan: &Plan) -> Result<Vec<Self>, BuildError> {
        build::check(plan)?;
        let mut engines: Vec<_> =
            plan.tasks.iter().map(|task| Builder::new(task, plan.obs.clone())).collect();
        for link in &plan.links {
            // Until the producer has finished a cycle, its inputs read their defaults here too.
            let image = plan.tasks.get(link.from).map_or(&[][..], |from| &from.image);
            let values: Box<[f64]> = link.slots.iter().map(|slot| read(image, *slot)).collect();
            let sources = vec![Source::UNKNOWN; link.slots.len()].into();
            let stamp = Stamp { cycle: NO_CYCLE, changes: 0 };
            let parcel = Parcel { stamp, values: values.clone(), sources };
            let (sender, receiver) = TripleBuffer::new(&parcel).split();
            if let Some(from) = engines.get_mut(link.from) {
                let origins = link.upstream.iter();
                from.exports.push(Export {
                    to: link.to,
                    slots: link.slots.as_slice().into(),
                    origins: origins.map(|upstream| Origins::of(upstream, from.task)).collect(),
                    sender,
                });
            }
            if let Some(to) = engines.get_mut(link.to) {
                to.initial.push((link.first_slot, values));
                to.imported += link.slots.len();
                to.imports.push(Import {
                    from: link.from,
                    stamp,
                    first_slot: link.first_slot,
                    first_source: to.task.import_source(link.first_slot),
                    receiver,
                });
            }
        }
        Ok(engines.into_iter().map(Builder::finish).collect())
    }
}

impl Bank {
    /// `delayed`: the slots that wires of the cycle before lead to, in ascending order.
    fn new(bank: &BankPlan, delayed: &[u32]) -> Self {
        let BankPlan { block_type, first_slot, instances, .. } = bank;
        let stride = block_type.slots();
        // The bank sees its own slots only, so its wires count from there.
        let own = |wire: &WirePlan| WirePlan { to: wire.to - *first_slot as u32, ..*wire };
        let mut wires: Vec<WirePlan> = bank.wires.iter().map(own).collect();
        let slots = instances.len() * stride;
        let stepping = if block_type.reads_in_place() {
            let mut alarms = vec![AlarmReads::default(); instances.len()];
            wires.retain(|wire| {
                let (alarm, pin) = (wire.to as usize / stride, wire.to as usize % stride);
                !alarms.get_mut(alarm).is_some_and(|reads| reads.take(pin, wire.from))
            });
            Stepping::Alarms(alarms.into())
        } else {
            let first = delayed.partition_point(|to| (*to as usize) < *first_slot);
            let delayed = delayed.iter().skip(first).map(|to| *to as usize - first_slot);
            let delayed = delayed.take_while(|slot| *slot < slots);
            let many = Many::of(block_type, instances.len(), &mut wires, delayed);
            many.map_or(Stepping::Each, |many| Stepping::Many(many.into()))
        };
        Self {
            block_type: *block_type,
            first_slot: *first_slot,
            slots,
            state_words: instances.len() * block_type.state_words,
            wires: wires.into(),
            stepping,
        }
    }
}

/// An engine whose links are being connected.
struct Builder<'a> {
    task: &'a TaskPlan,
    obs: Vec<(i16, u64)>,
    imports: Vec<Import>,
    imported: usize,
    exports: Vec<Export>,
    /// First slots and initial values of the links.
    initial: Vec<(usize, Box<[f64]>)>,
}

impl<'a> Builder<'a> {
    fn new(task: &'a TaskPlan, obs: Vec<(i16, u64)>) -> Self {
        let (imports, exports, initial) = (Vec::new(), Vec::new(), Vec::new());
        Self { task, obs, imports, imported: 0, exports, initial }
    }

    fn finish(self) -> TaskEngine {
        let task = self.task;
        let mut delayed: Vec<u32> = task.previous.iter().map(|wire| wire.to).collect();
        delayed.sort_unstable();
        let banks: Vec<Bank> = task.banks.iter().map(|bank| Bank::new(bank, &delayed)).collect();
        let inputs: Box<[Input]> = task
            .inputs
            .iter()
            .map(|input| Input {
                value_type: input.value_type,
                feedback: input.feedback,
                given: None,
            })
            .collect();
        let source = |input: &Input| {
            if input.feedback { Source::CONSTANT } else { Source::NO_SAMPLE }
        };
        let mut sources: Vec<Source> = inputs.iter().map(source).collect();
        sources.resize(inputs.len() + self.imported, Source::UNKNOWN);
        let values: usize = self.exports.iter().map(|export| export.slots.len()).sum();
        let given = task.outputs.len() + values;
        let mut image: Box<[f64]> = task.image.as_slice().into();
        for (first_slot, values) in &self.initial {
            let slots = image.get_mut(*first_slot..).unwrap_or_default();
            slots.iter_mut().zip(values).for_each(|(slot, value)| *slot = *value);
        }
        let mut engine = TaskEngine {
            period_ns: task.settings.period_ns,
            obs: self.obs.into(),
            image,
            state: vec![0; banks.iter().map(|bank| bank.state_words).sum()].into(),
            sources: sources.into(),
            inputs,
            imports: self.imports.into(),
            previous: task.previous.as_slice().into(),
            bank_errors: vec![0; banks.len()].into(),
            banks: banks.into(),
            exports: self.exports.into(),
            outputs: task
                .outputs
                .iter()
                .map(|output| Output {
                    slots: output.signals.iter().map(|signal| signal.slot as u32).collect(),
                    origins: Origins::of(&output.upstream, task),
                })
                .collect(),
            has_errors: false,
            forces: Forces::new(given),
            block_errors: 0,
            changes: 0,
            cycle: NO_CYCLE,
            entries: 0,
            unchecked: 0,
            next_checked: 0,
        };
        engine.check_sharing();
        engine
    }
}
