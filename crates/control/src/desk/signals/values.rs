//! Inputs and variables: the signals that are of no block.

use isochrone_engine::InputPart;
use isochrone_model::Role;

use super::{Signal, Signals, Task, Variable};

impl Signals {
    /// The task and the slot of the input or the variable of a name.
    pub(super) fn value(&self, name: &str) -> Option<(usize, usize)> {
        let found = self.values.binary_search_by(|value| self.value_name(value).cmp(&Some(name)));
        let (task, slot) = self.values.get(found.ok()?)?;
        Some((*task as usize, *slot as usize))
    }

    pub(super) fn value_name(&self, (task, slot): &(u32, u32)) -> Option<&str> {
        self.tasks.get(*task as usize)?.value_name(*slot as usize)
    }

    /// Whether a slot holds a variable.
    pub(in crate::desk) fn is_variable(&self, task: usize, slot: usize) -> bool {
        self.tasks.get(task).is_some_and(|task| task.variable_at(slot).is_some())
    }

    /// What is said of the input of a name: its `ok` or its `age`.
    pub(super) fn part_of_input(&self, name: &str, part: &str) -> Option<Signal<'_>> {
        let (task, slot) = self.value(name)?;
        let inputs = self.tasks.get(task)?.inputs.len();
        let is_meant = |known: &InputPart| known.suffix().strip_prefix('.') == Some(part);
        let part = InputPart::ALL.into_iter().find(is_meant)?;
        (slot < inputs).then(|| self.at(task, part as usize * inputs + slot))?
    }
}

impl Task {
    /// The first slot behind the inputs and what is said of them.
    pub(super) fn first_variable(&self) -> usize {
        InputPart::ALL.len() * self.inputs.len()
    }

    /// The first slot of what comes from other tasks.
    pub(super) fn first_import(&self) -> usize {
        self.first_variable() + self.variables.len()
    }

    pub(super) fn variable_at(&self, slot: usize) -> Option<&Variable> {
        self.variables.get(slot.checked_sub(self.first_variable())?)
    }

    /// The name of the input or the variable whose value a slot holds.
    pub(super) fn value_name(&self, slot: usize) -> Option<&str> {
        let input = self.inputs.get(slot).map(|input| &*input.name);
        input.or_else(|| Some(&*self.variable_at(slot)?.name))
    }

    /// The signal of a slot that holds a variable, an input, or what is said of one. `task` is the index of this
    /// task.
    pub(super) fn value_at(&self, task: usize, slot: usize) -> Option<Signal<'_>> {
        if let Some(variable) = self.variable_at(slot) {
            return Some(Signal {
                name: variable.name.to_string(),
                task,
                slot,
                value_type: variable.value_type,
                role: Role::Variable,
                unit: &variable.unit,
                comment: &variable.comment,
                doc: "Value that operators give.",
                service: None,
                can_be_unset: false,
            });
        }
        let inputs = self.inputs.len();
        let part = *InputPart::ALL.get(slot.checked_div(inputs)?)?;
        let input = self.inputs.get(slot % inputs)?;
        let (role, unit, doc) = match part {
            InputPart::Value => {
                (Role::Input, &*input.unit, "Value that another process publishes.")
            }
            InputPart::Ok => (Role::Ok, "", "Whether the input's value is fresh and good."),
            InputPart::Age => (Role::Age, "s", "Age of the input's sample at the cycle's start."),
        };
        Some(Signal {
            name: format!("{}{}", input.name, part.suffix()),
            task,
            slot,
            value_type: part.pin_type(input.value_type),
            role,
            unit,
            comment: if part == InputPart::Value { &input.comment } else { "" },
            doc,
            service: input.service.as_deref(),
            can_be_unset: false,
        })
    }
}
