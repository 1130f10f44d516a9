//! The one index of a node's names.

mod build;
mod kept;
mod matches;
mod published;
mod sources;
mod suggestions;
mod values;

use isochrone_blocks::{BlockType, Ob, Pin, PinDefault, PinType};
use isochrone_engine::{AlarmPlan, BlockLabels, WirePlan};
use isochrone_model::{Refusal, Role, Value};

pub(super) use kept::{ChangedPin, Kept};
pub use matches::Matches;
use published::Published;

/// Every name of a node: its meaning, and where its value is.
///
/// Consecutive instances are one entry, so the index of a million of them is small.
#[derive(Debug)]
pub struct Signals {
    tasks: Box<[Task]>,
    /// Inputs and variables by name: task and slot.
    values: Box<[(u32, u32)]>,
    /// Blocks by name.
    blocks: Box<[Block]>,
    /// In the order of the images.
    runs: Box<[Run]>,
}

#[derive(Debug)]
pub(super) struct Task {
    pub(super) name: String,
    /// Its OB number, if it has one.
    ob: Option<i16>,
    pub(super) period_ns: u64,
    inputs: Box<[Input]>,
    variables: Box<[Variable]>,
    /// In the order of the file.
    pub(super) alarms: Box<[AlarmPlan]>,
    pub(super) slots: usize,
    /// All wires, by the slot that they lead to.
    pub(super) wires: Box<[WirePlan]>,
    /// The slots that wires of the previous cycle lead to, in ascending order.
    delayed: Box<[u32]>,
    imports: Box<[Import]>,
    /// Slots of each output, then of each value for other tasks.
    pub(super) published: Published,
}

/// A value from another task.
#[derive(Debug)]
struct Import {
    first_slot: usize,
    /// The task, and the slots in its image.
    from: usize,
    slots: Box<[u32]>,
}

#[derive(Debug)]
struct Input {
    name: Box<str>,
    value_type: PinType,
    service: Option<Box<str>>,
    unit: Box<str>,
    comment: Box<str>,
}

#[derive(Debug)]
struct Variable {
    name: Box<str>,
    value_type: PinType,
    initial: f64,
    unit: Box<str>,
    comment: Box<str>,
}

/// The instances of one entry of the file.
#[derive(Debug)]
struct Block {
    name: Box<str>,
    runs: Vec<u32>,
    count: usize,
    labels: BlockLabels,
}

/// Instances of a block that follow each other in the image and have the same constants.
#[derive(Debug)]
struct Run {
    block: u32,
    task: u32,
    first_slot: usize,
    len: usize,
    /// Number of the first; `None` for a block without a `count`.
    number: Option<u32>,
    block_type: BlockType,
    /// The slots of its input pins as they were configured.
    constants: Box<[f64]>,
}

/// A named value of a node.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal<'a> {
    /// Its name, as a wire would refer to it.
    pub name: String,
    /// Index of its task.
    pub task: usize,
    /// Its slot in the task's image; an input's is its index.
    pub slot: usize,
    /// Its type.
    pub value_type: PinType,
    /// Its role for an operator.
    pub role: Role,
    /// Unit of its value, according to the configuration or else its block's type; empty: none is known.
    pub unit: &'a str,
    /// What the configuration says that it, or its block, is for; empty without a comment.
    pub comment: &'a str,
    /// What it means, in a sentence.
    pub doc: &'static str,
    /// The service that an input is read from, if it names one.
    pub service: Option<&'a str>,
    /// Whether it may also have no value, which is NaN: the pin then stands for the task that runs its block.
    pub can_be_unset: bool,
}

impl Signal<'_> {
    /// A value as its slot holds it; `None` if the signal cannot have the value.
    pub(super) fn slot_of(&self, value: Value) -> Option<f64> {
        match value {
            Value::Number(number) if number.is_nan() && self.can_be_unset => Some(f64::NAN),
            Value::CallingTask if self.can_be_unset => Some(Ob::Caller.slot()),
            Value::Task { period_ns } if self.can_be_unset => Some(Ob::Task { period_ns }.slot()),
            value => value.slot(self.value_type),
        }
    }
}

/// The configuration of an instance.
pub(super) struct Instance<'a> {
    pub(super) name: String,
    pub(super) block_type: &'a BlockType,
    pub(super) first_slot: usize,
    pub(super) constants: &'a [f64],
}

impl Signals {
    /// Number of tasks.
    pub fn tasks(&self) -> usize {
        self.tasks.len()
    }

