//! The release jitter of the tasks: of the last second, and of all cycles that were seen.

use std::collections::BTreeMap;
use std::sync::Arc;

use isochrone_timing::{Distribution, Summary};
use serde::Serialize;

use super::response::json;

/// Between two looks at the numbers: digits that change faster cannot be read.
const INTERVAL_NS: u64 = 1_000_000_000;
/// Classes of the histogram for each power of ten.
const CLASSES_PER_DECADE: usize = 10;
/// The lower end of the first class and the upper end of the last, as powers of ten in ns.
const DECADES: [usize; 2] = [1, 9];
const CLASSES: usize = (DECADES[1] - DECADES[0]) * CLASSES_PER_DECADE;

/// The jitter of all tasks.
#[derive(Default)]
pub(super) struct Jitter {
    tasks: BTreeMap<String, TaskJitter>,
    due_ns: u64,
    version: u64,
    text: Arc<str>,
}

#[derive(Default)]
struct TaskJitter {
    second: Distribution,
    all: Distribution,
    last_cycle: Option<u64>,
    /// Whether every cycle comes, from a trace.
    is_traced: bool,
    shown: TaskTiming,
}

/// The timing of a task on the page. Times in ns.
#[derive(Default, Serialize)]
struct TaskTiming {
    second: Summary,
    all: Summary,
    /// Whether those are all cycles of the time, and not some of them.
    #[serde(rename = "every_cycle")]
    is_traced: bool,
    /// Cycles in each class.
    classes: Vec<u64>,
}

/// All tasks, and what the classes are.
#[derive(Serialize)]
struct Document<'a> {
    tasks: BTreeMap<&'a str, &'a TaskTiming>,
    /// ns.
    first_class: u64,
    classes_per_decade: usize,
}

impl Jitter {
    /// Takes a cycle in; one that was seen before counts once.
    pub(super) fn add(&mut self, task: &str, cycle: u64, jitter_ns: u64) {
        let known = self.task(task);
        if known.last_cycle.is_some_and(|last| last >= cycle) {
            return;
        }
        known.last_cycle = Some(cycle);
        known.second.record(jitter_ns);
        known.all.record(jitter_ns);
    }

    /// Takes in a cycle that telemetry shows, which is one of many; for tasks that no trace shows all of.
    pub(super) fn add_shown(&mut self, task: &str, cycle: u64, jitter_ns: u64) {
        if !self.task(task).is_traced {
            self.add(task, cycle, jitter_ns);
        }
    }

    /// Whether every cycle of a task comes.
    pub(super) fn set_traced(&mut self, task: &str, is_traced: bool) {
        self.task(task).is_traced = is_traced;
    }

    fn task(&mut self, name: &str) -> &mut TaskJitter {
        self.tasks.entry(name.to_owned()).or_default()
    }

    /// Another run of the node: its numbers are others.
    pub(super) fn forget(&mut self) {
        for task in self.tasks.values_mut() {
            let is_traced = task.is_traced;
            *task = TaskJitter { is_traced, ..TaskJitter::default() };
        }
        self.due_ns = 0;
    }

    /// Time goes on.
    pub(super) fn tick(&mut self, now_ns: u64) {
        if now_ns < self.due_ns {
            return;
        }
        self.due_ns = now_ns + INTERVAL_NS;
        for task in self.tasks.values_mut() {
            let (second, all) = (task.second.summary(), task.all.summary());
            let is_traced = task.is_traced;
            task.shown = TaskTiming { second, all, is_traced, classes: classes(&task.all) };
            task.second.clear();
        }
        let tasks = self.tasks.iter().map(|(name, task)| (name.as_str(), &task.shown)).collect();
        let first_class = 10_u64.pow(DECADES[0] as u32);
        let document = Document { tasks, first_class, classes_per_decade: CLASSES_PER_DECADE };
        self.text = json(&document).into();
        self.version += 1;
    }

    /// Number of the last look, and what it found, in JSON.
    pub(super) fn shown(&self) -> (u64, Arc<str>) {
        (self.version, self.text.clone())
    }
}

/// How many samples there are in each class; smaller and greater ones are in the first and the last.
fn classes(distribution: &Distribution) -> Vec<u64> {
    let mut classes = vec![0; CLASSES];
    for (ns, count) in distribution.buckets() {
        let decades = (ns.max(1) as f64).log10() - DECADES[0] as f64;
        let class = (decades.max(0.0) * CLASSES_PER_DECADE as f64) as usize;
        if let Some(class) = classes.get_mut(class.min(CLASSES - 1)) {
            *class += count;
        }
    }
    classes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cycle_counts_once_and_stands_in_the_class_of_its_jitter() {
        let mut jitter = Jitter::default();
        for (cycle, ns) in [(1, 0), (2, 100), (2, 777), (1, 777), (3, 150_000), (4, u64::MAX)] {
            jitter.add("fast", cycle, ns);
        }
        jitter.tick(5);
        let (version, text) = jitter.shown();
        let shown: serde_json::Value = serde_json::from_str(&text).unwrap();
        let fast = &shown["tasks"]["fast"];
        assert_eq!(
            (version, &fast["second"]["count"], &fast["all"]["count"]),
            (1, &4.into(), &4.into())
        );
        let counted = fast["classes"].as_array().unwrap().iter().enumerate();
        let filled: Vec<_> = counted.filter(|(_, count)| **count != 0).collect();
        assert_eq!(filled, [(0, &1.into()), (10, &1.into()), (41, &1.into()), (79, &1.into())]);
    }

    #[test]
    fn the_last_second_is_forgotten_and_all_cycles_are_not() {
        let mut jitter = Jitter::default();
        (0..1_000).for_each(|cycle| jitter.add("fast", cycle, 1_000));
        jitter.tick(0);
        jitter.add("fast", 1_000, 9_000);
        jitter.tick(INTERVAL_NS - 1);
        assert_eq!(jitter.shown().0, 1, "not yet");
        jitter.tick(INTERVAL_NS);
        let shown: serde_json::Value = serde_json::from_str(&jitter.shown().1).unwrap();
        let fast = &shown["tasks"]["fast"];
        assert_eq!((&fast["second"]["max"], &fast["second"]["count"]), (&9_000.into(), &1.into()));
        assert_eq!((&fast["all"]["count"], &fast["all"]["p50"]), (&1_001.into(), &1_000.into()));
    }
}
