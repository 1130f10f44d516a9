//! The signals that match a pattern.

use isochrone_engine::InputPart;
use isochrone_engine::{Pattern, part_matches};

use super::{Run, Signal, Signals, Task, Variable};

impl Signals {
    /// The signals whose names match a pattern.
    pub fn matching(&self, pattern: &Pattern) -> Matches<'_> {
        let parts: Vec<&str> = pattern.parts().iter().map(String::as_str).collect();
        let inputs = self.tasks.iter().enumerate().map(|(index, task)| {
            let slots = task.matching(&parts).chain(task.matching_variables(&parts));
            Group::of_values(index, slots.collect())
        });
        let runs = self.runs.iter().filter_map(|run| self.group(run, &parts));
        self.matches(inputs.chain(runs))
    }

    /// All signals.
    pub fn all(&self) -> Matches<'_> {
        let inputs = self.tasks.iter().enumerate().map(|(index, task)| {
            let slots = task.matching(&["*"]).chain(task.matching(&["*", "*"]));
            Group::of_values(index, slots.chain(task.matching_variables(&["*"])).collect())
        });
        let pins = |run: &Run| run.block_type.signals().map(|(pin, _)| pin).collect();
        let runs = self.runs.iter().map(|run| run.group(Instances::All(run.len), pins(run)));
        self.matches(inputs.chain(runs))
    }

    fn matches(&self, groups: impl Iterator<Item = Group>) -> Matches<'_> {
        let groups: Vec<Group> = groups.filter(|group| group.len() > 0).collect();
        Matches { total: groups.iter().map(Group::len).sum(), signals: self, groups }
    }

    /// The signals of a run that match the parts of a pattern.
    fn group(&self, run: &Run, parts: &[&str]) -> Option<Group> {
        let block = self.blocks.get(run.block as usize)?;
        let (name, number, pin) = match (parts, run.number) {
            ([name, pin], None) => (name, None, pin),
            ([name, number, pin], Some(first)) => (name, Some((number, first)), pin),
            _ => return None,
        };
        if !part_matches(name, &block.name) {
            return None;
        }
        let pins = run.block_type.signals();
        let pins = pins.filter(|(_, known)| part_matches(pin, known.name)).map(|(index, _)| index);
        let pins: Vec<usize> = pins.collect();
        // Numbers are compared last: there may be a million.
        if pins.is_empty() {
            return None;
        }
        let instances = match number {
            Some((number, first)) => run.matching(first as usize, number),
            None => Instances::All(1),
        };
        Some(run.group(instances, pins))
    }
}

impl Task {
    /// Slots of the inputs, and of their `ok` and `age`, that match the parts of a pattern.
    fn matching(&self, parts: &[&str]) -> impl Iterator<Item = usize> {
        let inputs = self.inputs.len();
        let slot = move |part: InputPart, input: usize| part as usize * inputs + input;
        let wanted = |part: &InputPart| match parts {
            [_] => *part == InputPart::Value,
            [_, suffix] => {
                part.suffix().strip_prefix('.').is_some_and(|part| part_matches(suffix, part))
            }
            _ => false,
        };
        let wanted: Vec<InputPart> = InputPart::ALL.into_iter().filter(wanted).collect();
        let name = parts.first().copied().unwrap_or_default();
        let inputs = self.inputs.iter().enumerate();
        let inputs = inputs.filter(move |(_, input)| part_matches(name, &input.name));
        inputs.flat_map(move |(input, _)| wanted.clone().into_iter().map(move |p| slot(p, input)))
    }

    /// Slots of the variables that match the parts of a pattern.
    fn matching_variables(&self, parts: &[&str]) -> impl Iterator<Item = usize> {
        let name = if let [name] = parts { Some(*name) } else { None };
        let variables = (self.first_variable()..).zip(self.variables.iter());
        let is_meant = move |(_, variable): &(usize, &Variable)| {
            name.is_some_and(|name| part_matches(name, &variable.name))
        };
        variables.filter(is_meant).map(|(slot, _)| slot)
    }
}

impl Run {
    /// The instances whose number matches the part of a pattern.
    fn matching(&self, first: usize, pattern: &str) -> Instances {
        if pattern == "*" {
            return Instances::All(self.len);
        }
        let is_meant = |offset: &usize| part_matches(pattern, &(first + offset).to_string());
        Instances::Those(match pattern.parse::<usize>() {
            // A plain number matches one instance.
            Ok(number) => {
                let offset = number.checked_sub(first).filter(|offset| *offset < self.len);
                offset.filter(is_meant).into_iter().collect()
            }
            Err(_) => (0..self.len).filter(is_meant).collect(),
        })
    }

    fn group(&self, instances: Instances, pins: Vec<usize>) -> Group {
        let (task, first_slot) = (self.task as usize, self.first_slot);
        Group { task, first_slot, stride: self.block_type.slots(), instances, pins }
    }
}

/// The instances of a run that match.
#[derive(Debug)]
enum Instances {
    /// All, of this number.
    All(usize),
    /// Their offsets from the first.
    Those(Vec<usize>),
}

/// Signals of one run that match, or inputs and variables of a task.
#[derive(Debug)]
struct Group {
    task: usize,
    first_slot: usize,
    stride: usize,
    instances: Instances,
    /// Offsets of the slots from an instance's first.
    pins: Vec<usize>,
}

impl Group {
    fn of_values(task: usize, pins: Vec<usize>) -> Self {
        Self { task, first_slot: 0, stride: 0, instances: Instances::All(1), pins }
    }

    fn len(&self) -> usize {
        let instances = match &self.instances {
            Instances::All(count) => *count,
            Instances::Those(offsets) => offsets.len(),
        };
        instances * self.pins.len()
    }

    fn slot(&self, index: usize) -> usize {
        let (instance, pin) = (index / self.pins.len().max(1), index % self.pins.len().max(1));
        let offset = match &self.instances {
            Instances::All(_) => instance,
            Instances::Those(offsets) => offsets.get(instance).copied().unwrap_or_default(),
        };
        self.first_slot + offset * self.stride + self.pins.get(pin).copied().unwrap_or_default()
    }
}

/// The signals that match a pattern: inputs and variables, then pins in the order in which the blocks step.
#[derive(Debug)]
pub struct Matches<'a> {
    signals: &'a Signals,
    groups: Vec<Group>,
    total: usize,
}

impl<'a> Matches<'a> {
    /// How many signals match.
    pub fn total(&self) -> usize {
        self.total
    }

    /// Their tasks and slots, from `offset` on. Skipping costs nothing.
    pub(in crate::desk) fn slots(&self, offset: usize) -> impl Iterator<Item = (usize, usize)> {
        let mut skipped = offset;
        self.groups.iter().flat_map(move |group| {
            let from = skipped.min(group.len());
            skipped -= from;
            (from..group.len()).map(move |index| (group.task, group.slot(index)))
        })
    }

    /// Those from `offset` on, at most `limit`.
    pub fn page(&self, offset: usize, limit: usize) -> impl Iterator<Item = Signal<'a>> {
        self.slots(offset).take(limit).filter_map(|(task, slot)| self.signals.at(task, slot))
    }
}