    /// Number of instances of blocks.
    pub fn instances(&self) -> usize {
        self.blocks.iter().map(|block| block.count).sum()
    }

    /// Name of a task.
    pub fn task_name(&self, task: usize) -> &str {
        self.tasks.get(task).map_or("", |task| &task.name)
    }

    /// The name of the first task with this period.
    pub(super) fn task_of_period(&self, period_ns: u64) -> Option<&str> {
        let task = self.tasks.iter().find(|task| task.period_ns == period_ns);
        task.map(|task| task.name.as_str())
    }

    /// The value of a `callOB` that names a task: its number or, without one, its period.
    pub(super) fn task_value(&self, name: &str) -> Option<Value> {
        let Task { ob, period_ns, .. } = self.tasks.iter().find(|task| task.name == name)?;
        let period = Value::Task { period_ns: *period_ns };
        Some(ob.map_or(period, |ob| Value::Integer(ob.into())))
    }

    /// How many parameters a task has.
    pub fn parameters(&self, task: usize) -> usize {
        let Some(found) = self.tasks.get(task) else { return 0 };
        let runs = self.runs.iter().filter(|run| run.task as usize == task);
        let pins: usize = runs.map(|run| run.len * run.block_type.parameters().len()).sum();
        // A wire leads to one pin, and no two lead to the same.
        let is_of_signal = |wire: &&WirePlan| {
            let pin = self.pin_at(task, wire.to as usize);
            pin.is_some_and(|(run, ..)| !run.block_type.parameters().is_empty())
        };
        pins - found.wires.iter().filter(is_of_signal).count()
    }

    /// The index of the task with this name.
    pub(super) fn task_index(&self, name: &str) -> Option<usize> {
        self.tasks.iter().position(|task| task.name == name)
    }

    pub(super) fn task(&self, task: usize) -> Option<&Task> {
        self.tasks.get(task)
    }

