//! Operations of a run, repeated in the cycles in which they took place.

use std::collections::BTreeMap;
use std::sync::Arc;

use isochrone_control::desk::Replay;
use isochrone_engine::{Plan, TaskEngine, Wires};
use isochrone_model::{Action, Entry};

/// The journal entries of a run.
pub(super) struct Operations {
    replay: Replay,
    /// By task and cycle.
    entries: BTreeMap<(usize, u64), Vec<Entry>>,
    /// Values that were not what the journal says they were.
    pub(super) differences: Tally,
}

/// How often something happened, and the first time in words.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) count: u64,
    pub(super) first: String,
}

impl Tally {
    pub(super) fn add(&mut self, what: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = what();
        }
        self.count += 1;
    }
}

impl Operations {
    /// The entries of a run, each of which [fits](Replay::check) the plan.
    pub(super) fn new(plan: &Plan, entries: BTreeMap<(usize, u64), Vec<Entry>>) -> Self {
        Self { replay: Replay::new(plan), entries, differences: Tally::default() }
    }

    /// The configuration that a task gets with a cycle, if it gets another one: number of its transaction,
    /// and its text.
    pub(super) fn change(&self, task: usize, cycle: u64) -> Option<(u64, Arc<str>)> {
        let entries = self.entries.get(&(task, cycle))?.iter();
        let changed = |entry: &Entry| Some((entry.transaction, entry.configuration.clone()?));
        entries.rev().find_map(changed)
    }

    /// Hands a task over to the next configuration that it gets after a cycle, as a node does ahead of it;
    /// the ends of its new wires. `None`: it gets no other.
    pub(super) fn hand_over(
        &mut self,
        task: usize,
        after_cycle: Option<u64>,
        engine: &mut TaskEngine,
    ) -> Option<Wires> {
        let first = after_cycle.map_or(0, |cycle| cycle.saturating_add(1));
        let later = self.entries.range((task, first)..=(task, u64::MAX));
        let change = later.flat_map(|(_, entries)| entries).find(|entry| is_change(entry))?;
        // That it fits was checked when it was read.
        self.replay.hand_over(change, engine).ok()
    }

    /// Does what was done before a cycle, in the order of a node: another configuration, then the ends of
    /// forces, then everything else.
    pub(super) fn apply(&mut self, task: usize, cycle: u64, engine: &mut TaskEngine) {
        let entries = self.entries.remove(&(task, cycle)).unwrap_or_default();
        let (changes, others): (Vec<Entry>, Vec<Entry>) = entries.into_iter().partition(is_change);
        self.repeat(&changes, engine);
        engine.expire(cycle, drop);
        self.repeat(&others, engine);
    }

    fn repeat(&mut self, entries: &[Entry], engine: &mut TaskEngine) {
        for entry in entries {
            // That it fits was checked when it was read.
            for difference in self.replay.apply(entry, engine).unwrap_or_default() {
                self.differences.add(|| format!("{difference} (cycle {})", entry.cycle));
            }
        }
    }

    /// How many entries have not been reached by a cycle.
    pub(super) fn left(&self) -> usize {
        self.entries.values().map(Vec::len).sum()
    }
}

fn is_change(entry: &Entry) -> bool {
    entry.action == Action::Apply
}
