//! The signals that a pattern stands for.

use super::{Run, Signal, Signals, Task};
use crate::operate::pattern::{Pattern, part_matches};
use crate::plan::InputPart;

impl Signals {
    /// The signals whose names match a pattern.
    pub fn matching(&self, pattern: &Pattern) -> Matches<'_> {
        let parts: Vec<&str> = pattern.parts().iter().map(String::as_str).collect();
        let inputs = self.tasks.iter().enumerate().map(|(index, task)| {
            let pins: Vec<usize> = task.matching(&parts).collect();
            Group { task: index, first_slot: 0, stride: 0, instances: Instances::One, pins }
        });
        let mut searched = self.inputs.len() + self.runs.len();
        let runs = self.runs.iter().filter_map(|run| self.group(run, &parts, &mut searched));
        let groups: Vec<Group> = inputs.chain(runs).filter(|group| group.len() > 0).collect();
        Matches { total: groups.iter().map(Group::len).sum(), signals: self, groups, searched }
    }

    /// All signals.
    pub fn all(&self) -> Matches<'_> {
        let inputs = self.tasks.iter().enumerate().map(|(index, task)| {
            let pins: Vec<usize> =
                task.matching(&["*"]).chain(task.matching(&["*", "*"])).collect();
            Group { task: index, first_slot: 0, stride: 0, instances: Instances::One, pins }
        });
        let runs = self.runs.iter().map(|run| Group {
            task: run.task as usize,
            first_slot: run.first_slot,
            stride: run.block_type.slots(),
            instances: Instances::All(run.len),
            pins: (0..run.block_type.slots()).collect(),
        });
        let groups: Vec<Group> = inputs.chain(runs).filter(|group| group.len() > 0).collect();
        Matches { total: groups.iter().map(Group::len).sum(), signals: self, groups, searched: 0 }
    }

    /// The signals of a run that match the parts of a pattern. Counts the names that were compared.
    fn group(&self, run: &Run, parts: &[&str], searched: &mut usize) -> Option<Group> {
        let block = self.blocks.get(run.block as usize)?;
        let (name, number, pin) = match (parts, run.number) {
            ([name, pin], None) => (name, None, pin),
            ([name, number, pin], Some(first)) => (name, Some((number, first)), pin),
            _ => return None,
        };
        if !part_matches(name, &block.name) {
            return None;
        }
        let instances = match number {
            Some((number, first)) => run.matching(first, number, searched),
            None => Instances::One,
        };
        let pins = run.block_type.inputs.iter().chain(run.block_type.outputs).enumerate();
        let pins = pins.filter(|(_, known)| part_matches(pin, known.name)).map(|(index, _)| index);
        let stride = run.block_type.slots();
        let pins = pins.collect();
        Some(Group { task: run.task as usize, first_slot: run.first_slot, stride, instances, pins })
    }
}

impl Task {
    /// Slots of the inputs, and of what is said of them, that match the parts of a pattern.
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
}

impl Run {
    /// The instances whose number matches the part of a pattern.
    fn matching(&self, first: u32, pattern: &str, searched: &mut usize) -> Instances {
        if pattern.chars().all(|c| c == '*') {
            return Instances::All(self.len);
        }
        // A plain number need not be looked for.
        let from = pattern.parse::<u32>().ok().map(|number| number.wrapping_sub(first) as usize);
        let candidates = from.map_or(0..self.len, |from| from..(from + 1).min(self.len));
        *searched += candidates.len();
        let mut digits = (first as usize + candidates.start).to_string().into_bytes();
        let is_meant = |_: &usize| {
            let is_meant = part_matches(pattern, str::from_utf8(&digits).unwrap_or_default());
            increment(&mut digits);
            is_meant
        };
        Instances::Those(candidates.filter(is_meant).collect())
    }
}

/// Adds one to a number as it is written: millions of numbers are compared with a pattern.
fn increment(digits: &mut Vec<u8>) {
    for digit in digits.iter_mut().rev() {
        if *digit < b'9' {
            *digit += 1;
            return;
        }
        *digit = b'0';
    }
    digits.insert(0, b'1');
}

/// Which instances of a run.
#[derive(Debug)]
enum Instances {
    One,
    All(usize),
    Those(Vec<usize>),
}

/// Signals of one run or input that match.
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
    fn len(&self) -> usize {
        let instances = match &self.instances {
            Instances::One => 1,
            Instances::All(count) => *count,
            Instances::Those(offsets) => offsets.len(),
        };
        instances * self.pins.len()
    }

    fn slot(&self, index: usize) -> usize {
        let (instance, pin) = (index / self.pins.len().max(1), index % self.pins.len().max(1));
        let offset = match &self.instances {
            Instances::One => 0,
            Instances::All(_) => instance,
            Instances::Those(offsets) => offsets.get(instance).copied().unwrap_or_default(),
        };
        self.first_slot + offset * self.stride + self.pins.get(pin).copied().unwrap_or_default()
    }
}

/// The signals that match a pattern: inputs, then pins in the order in which the blocks step.
#[derive(Debug)]
pub struct Matches<'a> {
    signals: &'a Signals,
    groups: Vec<Group>,
    total: usize,
    searched: usize,
}

impl<'a> Matches<'a> {
    /// How many there are.
    pub fn total(&self) -> usize {
        self.total
    }

    /// How many names the pattern was compared with.
    pub(in crate::operate) fn searched(&self) -> usize {
        self.searched
    }

    /// Their tasks and slots, from the one at `offset` on. What is skipped costs nothing.
    pub(in crate::operate) fn slots(&self, offset: usize) -> impl Iterator<Item = (usize, usize)> {
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