    /// Looks up a name.
    ///
    /// # Errors
    /// There is no such signal; the help suggests one.
    pub fn find(&self, name: &str) -> Result<Signal<'_>, Refusal> {
        self.locate(name).ok_or_else(|| self.unknown(name))
    }

    /// As [`find`](Self::find), without a suggestion.
    pub(super) fn locate(&self, name: &str) -> Option<Signal<'_>> {
        if let Some((task, slot)) = self.value(name) {
            return self.at(task, slot);
        }
        let (owner, pin) = name.rsplit_once('.')?;
        if let Some((run, offset)) = self.instance(owner) {
            let is_named =
                |(_, known): &(usize, &Pin)| known.name == pin || known.aliases.contains(&pin);
            if let Some((pin, _)) = run.block_type.signals().find(is_named) {
                return self.at(run.task as usize, run.slot(offset, pin));
            }
        }
        self.part_of_input(owner, pin)
    }

    /// The signal of a slot of a task's image. `None`: it holds another task's value, what an alarm or an `Expr` reads, or
    /// nothing.
    pub fn at(&self, task: usize, slot: usize) -> Option<Signal<'_>> {
        let found = self.tasks.get(task)?;
        if slot < found.first_import() {
            return found.value_at(task, slot);
        }
        let (run, offset, index) = self.pin_at(task, slot)?;
        let (pin, role) = match run.block_type.inputs.get(index) {
            Some(_) if run.block_type.parameters().is_empty() => return None,
            Some(pin) if found.wire_to(slot).is_some() => (pin, Role::Wired),
            Some(pin) => (pin, Role::Parameter),
            None => {
                (run.block_type.outputs.get(index - run.block_type.inputs.len())?, Role::Output)
            }
        };
        let labels = &self.blocks.get(run.block as usize)?.labels;
        Some(Signal {
            name: format!("{}.{}", self.instance_name(run, offset), pin.name),
            task,
            slot,
            value_type: pin.pin_type,
            role,
            unit: labels.unit(index, pin),
            comment: &labels.comment,
            doc: pin.doc(),
            service: None,
            can_be_unset: pin.default == PinDefault::CallingTask,
        })
    }

    pub(super) fn is_wired(&self, task: usize, slot: usize) -> bool {
        self.tasks.get(task).is_some_and(|task| task.wire_to(slot).is_some())
    }

    /// The source of a wired pin, or the expression of an output that has one.
    pub(super) fn source_name(&self, task: usize, slot: usize) -> Option<String> {
        if let Some(wire) = self.tasks.get(task)?.wire_to(slot) {
            return Some(self.slot_name(task, wire.from as usize));
        }
        let (run, _, pin) = self.pin_at(task, slot)?;
        let output = pin.checked_sub(run.block_type.inputs.len())?;
        run.block_type.formulas()?.get(output)?;
        Some(run.block_type.outputs.get(output)?.doc().to_owned())
    }

    /// The name of the signal whose value a slot holds, which may be of another task.
    fn slot_name(&self, task: usize, slot: usize) -> String {
        if let Some(signal) = self.at(task, slot) {
            return signal.name;
        }
        let imports = self.tasks.get(task).map_or(&[][..], |task| &task.imports);
        let import = imports.iter().find_map(|import| {
            let slot = *import.slots.get(slot.checked_sub(import.first_slot)?)?;
            Some((import.from, slot as usize))
        });
        import.and_then(|(from, slot)| self.at(from, slot)).map_or_else(String::new, |s| s.name)
    }

    /// The instance that a pin's slot belongs to.
    pub(super) fn instance_of(&self, task: usize, slot: usize) -> Option<Instance<'_>> {
        let (run, offset, _) = self.pin_at(task, slot)?;
        Some(Instance {
            name: self.instance_name(run, offset),
            block_type: &run.block_type,
            first_slot: run.slot(offset, 0),
            constants: &run.constants,
        })
    }

    /// Slots of the instance that a pin's slot belongs to: its first, and those of its outputs.
    pub(super) fn outputs_of(&self, task: usize, slot: usize) -> Option<std::ops::Range<usize>> {
        let (run, offset, _) = self.pin_at(task, slot)?;
        let inputs = run.block_type.inputs.len();
        Some(run.slot(offset, inputs)..run.slot(offset, run.block_type.slots()))
    }

    /// The alarm whose instance begins at a slot.
    fn alarm_at(&self, task: usize, first_slot: usize) -> Option<&AlarmPlan> {
        self.tasks.get(task)?.alarms.iter().find(|alarm| alarm.first_slot == first_slot)
    }

    fn block(&self, name: &str) -> Option<&Block> {
        let found = self.blocks.binary_search_by(|block| (*block.name).cmp(name));
        self.blocks.get(found.ok()?)
    }

    /// The instance of a name: its run, and its index in that.
    fn instance(&self, name: &str) -> Option<(&Run, usize)> {
        let (base, number) = split(name)?;
        let runs = &self.block(base)?.runs;
        let run = |index: &u32| self.runs.get(*index as usize);
        let (found, offset) = match number {
            None => (run(runs.first()?)?, 0),
            Some(number) => {
                let is_before = |index: &u32| run(index).is_some_and(|r| r.number <= Some(number));
                let found = runs.partition_point(is_before).checked_sub(1)?;
                let found = run(runs.get(found)?)?;
                (found, (number - found.number?) as usize)
            }
        };
        let is_there = found.number.is_some() == number.is_some() && offset < found.len;
        is_there.then_some((found, offset))
    }

    fn instance_name(&self, run: &Run, offset: usize) -> String {
        let name = self.blocks.get(run.block as usize).map_or("", |block| &block.name);
        match run.number {
            None => name.to_owned(),
            Some(number) => format!("{name}.{}", number as usize + offset),
        }
    }

    /// The pin of a slot: its run, which instance of it, and which pin of that.
    fn pin_at(&self, task: usize, slot: usize) -> Option<(&Run, usize, usize)> {
        let is_before = |run: &Run| (run.task as usize, run.first_slot) <= (task, slot);
        let run = self.runs.get(self.runs.partition_point(is_before).checked_sub(1)?)?;
        let (offset, stride) = (slot.checked_sub(run.first_slot)?, run.block_type.slots());
        let is_there = run.task as usize == task && offset / stride < run.len;
        is_there.then_some((run, offset / stride, offset % stride))
    }
}

impl Run {
    fn slot(&self, offset: usize, pin: usize) -> usize {
        self.first_slot + offset * self.block_type.slots() + pin
    }
}

impl Task {
    fn wire_to(&self, slot: usize) -> Option<WirePlan> {
        let found = self.wires.binary_search_by_key(&slot, |wire| wire.to as usize).ok()?;
        self.wires.get(found).copied()
    }
}

/// A block's name and, for one of several instances, its number.
fn split(instance: &str) -> Option<(&str, Option<u32>)> {
    match instance.split_once('.') {
        None => Some((instance, None)),
        // "07" is no instance's name.
        Some((base, number)) => {
            let parsed = number.parse().ok()?;
            let is_written_so = number == "0" || !number.starts_with(['0', '+']);
            is_written_so.then_some((base, Some(parsed)))
        }
    }
}
