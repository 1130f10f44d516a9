//! Whether the parts of a plan fit together, seen once before a task is stepped without looking.

use crate::plan::{BankPlan, LinkPlan, Plan, TaskPlan, Upstream};

/// Why a plan cannot be stepped. [`Plan::new`] makes none of that kind; one that was changed
/// afterwards may be.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// Something stands outside of a task's process image.
    #[error("task \"{task}\": {what} reaches to slot {slot}, but the process image has {slots}")]
    OutsideImage {
        /// Name of the task.
        task: String,
        /// What does.
        what: &'static str,
        /// The last slot that it needs.
        slot: usize,
        /// How many there are.
        slots: usize,
    },
    /// A bank shares slots with one before it, or a wire does not lead forward into its bank.
    #[error(
        "task \"{task}\": {what} of type {block_type} at slot {first_slot} does not stand behind what it reads"
    )]
    OutOfOrder {
        /// Name of the task.
        task: String,
        /// The bank, or a wire into it.
        what: &'static str,
        /// Type of the bank's blocks.
        block_type: &'static str,
        /// First slot of the bank.
        first_slot: usize,
    },
    /// A value is said to be computed from a source that the task does not have.
    #[error(
        "task \"{task}\": {what} is computed from source {source_index}, but there are {sources}"
    )]
    UnknownSource {
        /// Name of the task.
        task: String,
        /// What is.
        what: &'static str,
        /// The source.
        source_index: usize,
        /// How many there are.
        sources: usize,
    },
    /// A value is said to be computed by a block that the task does not have.
    #[error(
        "task \"{task}\": {what} is computed by instance {instance} of bank {bank}, which is not there"
    )]
    UnknownBlock {
        /// Name of the task.
        task: String,
        /// What is.
        what: &'static str,
        /// Index of the bank.
        bank: usize,
        /// Which of its instances.
        instance: usize,
    },
    /// A task has no period, so it has no cycles.
    #[error("task \"{task}\": its period is 0")]
    NoPeriod {
        /// Name of the task.
        task: String,
    },
    /// A task has a name that no thread can have.
    #[error("task {task:?}: its name contains a NUL character")]
    TaskName {
        /// Name of the task.
        task: String,
    },
    /// A link joins tasks that do not exist.
    #[error("a link leads from task {from} to task {to}, but there are {tasks} tasks")]
    UnknownTask {
        /// Index of the task that computes the values.
        from: usize,
        /// Index of the task that reads them.
        to: usize,
        /// How many there are.
        tasks: usize,
    },
}

/// Checks everything that stepping the plan takes for granted.
pub(crate) fn check(plan: &Plan) -> Result<(), BuildError> {
    plan.links.iter().try_for_each(|link| check_link(plan, link))?;
    for (index, task) in plan.tasks.iter().enumerate() {
        if task.settings.period_ns == 0 {
            return Err(BuildError::NoPeriod { task: task.name.clone() });
        }
        if task.name.contains('\0') {
            return Err(BuildError::TaskName { task: task.name.clone() });
        }
        let room = Room::of(plan, index, task);
        room.slots("an input", 0, task.input_slots())?;
        let mut free = 0;
        for bank in &task.banks {
            room.bank(bank, free)?;
            free = bank.first_slot + bank_slots(bank);
        }
        for wire in &task.previous {
            room.slots("a wire of the cycle before", wire.from as usize, 1)?;
            room.slots("a wire of the cycle before", wire.to as usize, 1)?;
        }
        for output in &task.outputs {
            for signal in &output.signals {
                room.slots("an output's signal", signal.slot, 1)?;
            }
            room.upstream("an output", &output.upstream)?;
        }
    }
    Ok(())
}

fn check_link(plan: &Plan, link: &LinkPlan) -> Result<(), BuildError> {
    let &LinkPlan { from, to, .. } = link;
    let (Some(producer), Some(reader)) = (plan.tasks.get(from), plan.tasks.get(to)) else {
        return Err(BuildError::UnknownTask { from, to, tasks: plan.tasks.len() });
    };
    let (producer, reader) = (Room::of(plan, from, producer), Room::of(plan, to, reader));
    for slot in &link.slots {
        producer.slots("a value for another task", *slot as usize, 1)?;
    }
    for upstream in &link.upstream {
        producer.upstream("a value for another task", upstream)?;
    }
    reader.slots("a value of another task", link.first_slot, link.slots.len())?;
    reader.imports(link.first_slot, link.slots.len())
}

fn bank_slots(bank: &BankPlan) -> usize {
    bank.instances.len() * bank.block_type.slots()
}

/// What a task has.
struct Room<'a> {
    task: &'a TaskPlan,
    /// Inputs and values of other tasks.
    sources: usize,
}

impl<'a> Room<'a> {
    fn of(plan: &Plan, index: usize, task: &'a TaskPlan) -> Self {
        let incoming = plan.links.iter().filter(|link| link.to == index);
        let imported: usize = incoming.map(|link| link.slots.len()).sum();
        Self { task, sources: task.inputs.len() + imported }
    }

    fn slots(&self, what: &'static str, first: usize, count: usize) -> Result<(), BuildError> {
        let (end, slots) = (first.saturating_add(count), self.task.image.len());
        if end <= slots {
            return Ok(());
        }
        let task = self.task.name.clone();
        Err(BuildError::OutsideImage { task, what, slot: end - 1, slots })
    }

    fn upstream(&self, what: &'static str, upstream: &Upstream) -> Result<(), BuildError> {
        let task = || self.task.name.clone();
        let unknown = upstream.sources.iter().find(|source| **source >= self.sources);
        if let Some(&source_index) = unknown {
            let (task, sources) = (task(), self.sources);
            return Err(BuildError::UnknownSource { task, what, source_index, sources });
        }
        for instances in &upstream.blocks {
            let bank = self.task.banks.get(instances.bank);
            let there = bank.map_or(0, |bank| bank.instances.len());
            if instances.range.end > there {
                let (bank, instance) = (instances.bank, instances.range.end - 1);
                return Err(BuildError::UnknownBlock { task: task(), what, bank, instance });
            }
        }
        Ok(())
    }

    /// What comes from other tasks stands behind the inputs, so that slots and sources have one order.
    fn imports(&self, first_slot: usize, values: usize) -> Result<(), BuildError> {
        let behind_inputs = first_slot.checked_sub(self.task.input_slots());
        let last = behind_inputs.map(|import| self.task.inputs.len() + import + values);
        if last.is_some_and(|last| last <= self.sources) {
            return Ok(());
        }
        let (task, sources) = (self.task.name.clone(), self.sources);
        let what = "a value of another task";
        Err(BuildError::UnknownSource { task, what, source_index: first_slot, sources })
    }

    /// A bank whose slots begin at `free` or behind it.
    fn bank(&self, bank: &BankPlan, free: usize) -> Result<(), BuildError> {
        let first_slot = bank.first_slot;
        let out_of_order = |what| BuildError::OutOfOrder {
            task: self.task.name.clone(),
            what,
            block_type: bank.block_type.name,
            first_slot,
        };
        if first_slot < free {
            return Err(out_of_order("a bank"));
        }
        self.slots("a bank", first_slot, bank_slots(bank))?;
        let slots = first_slot..first_slot + bank_slots(bank);
        let forward = bank
            .wires
            .iter()
            .all(|wire| (wire.from as usize) < first_slot && slots.contains(&(wire.to as usize)));
        if forward { Ok(()) } else { Err(out_of_order("a wire into a bank")) }
    }
}

isochrone_model::debug_as_display!(BuildError);
