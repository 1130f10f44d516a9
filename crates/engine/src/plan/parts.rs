//! The parts of a plan: tasks with their inputs, outputs, blocks and wires, and links between them.

use std::sync::Arc;

use isochrone_blocks::{BlockType, PinType};
use isochrone_model::AlarmSeverity;

use crate::TaskSettings;
use crate::config::{AlarmSection, Bad, Binding, OnStale};

/// Bounds of parameters and variables that are set or forced.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LimitPlan {
    /// Name of a parameter or a variable, or a pattern of such names.
    pub names: String,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// One task: when it runs, and its process image.
#[derive(Debug)]
#[non_exhaustive]
pub struct TaskPlan {
    /// Unique name.
    pub name: String,
    /// All else that the configuration says of it, and what was chosen for it.
    pub settings: TaskSettings,
    /// Its inputs, which stand first in the image: their values, then their `ok`, then their `age`.
    pub inputs: Vec<InputPlan>,
    /// Its variables, which stand behind the inputs.
    pub variables: Vec<VariablePlan>,
    /// Its outputs in file order.
    pub outputs: Vec<OutputPlan>,
    /// Its blocks in the order in which they step.
    pub banks: Vec<BankPlan>,
    /// Its process alarms in file order. Each is an instance of a bank, too.
    pub alarms: Vec<AlarmPlan>,
    /// Copies of values of the cycle before, done before any block steps.
    pub previous: Vec<WirePlan>,
    /// The image before the first cycle: constants, defaults and initial values.
    pub image: Vec<f64>,
}

/// One value that another process publishes.
#[derive(Clone, Debug, PartialEq)]
pub struct InputPlan {
    /// Unique name.
    pub name: String,
    /// Type of its samples.
    pub value_type: PinType,
    /// Service that carries it; needed only to run.
    pub service: Option<String>,
    /// Where it is in the service's frame.
    pub binding: Binding,
    /// Value before the first sample.
    pub default: f64,
    /// Smallest and largest sample that it takes from its service.
    pub range: Option<(f64, f64)>,
    /// It takes neither NaN nor infinity from its service.
    pub finite: bool,
    /// Age in nanoseconds beyond which it is stale.
    pub max_age_ns: Option<u64>,
    /// Its value when it is stale.
    pub on_stale: OnStale,
    /// How frames with doubtful flags are treated.
    pub bad: Bad,
    /// It closes a loop of nodes, so the quality of its samples is not passed on.
    pub feedback: bool,
    /// Unit of its value; empty: the announced one.
    pub unit: String,
    /// What it is, for people; empty without one.
    pub comment: String,
    /// Place of its name in the file, for errors that only running can find.
    pub span: std::ops::Range<usize>,
}

/// One value that operators give.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct VariablePlan {
    /// Unique name.
    pub name: String,
    /// Its type.
    pub value_type: PinType,
    /// Value until an operator sets another.
    pub initial: f64,
    /// Its unit; empty for none.
    pub unit: String,
    /// What it is for, for people; empty without one.
    pub comment: String,
}

/// A condition that people should know of.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct AlarmPlan {
    /// Unique name.
    pub name: String,
    /// Its condition, as it is written.
    pub when: String,
    /// For how long the condition must hold.
    pub delay_ns: u64,
    /// How far the signal must come back before the alarm is over.
    pub hysteresis: f64,
    /// What it asks of people.
    pub severity: AlarmSeverity,
    /// What it says to people.
    pub text: String,
    /// The signal that its condition names first.
    pub signal: String,
    /// Type of that.
    pub value_type: PinType,
    /// The slot of that.
    pub value_slot: usize,
    /// First slot of its instance.
    pub first_slot: usize,
    active_slot: usize,
}

impl AlarmPlan {
    /// The alarm of a section that could be read, with the type and the slot of the signal that it names first, and the
    /// first slots of its instance and of that one's outputs.
    pub(super) fn of(
        alarm: &AlarmSection,
        (value_type, value_slot): (PinType, usize),
        [first_slot, active_slot]: [usize; 2],
    ) -> Option<Self> {
        let written = alarm.when.as_ref()?;
        let when = written.text.as_ref()?.as_str().trim();
        Some(Self {
            name: alarm.name.as_ref().map_or_else(String::new, |name| name.get_ref().clone()),
            when: when.to_owned(),
            delay_ns: alarm.delay_ns,
            hysteresis: alarm.hysteresis,
            severity: alarm.severity,
            text: alarm.text.clone().unwrap_or_else(|| when.to_owned()),
            signal: written.names.first()?.get_ref().clone(),
            value_type,
            value_slot,
            first_slot,
            active_slot,
        })
    }

    /// The slot of `NAME.active`.
    pub const fn active_slot(&self) -> usize {
        self.active_slot
    }

    /// The slot of `NAME.ok`.
    pub const fn ok_slot(&self) -> usize {
        self.active_slot + 1
    }

    /// Whether another alarm of this name is the same one: its state then goes on when the configuration changes.
    pub fn has_definition_of(&self, other: &Self) -> bool {
        (&self.name, &self.when, self.delay_ns, self.hysteresis.to_bits())
            == (&other.name, &other.when, other.delay_ns, other.hysteresis.to_bits())
    }
}

/// One frame that the node publishes every cycle of the task.
#[derive(Debug)]
#[non_exhaustive]
pub struct OutputPlan {
    /// Its place among the outputs of the file, from 0.
    pub position: usize,
    /// Service that carries it.
    pub service: String,
    /// Its channels.
    pub signals: Vec<SignalPlan>,
    /// How many readers the service is to have places for, if the file says so.
    pub readers: Option<usize>,
    /// What it is for, for people; empty without one.
    pub comment: String,
    /// What it is computed from.
    pub upstream: Upstream,
}

