//! The common part of two indexes of a node's names.

mod blocks;
mod pins;

use std::collections::HashMap;
use std::ops::Range;

use isochrone_blocks::BlockType;
pub(in crate::desk) use pins::ChangedPin;

use super::{Run, Signals, Task, Variable};
use isochrone_engine::orders::{CarriedInstance, CarriedValue, CopySpan};

/// The instances, alarms and variables of the same name, type or definition, and task in two plans with the same tasks and inputs.
#[derive(Debug)]
pub(in crate::desk) struct Kept {
    tasks: Box<[KeptOfTask]>,
}

#[derive(Debug)]
struct KeptOfTask {
    /// Slots of the inputs, which are the same in both.
    inputs: usize,
    /// The slots of the first plan's variables in the second.
    variables: Box<[Option<usize>]>,
    /// By slots in the first plan.
    stretches: Box<[Stretch]>,
}

/// Instances that follow each other in both plans.
#[derive(Debug, Clone)]
pub(in crate::desk) struct Stretch {
    pub(in crate::desk) from: usize,
    pub(in crate::desk) to: usize,
    from_state: usize,
    to_state: usize,
    instances: usize,
    block_type: BlockType,
    from_type: BlockType,
    carried: CarriedInstance,
    /// Index of their block in the second plan, and their numbers in it.
    block: usize,
    numbers: Range<usize>,
    from_block: usize,
}

impl Stretch {
    /// The slot in the second plan for one in the first, if it is in both.
    fn slot(&self, slot: usize) -> Option<usize> {
        let stride = self.from_type.slots();
        let (instance, pin) = ((slot - self.from) / stride, (slot - self.from) % stride);
        if instance >= self.instances {
            return None;
        }
        let is_in = |span: &&CopySpan| (span.from..span.from + span.len).contains(&pin);
        let pin = match self.carried.outputs.iter().find(is_in) {
            _ if self.carried.is_whole => pin,
            span => span.map(|span| span.to + pin - span.from)?,
        };
        Some(self.to + instance * self.block_type.slots() + pin)
    }

    /// The slots that are in both.
    fn image(&self) -> Vec<CopySpan> {
        let strides = (self.from_type.slots(), self.block_type.slots());
        self.spans((self.from, self.to), strides, &self.carried.outputs)
    }

    /// The words of private state that are in both.
    fn state(&self) -> Vec<CopySpan> {
        let strides = (self.from_type.state_words, self.block_type.state_words);
        self.spans((self.from_state, self.to_state), strides, &self.carried.words)
    }

    /// The spans of all instances; `of_one` are those of each, which all together are one if they are whole.
    fn spans(
        &self,
        (from, to): (usize, usize),
        (stride, new_stride): (usize, usize),
        of_one: &[CopySpan],
    ) -> Vec<CopySpan> {
        if self.carried.is_whole {
            return vec![CopySpan { from, to, len: self.instances * stride }];
        }
        let of_instance = |instance: usize| {
            let (from, to) = (from + instance * stride, to + instance * new_stride);
            let moved = move |span: &CopySpan| CopySpan {
                from: from + span.from,
                to: to + span.to,
                len: span.len,
            };
            of_one.iter().map(moved)
        };
        (0..self.instances).flat_map(of_instance).collect()
    }
}

impl Kept {
    /// What `new` keeps of `old`.
    pub(in crate::desk) fn of(old: &Signals, new: &Signals) -> Self {
        let (from_state, to_state) = (old.state_offsets(), new.state_offsets());
        let mut tasks: Vec<Vec<Stretch>> = old.tasks.iter().map(|_| Vec::new()).collect();
        for (block, found) in new.blocks.iter().enumerate() {
            let known = old.blocks.binary_search_by(|known| known.name.cmp(&found.name));
            let Ok(from_block) = known else { continue };
            let Some(known) = old.blocks.get(from_block) else { continue };
            let (mut i, mut j) = (0, 0);
            // The runs of a block are in the order of their numbers.
            while let (Some(&a), Some(&b)) = (known.runs.get(i), found.runs.get(j)) {
                let (Some(from), Some(to)) = (old.runs.get(a as usize), new.runs.get(b as usize))
                else {
                    break;
                };
                let (of_from, of_to) = (from.numbers(), to.numbers());
                let both = of_from.start.max(of_to.start)..of_from.end.min(of_to.end);
                if from.number.is_some() == to.number.is_some()
                    && from.task == to.task
                    && !both.is_empty()
                    && let Some(carried) = CarriedInstance::of(&from.block_type, &to.block_type)
                    && is_same_alarm(old, from, new, to)
                    && let Some(stretches) = tasks.get_mut(to.task as usize)
                {
                    let offset = |run: &Run| both.start - run.numbers().start;
                    let state = |run: u32, offsets: &[usize], of: &Run| {
                        let first = offsets.get(run as usize).copied().unwrap_or_default();
                        first + offset(of) * of.block_type.state_words
                    };
                    stretches.push(Stretch {
                        from: from.slot(offset(from), 0),
                        to: to.slot(offset(to), 0),
                        from_state: state(a, &from_state, from),
                        to_state: state(b, &to_state, to),
                        instances: both.len(),
                        block_type: to.block_type,
                        from_type: from.block_type,
                        carried,
                        block,
                        numbers: both,
                        from_block,
                    });
                }
                i += usize::from(of_from.end <= of_to.end);
                j += usize::from(of_to.end <= of_from.end);
            }
        }
        let of_task = |((index, task), mut stretches): ((usize, &Task), Vec<Stretch>)| {
            stretches.sort_unstable_by_key(|stretch| stretch.from);
            let variables = task.variables.iter().map(|known| new.variable_like(index, known));
            let (inputs, variables) = (task.first_variable(), variables.collect());
            KeptOfTask { inputs, variables, stretches: stretches.into() }
        };
        Self { tasks: old.tasks.iter().enumerate().zip(tasks).map(of_task).collect() }
    }

