//! What the slots of a task's image hold, and what the file says of it.

use isochrone_blocks::Pin;

use super::labels::announced;
use super::{BlockLabels, InputPart, InputPlan, Plan, VariablePlan};

/// What a slot holds.
enum Held<'a> {
    Input(&'a InputPlan, InputPart),
    Variable(&'a VariablePlan),
    /// A pin of an instance, and its index among the inputs, then the outputs, of its type.
    Pin(&'a str, usize, &'a Pin),
}

impl Plan {
    /// The output pin, input or variable that a slot of a task's image holds, as a wire would name it, or the
    /// input pin that it belongs to.
    pub fn slot_name(&self, task: usize, slot: usize) -> String {
        match self.held(task, slot) {
            Some(Held::Input(input, part)) => format!("{}{}", input.name, part.suffix()),
            Some(Held::Variable(variable)) => variable.name.clone(),
            Some(Held::Pin(instance, _, pin)) => format!("{instance}.{}", pin.name),
            None => String::new(),
        }
    }

    /// The unit of what a slot of a task's image holds; empty for none, and for a TIME, which is shown with its own.
    pub fn slot_unit(&self, task: usize, slot: usize) -> &str {
        match self.held(task, slot) {
            Some(Held::Input(input, InputPart::Value)) => &input.unit,
            Some(Held::Input(_, InputPart::Age)) => "s",
            Some(Held::Input(_, InputPart::Ok)) | None => "",
            Some(Held::Variable(variable)) => &variable.unit,
            Some(Held::Pin(instance, index, pin)) => {
                let given =
                    self.labels(instance).map(|labels: &BlockLabels| labels.unit(index, pin));
                announced(pin.pin_type, given.unwrap_or(pin.unit))
            }
        }
    }

    /// What the file says of the block that an instance belongs to.
    pub fn labels(&self, instance: &str) -> Option<&BlockLabels> {
        let block = instance.split_once('.').map_or(instance, |(block, _)| block);
        self.block_labels.get(block)
    }

    fn held(&self, task: usize, slot: usize) -> Option<Held<'_>> {
        let plan = self.tasks.get(task)?;
        if let Some((input, part)) = plan.input_at(slot) {
            return Some(Held::Input(plan.inputs.get(input)?, part));
        }
        if let Some(variable) = plan.variable_at(slot) {
            return Some(Held::Variable(variable));
        }
        let bank = plan.banks.partition_point(|bank| bank.first_slot <= slot);
        if let Some(bank) = bank.checked_sub(1).and_then(|bank| plan.banks.get(bank)) {
            let (stride, offset) = (bank.block_type.slots(), slot - bank.first_slot);
            let mut pins = bank.block_type.inputs.iter().chain(bank.block_type.outputs);
            let (index, instance) = (offset % stride, bank.instances.get(offset / stride)?);
            return Some(Held::Pin(instance, index, pins.nth(index)?));
        }
        let link = self.links.iter().rfind(|link| link.to == task && link.first_slot <= slot)?;
        let from = *link.slots.get(slot - link.first_slot)?;
        self.held(link.from, from as usize)
    }
}
