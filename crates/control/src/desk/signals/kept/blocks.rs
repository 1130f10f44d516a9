//! The blocks and variables that a change of the configuration adds and removes, and the blocks that it keeps.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use super::super::{Block, Signals, Task};
use super::{Kept, Stretch};

/// Variables, blocks, and outputs of an `Expr` that stays, by name, and some of a block's instances by their numbers: `ramp.3 to ramp.7`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in crate::desk) struct Blocks {
    pub(in crate::desk) added: Vec<String>,
    pub(in crate::desk) removed: Vec<String>,
    /// Blocks alone.
    pub(in crate::desk) kept: Vec<String>,
}

impl Kept {
    /// What is added, removed and kept.
    pub(in crate::desk) fn blocks(&self, old: &Signals, new: &Signals) -> Blocks {
        let mut by_new: HashMap<usize, Vec<Range<usize>>> = HashMap::new();
        let mut by_old: HashMap<usize, Vec<Range<usize>>> = HashMap::new();
        for stretch in self.tasks.iter().flat_map(|task| &task.stretches) {
            by_new.entry(stretch.block).or_default().push(stretch.numbers.clone());
            by_old.entry(stretch.from_block).or_default().push(stretch.numbers.clone());
        }
        let mut blocks = self.added_and_removed_variables(old, new);
        for (index, block) in new.blocks.iter().enumerate() {
            let of_block = self.tasks.iter().flat_map(|task| &task.stretches);
            let Some(stretch) = of_block.clone().find(|stretch| stretch.block == index) else {
                continue;
            };
            let instances = if new.is_numbered(block) { ".*" } else { "" };
            let name = |pin: &str| format!("{}{instances}.{pin}", block.name);
            blocks.added.extend(stretch.added_outputs().map(name));
            blocks.removed.extend(stretch.removed_outputs().map(name));
        }
        for (index, block) in new.blocks.iter().enumerate() {
            let kept = merged(by_new.remove(&index).unwrap_or_default());
            let is_numbered = new.is_numbered(block);
            let name = |range| name(&block.name, range, block.count, is_numbered);
            let others = complement(&kept, block.count);
            blocks.kept.extend(kept.into_iter().map(name));
            blocks.added.extend(others.into_iter().map(name));
        }
        for (index, block) in old.blocks.iter().enumerate() {
            let kept = merged(by_old.remove(&index).unwrap_or_default());
            let is_numbered = old.is_numbered(block);
            let gone = complement(&kept, block.count).into_iter();
            let name = |range| name(&block.name, range, block.count, is_numbered);
            blocks.removed.extend(gone.map(name));
        }
        blocks
    }
}

impl Kept {
    fn added_and_removed_variables(&self, old: &Signals, new: &Signals) -> Blocks {
        let mut blocks = Blocks::default();
        for (task, (of_old, of_new)) in old.tasks.iter().zip(new.tasks.iter()).enumerate() {
            let (from, to): (HashSet<usize>, HashSet<usize>) = self.variables(task).unzip();
            let others = |of: &Task, kept: &HashSet<usize>| -> Vec<String> {
                let variables = (of.first_variable()..).zip(of.variables.iter());
                let others = variables.filter(|(slot, _)| !kept.contains(slot));
                others.map(|(_, variable)| variable.name.to_string()).collect()
            };
            blocks.removed.extend(others(of_old, &from));
            blocks.added.extend(others(of_new, &to));
        }
        blocks
    }
}

impl Stretch {
    /// The outputs that only the second plan has.
    fn added_outputs(&self) -> impl Iterator<Item = &'static str> + '_ {
        let is_kept = |place: usize| {
            let mut kept = self.carried.outputs.iter();
            self.carried.is_whole || kept.any(|span| (span.to..span.to + span.len).contains(&place))
        };
        let outputs = (self.block_type.inputs.len()..).zip(self.block_type.outputs);
        outputs.filter(move |(place, _)| !is_kept(*place)).map(|(_, pin)| pin.name)
    }

    /// The outputs that only the first plan has.
    fn removed_outputs(&self) -> impl Iterator<Item = &'static str> + '_ {
        let outputs = (self.from_type.inputs.len()..).zip(self.from_type.outputs);
        let gone = outputs.filter(|(place, _)| self.slot(self.from + place).is_none());
        gone.map(|(_, pin)| pin.name)
    }
}

impl Signals {
    fn is_numbered(&self, block: &Block) -> bool {
        let first = block.runs.first().and_then(|run| self.runs.get(*run as usize));
        first.is_some_and(|run| run.number.is_some())
    }
}

fn merged(mut ranges: Vec<Range<usize>>) -> Vec<Range<usize>> {
    ranges.sort_unstable_by_key(|range| range.start);
    let mut merged: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match merged.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => merged.push(range),
        }
    }
    merged
}

/// The rest of `0..count`.
fn complement(ranges: &[Range<usize>], count: usize) -> Vec<Range<usize>> {
    let starts = std::iter::once(0).chain(ranges.iter().map(|range| range.end));
    let ends = ranges.iter().map(|range| range.start).chain(std::iter::once(count));
    starts.zip(ends).map(|(start, end)| start..end).filter(|range| !range.is_empty()).collect()
}

fn name(block: &str, range: Range<usize>, count: usize, is_numbered: bool) -> String {
    match range.len() {
        len if len == count || !is_numbered => block.to_owned(),
        1 => format!("{block}.{}", range.start),
        _ => format!("{block}.{} to {block}.{}", range.start, range.end - 1),
    }
}
