//! A node's values by name, for those who set them while it runs.

use std::sync::Arc;

use isochrone_blocks::{BlockType, PinType};

use crate::nearest::Known;
use crate::plan::{BankPlan, Plan, WirePlan};

/// The input pins and inputs of a node, by name.
#[derive(Debug)]
pub struct Pins {
    tasks: Vec<TaskPins>,
}

#[derive(Debug)]
struct TaskPins {
    inputs: Vec<Input>,
    banks: Vec<Bank>,
}

#[derive(Debug)]
struct Input {
    name: String,
    value_type: PinType,
    service: Option<String>,
}

#[derive(Debug)]
struct Bank {
    block_type: BlockType,
    first_slot: usize,
    instances: Arc<[String]>,
    wires: Vec<WirePlan>,
}

/// A value that can be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetPoint<'a> {
    /// Index of its task.
    pub task: usize,
    /// Its slot in the task's image; an input's is its index.
    pub slot: usize,
    /// Its type.
    pub value_type: PinType,
    /// The service that an input is read from, if it names one; none for a pin.
    pub service: Option<&'a str>,
}

/// Why a value cannot be set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PinError {
    /// There is no such input and no such pin.
    #[error("there is no input pin or input \"{name}\"; {suggestion}")]
    Unknown {
        /// The name.
        name: String,
        /// A name that is near, or those that there are.
        suggestion: String,
    },
    /// It is an output pin, which its block computes.
    #[error("\"{name}\" is an output pin, which its block computes; set an input pin")]
    Output {
        /// The name.
        name: String,
    },
    /// A wire feeds the pin in every cycle.
    #[error(
        "\"{name}\" is wired to \"{source_name}\", which would write over it; set what feeds that"
    )]
    Wired {
        /// The name.
        name: String,
        /// What feeds it.
        source_name: String,
    },
    /// The pin's type does not have the value.
    #[error("{value} is no {value_type}, which \"{name}\" needs{}", range(*value_type))]
    Value {
        /// The name.
        name: String,
        /// The value.
        value: f64,
        /// The pin's type.
        value_type: PinType,
    },
}

fn range(value_type: PinType) -> String {
    match value_type.range() {
        Some((min, max)) => format!(": a whole number from {min} to {max}"),
        None => ": a number".into(),
    }
}

impl Pins {
    /// The pins of a plan.
    pub fn of(plan: &Plan) -> Self {
        let bank = |bank: &BankPlan, previous: &[WirePlan]| {
            let slots = bank.block_type.slots() * bank.instances.len();
            let own = bank.first_slot..bank.first_slot + slots;
            let previous = previous.iter().filter(|wire| own.contains(&(wire.to as usize)));
            Bank {
                block_type: bank.block_type,
                first_slot: bank.first_slot,
                instances: bank.instances.clone(),
                wires: bank.wires.iter().chain(previous).copied().collect(),
            }
        };
        let tasks = plan.tasks.iter().map(|task| TaskPins {
            inputs: task
                .inputs
                .iter()
                .map(|input| Input {
                    name: input.name.clone(),
                    value_type: input.value_type,
                    service: input.service.clone(),
                })
                .collect(),
            banks: task.banks.iter().map(|plan| bank(plan, &task.previous)).collect(),
        });
        Self { tasks: tasks.collect() }
    }

    /// Finds the input or unwired input pin of a name, which `value` is to be written to.
    ///
    /// # Errors
    /// There is none, something else writes it, or its type does not have the value; NaN is no value.
    pub fn find(&self, name: &str, value: f64) -> Result<SetPoint<'_>, PinError> {
        let found = self.input(name).map_or_else(|| self.pin(name), Ok)?;
        if value.is_nan() || !found.value_type.holds(value) {
            let (name, value_type) = (name.to_owned(), found.value_type);
            return Err(PinError::Value { name, value, value_type });
        }
        Ok(found)
    }

    fn input(&self, name: &str) -> Option<SetPoint<'_>> {
        self.tasks.iter().enumerate().find_map(|(task, pins)| {
            let slot = pins.inputs.iter().position(|input| input.name == name)?;
            let input = pins.inputs.get(slot)?;
            let (value_type, service) = (input.value_type, input.service.as_deref());
            Some(SetPoint { task, slot, value_type, service })
        })
    }

    fn pin(&self, name: &str) -> Result<SetPoint<'_>, PinError> {
        let (instance, pin) = name.rsplit_once('.').unwrap_or((name, ""));
        let owned = || name.to_owned();
        let Some((task, bank, index)) = self.instance(instance) else {
            let inputs = self.tasks.iter().flat_map(|task| &task.inputs);
            let inputs = inputs.map(|input| input.name.as_str());
            let banks = self.tasks.iter().flat_map(|task| &task.banks);
            let blocks = banks.flat_map(|bank| bank.instances.iter().map(String::as_str));
            let suggestion = Known::new(inputs.chain(blocks)).suggestion(instance);
            return Err(PinError::Unknown { name: owned(), suggestion });
        };
        let pins = bank.block_type.inputs;
        let is_named =
            |known: &isochrone_blocks::Pin| known.name == pin || known.aliases.contains(&pin);
        let Some(position) = pins.iter().position(is_named) else {
            if bank.block_type.outputs.iter().any(is_named) {
                return Err(PinError::Output { name: owned() });
            }
            let suggestion = Known::new(pins.iter().map(|pin| pin.name)).suggestion(pin);
            return Err(PinError::Unknown { name: owned(), suggestion });
        };
        let slot = bank.first_slot + index * bank.block_type.slots() + position;
        if let Some(wire) = bank.wires.iter().find(|wire| wire.to as usize == slot) {
            let source_name = self.source_name(task, wire.from as usize);
            return Err(PinError::Wired { name: owned(), source_name });
        }
        let value_type = pins.get(position).map_or(PinType::Lreal, |pin| pin.pin_type);
        Ok(SetPoint { task, slot, value_type, service: None })
    }

    fn instance(&self, name: &str) -> Option<(usize, &Bank, usize)> {
        let banks = self.tasks.iter().enumerate();
        let mut banks = banks.flat_map(|(task, pins)| pins.banks.iter().map(move |b| (task, b)));
        banks.find_map(|(task, bank)| {
            let index = bank.instances.iter().position(|instance| instance == name)?;
            Some((task, bank, index))
        })
    }

    fn source_name(&self, task: usize, slot: usize) -> String {
        let Some(pins) = self.tasks.get(task) else { return String::new() };
        if let Some(input) = pins.inputs.get(slot) {
            return input.name.clone();
        }
        let found = pins.banks.iter().find_map(|bank| {
            let offset = slot.checked_sub(bank.first_slot)?;
            let instance = bank.instances.get(offset / bank.block_type.slots())?;
            let mut pins = bank.block_type.inputs.iter().chain(bank.block_type.outputs);
            let pin = pins.nth(offset % bank.block_type.slots())?;
            Some(format!("{instance}.{}", pin.name))
        });
        found.unwrap_or_else(|| "a block of another task".into())
    }
}
