//! Checks once whether the parts of a plan fit together, as stepping a task does not check.

use crate::plan::{BankPlan, LinkPlan, Plan, TaskPlan, Upstream};

/// Why a plan cannot be stepped: the parts that do not fit together. [`Plan::new`] makes no such plan, but one that
/// was changed afterwards may be.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct BuildError(String);

impl BuildError {
    fn of(task: &TaskPlan, what: std::fmt::Arguments<'_>) -> Self {
        Self(format!("task {:?}: {what}", task.name))
    }
}

/// Checks everything that stepping relies on.
pub(crate) fn check(plan: &Plan) -> Result<(), BuildError> {
    plan.links.iter().try_for_each(|link| check_link(plan, link))?;
    for (index, task) in plan.tasks.iter().enumerate() {
        if task.settings.period_ns == 0 {
            return Err(BuildError::of(task, format_args!("its period is 0")));
        }
        if task.name.contains('\0') {
            return Err(BuildError::of(task, format_args!("its name contains a NUL character")));
        }
        let room = Room::of(plan, index, task);
        room.slots("an input", 0, task.variable_slot(0))?;
        room.slots("a variable", task.variable_slot(0), task.variables.len())?;
        let mut free = task.first_import() + room.sources - task.inputs.len();
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
        let tasks = plan.tasks.len();
        return Err(BuildError(format!(
            "a link leads from task {from} to task {to}, but there are {tasks} tasks"
        )));
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

/// The sizes of a task's parts.
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

    fn refusal(&self, what: std::fmt::Arguments<'_>) -> BuildError {
        BuildError::of(self.task, what)
    }

    fn unknown_source(&self, what: &str, source: usize) -> BuildError {
        let sources = self.sources;
        self.refusal(format_args!(
            "{what} is computed from source {source}, but there are {sources}"
        ))
    }

    fn slots(&self, what: &str, first: usize, count: usize) -> Result<(), BuildError> {
        let (end, slots) = (first.saturating_add(count), self.task.image.len());
        if end <= slots {
            return Ok(());
        }
        let slot = end - 1;
        Err(self.refusal(format_args!(
            "{what} reaches to slot {slot}, but the process image has {slots}"
        )))
    }

    fn upstream(&self, what: &str, upstream: &Upstream) -> Result<(), BuildError> {
        let unknown = upstream.sources.iter().find(|source| **source >= self.sources);
        if let Some(&source_index) = unknown {
            return Err(self.unknown_source(what, source_index));
        }
        for instances in &upstream.blocks {
            let bank = self.task.banks.get(instances.bank);
            let there = bank.map_or(0, |bank| bank.instances.len());
            if instances.range.end > there {
                let (bank, instance) = (instances.bank, instances.range.end - 1);
                return Err(self.refusal(format_args!(
                    "{what} is computed by instance {instance} of bank {bank}, which is not there"
                )));
            }
        }
        Ok(())
    }

    /// Values from other tasks come after the inputs and variables, so that slots and sources have the same order.
    fn imports(&self, first_slot: usize, values: usize) -> Result<(), BuildError> {
        let place = first_slot.checked_sub(self.task.first_import());
        let last = place.map(|import| self.task.inputs.len() + import + values);
        if last.is_some_and(|last| last <= self.sources) {
            return Ok(());
        }
        Err(self.unknown_source("a value of another task", first_slot))
    }

    /// A bank whose slots begin at `free` or behind it.
    fn bank(&self, bank: &BankPlan, free: usize) -> Result<(), BuildError> {
        let first_slot = bank.first_slot;
        let out_of_order = |what| {
            let name = bank.block_type.name;
            self.refusal(format_args!(
                "{what} of type {name} at slot {first_slot} does not stand behind what it reads"
            ))
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