/// What values are computed from, within their task.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Upstream {
    /// The task's inputs by their index, and behind them the values of its incoming links, in the
    /// order of the image.
    pub sources: Vec<usize>,
    /// Blocks.
    pub blocks: Vec<Instances>,
}

/// Some of a bank's instances, one after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instances {
    /// Index of the bank in the task.
    pub bank: usize,
    /// Which of the bank's instances.
    pub range: std::ops::Range<usize>,
}

/// One channel of a frame.
#[derive(Debug)]
#[non_exhaustive]
pub struct SignalPlan {
    /// As written: `block.pin`.
    pub name: String,
    /// Type of the value.
    pub value_type: PinType,
    /// Its unit; empty for none.
    pub unit: String,
    /// Where it stands in the image.
    pub slot: usize,
}

/// Instances of one type at one depth, which step in one loop.
#[derive(Debug)]
#[non_exhaustive]
pub struct BankPlan {
    /// Their type.
    pub block_type: BlockType,
    /// Longest path of wires that leads here.
    pub depth: usize,
    /// First slot of the first instance.
    pub first_slot: usize,
    /// Their names, in order.
    pub instances: Arc<[String]>,
    /// Copies into the bank's slots, done before it steps.
    pub wires: Vec<WirePlan>,
}

/// Most blocks of a bank that a message names.
const MOST_NAMED: usize = 8;

impl BankPlan {
    /// Its blocks, for a message that cannot say which of them it is about: `"first" or "second" (Pid)`.
    pub fn any_block(&self) -> String {
        let mut names: Vec<_> =
            self.instances.iter().take(MOST_NAMED).map(|name| format!("\"{name}\"")).collect();
        let others = self.instances.len() - names.len();
        if others > 0 {
            names.push(format!("{others} more"));
        }
        format!("{} ({})", names.join(" or "), self.block_type.name)
    }
}

/// A copy of one slot of the image to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WirePlan {
    /// Slot to copy from.
    pub from: u32,
    /// Slot to copy to.
    pub to: u32,
}

/// Values that one task hands to another after each of its cycles.
#[derive(Debug)]
#[non_exhaustive]
pub struct LinkPlan {
    /// Index of the task that computes them.
    pub from: usize,
    /// Index of the task that reads them.
    pub to: usize,
    /// Their slots in the image of the first.
    pub slots: Vec<u32>,
    /// Their first slot in the image of the second; the others follow.
    pub first_slot: usize,
    /// For each of them what it is computed from in the first task.
    pub upstream: Vec<Upstream>,
}

/// What an input brings: its value, and what that is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum InputPart {
    /// What it reads, of its own type.
    Value,
    /// `NAME.ok`, a BOOL: whether that is a sample, fresh and good.
    Ok,
    /// `NAME.age`, an LREAL: how old the sample is, in seconds.
    Age,
}

impl InputPart {
    /// All parts, in the order in which they stand in an image.
    pub const ALL: [Self; 3] = [Self::Value, Self::Ok, Self::Age];

    /// What stands behind the input's name: nothing, `.ok` or `.age`.
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::Value => "",
            Self::Ok => ".ok",
            Self::Age => ".age",
        }
    }

    /// Its type, where the input is of `value_type`.
    pub const fn pin_type(self, value_type: PinType) -> PinType {
        match self {
            Self::Value => value_type,
            Self::Ok => PinType::Bool,
            Self::Age => PinType::Lreal,
        }
    }
}

impl TaskPlan {
    /// The banks of its blocks, without those of its alarms.
    pub fn block_banks(&self) -> impl Iterator<Item = &BankPlan> {
        self.banks.iter().filter(|bank| !bank.block_type.is_alarm())
    }

    /// The alarm of whose instance this slot is.
    pub fn alarm_at(&self, slot: usize) -> Option<&str> {
        let banks = self.banks.iter().filter(|bank| bank.block_type.is_alarm());
        let number =
            |bank: &BankPlan| Some(slot.checked_sub(bank.first_slot)? / bank.block_type.slots());
        let mut found = banks.filter_map(|bank| bank.instances.get(number(bank)?));
        found.next().map(String::as_str)
    }

    /// Where a part of an input stands in the image.
    pub fn input_slot(&self, input: usize, part: InputPart) -> usize {
        part as usize * self.inputs.len() + input
    }

    /// Where a variable stands in the image.
    pub fn variable_slot(&self, variable: usize) -> usize {
        InputPart::ALL.len() * self.inputs.len() + variable
    }

    /// The first slot of what comes from other tasks.
    pub fn first_import(&self) -> usize {
        self.variable_slot(self.variables.len())
    }

    /// The variable that a slot holds, if it holds one.
    pub fn variable_at(&self, slot: usize) -> Option<&VariablePlan> {
        self.variables.get(slot.checked_sub(self.variable_slot(0))?)
    }

    /// The input and the part of it that a slot holds, if it holds one.
    pub fn input_at(&self, slot: usize) -> Option<(usize, InputPart)> {
        let input = slot.checked_rem(self.inputs.len())?;
        Some((input, *InputPart::ALL.get(slot / self.inputs.len())?))
    }

    /// Which of the task's sources a value from another task is, by its slot.
    pub(crate) fn import_source(&self, slot: usize) -> usize {
        slot - self.first_import() + self.inputs.len()
    }
}

impl LinkPlan {
    /// Whether the link writes a slot of its reader's image.
    pub fn carries_to(&self, slot: u32) -> bool {
        (self.first_slot..self.first_slot + self.slots.len()).contains(&(slot as usize))
    }
}
