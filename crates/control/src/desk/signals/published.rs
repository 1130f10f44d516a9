//! The values that a task publishes.

use isochrone_engine::Plan;

/// The values that a task publishes: its outputs, then its values for other tasks, in the order of the plan.
#[derive(Debug)]
pub(crate) struct Published {
    /// For each published signal its slot, and the index of its output or value for another task.
    pub(crate) slots: Box<[(u32, u32)]>,
}

impl Published {
    pub(super) fn of(plan: &Plan, task: usize) -> Self {
        let outputs = plan.tasks.get(task).map_or(&[][..], |task| &task.outputs);
        let signals = outputs.iter().enumerate().flat_map(|(output, plan)| {
            plan.signals.iter().map(move |signal| (signal.slot as u32, output as u32))
        });
        let links = plan.links.iter().filter(|link| link.from == task);
        let values = links.flat_map(|link| &link.slots);
        let values = values.zip(outputs.len() as u32..).map(|(slot, value)| (*slot, value));
        Self { slots: signals.chain(values).collect() }
    }
}