    /// The slot in the second plan for one in the first; `None`: it holds another task's value, or does not exist
    /// there.
    pub(in crate::desk) fn slot(&self, task: usize, slot: usize) -> Option<usize> {
        let found = self.tasks.get(task)?;
        if slot < found.inputs {
            return Some(slot);
        }
        if let Some(variable) = found.variables.get(slot - found.inputs) {
            return *variable;
        }
        let next = found.stretches.partition_point(|stretch| stretch.from <= slot);
        found.stretches.get(next.checked_sub(1)?)?.slot(slot)
    }

    fn stretches(&self, task: usize) -> &[Stretch] {
        self.tasks.get(task).map_or(&[], |found| &found.stretches)
    }

    /// The variables of a task that are in both plans: their slots in the first and in the second.
    fn variables(&self, task: usize) -> impl Iterator<Item = (usize, usize)> {
        let found = self.tasks.get(task).into_iter();
        found.flat_map(|of| {
            let slots = (of.inputs..).zip(of.variables.iter());
            slots.filter_map(|(from, to)| Some((from, (*to)?)))
        })
    }

    /// The slots of a task's image that are in both plans.
    pub(in crate::desk) fn image(&self, task: usize) -> Box<[CopySpan]> {
        let inputs = self.tasks.get(task).map_or(0, |found| found.inputs);
        let inputs = CopySpan { from: 0, to: 0, len: inputs };
        let variables = self.variables(task).map(|(from, to)| CopySpan { from, to, len: 1 });
        let pins = self.stretches(task).iter().flat_map(Stretch::image);
        joined(std::iter::once(inputs).chain(variables).chain(pins))
    }

    /// The private state of a task that is in both plans.
    pub(in crate::desk) fn state(&self, task: usize) -> Box<[CopySpan]> {
        joined(self.stretches(task).iter().flat_map(Stretch::state))
    }

    /// The values of other tasks that a task reads in both plans.
    pub(in crate::desk) fn imports(
        &self,
        old: &Signals,
        new: &Signals,
        task: usize,
    ) -> Box<[CarriedValue]> {
        let places = new.imported(task);
        let (Some(from), Some(to)) = (old.tasks.get(task), new.tasks.get(task)) else {
            return [].into();
        };
        let mut carried = Vec::new();
        for (import, known) in from.imports.iter().enumerate() {
            for (position, slot) in known.slots.iter().enumerate() {
                let kept = self.slot(known.from, *slot as usize);
                let Some(&slot) = kept.and_then(|kept| places.get(&(known.from, kept))) else {
                    continue;
                };
                let source = slot - to.first_import() + to.inputs.len();
                carried.push(CarriedValue { import, position, slot, source });
            }
        }
        carried.into()
    }
}

impl Signals {
    /// The slot of the variable of the same name, type and task.
    fn variable_like(&self, task: usize, known: &Variable) -> Option<usize> {
        let (of, slot) = self.value(&known.name)?;
        let found = self.tasks.get(of)?.variable_at(slot)?;
        (of == task && found.value_type == known.value_type).then_some(slot)
    }

    /// For each run the first word of private state of its first instance.
    fn state_offsets(&self) -> Vec<usize> {
        let (mut task, mut next) = (0, 0);
        let offset = |run: &Run| {
            if run.task != task {
                (task, next) = (run.task, 0);
            }
            let first = next;
            next += run.len * run.block_type.state_words;
            first
        };
        self.runs.iter().map(offset).collect()
    }

    /// Slots of a task by the task and slot that another task's value comes from.
    fn imported(&self, task: usize) -> HashMap<(usize, usize), usize> {
        let imports = self.tasks.get(task).map_or(&[][..], |task| &task.imports);
        let of_import = |import: &super::Import| {
            let (from, first) = (import.from, import.first_slot);
            let slots = import.slots.iter().enumerate();
            slots.map(move |(index, slot)| ((from, *slot as usize), first + index)).collect()
        };
        imports.iter().flat_map(|import| -> Vec<_> { of_import(import) }).collect()
    }
}

impl Run {
    /// The numbers of its instances; a block without any is number 0.
    fn numbers(&self) -> Range<usize> {
        let first = self.number.unwrap_or_default() as usize;
        first..first + self.len
    }
}

/// Whether two instances of one type are the same alarm, if that is what they are: the state of another condition says
/// nothing of this one.
fn is_same_alarm(old: &Signals, from: &Run, new: &Signals, to: &Run) -> bool {
    let task = from.task as usize;
    match (old.alarm_at(task, from.first_slot), new.alarm_at(task, to.first_slot)) {
        (Some(before), Some(now)) => now.has_definition_of(before),
        _ => true,
    }
}

/// Merges spans that continue each other.
fn joined(spans: impl Iterator<Item = CopySpan>) -> Box<[CopySpan]> {
    let mut joined: Vec<CopySpan> = Vec::new();
    for span in spans.filter(|span| span.len > 0) {
        match joined.last_mut() {
            Some(last) if last.from + last.len == span.from && last.to + last.len == span.to => {
                last.len += span.len;
            }
            _ => joined.push(span),
        }
    }
    joined.into()
}
