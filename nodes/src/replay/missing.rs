//! Parts of a recording that the running configuration lacks.

use std::collections::{BTreeMap, BTreeSet};

use isochrone_recording::RecordedRow;
use isochrone_timing::units::counted;
use serde::Serialize;

/// Most names in a sentence.
const SHOWN: usize = 8;

/// Tasks, inputs and signals that were recorded, and do not take part.
#[derive(Default)]
pub(super) struct Missing {
    /// By name, with how many cycles were recorded.
    tasks: BTreeMap<String, u64>,
    /// By task.
    inputs: BTreeMap<String, BTreeSet<String>>,
    /// By task.
    signals: BTreeMap<String, BTreeSet<String>>,
    /// Channels of those tasks.
    channels: BTreeSet<u16>,
}

impl Missing {
    /// A row of a task that is not there.
    pub(super) fn row(&mut self, row: &RecordedRow<'_>) {
        let task = &row.layout.task;
        *self.tasks.entry(task.clone()).or_default() += 1;
        if !self.channels.insert(row.channel) {
            return;
        }
        for output in &row.layout.outputs {
            for signal in &output.signals {
                self.signal(task, &output.service, &signal.name);
            }
        }
    }

    /// An input of a task that is there.
    pub(super) fn input(&mut self, task: &str, input: &str) {
        self.inputs.entry(task.to_owned()).or_default().insert(input.to_owned());
    }

    /// A signal of an output.
    pub(super) fn signal(&mut self, task: &str, service: &str, signal: &str) {
        self.signals.entry(task.to_owned()).or_default().insert(format!("{service}.{signal}"));
    }

    pub(super) fn is_empty(&self) -> bool {
        self.tasks.is_empty() && self.inputs.is_empty() && self.signals.is_empty()
    }

    /// What it is, as sentences.
    pub(super) fn notes(&self) -> Vec<String> {
        let tasks = self.tasks.iter().map(|(task, rows)| {
            let rows = counted(*rows, "cycle");
            format!("there is no task \"{task}\" here; {rows} left out")
        });
        let inputs = self.inputs.iter().map(|(task, names)| {
            format!(
                "task \"{task}\" has no input {} here; what was read is left out",
                listed(names)
            )
        });
        let signals = self.signals.iter().filter(|(task, _)| !self.tasks.contains_key(*task));
        let signals = signals.map(|(task, names)| {
            let (names, are) = (listed(names), if names.len() == 1 { "it is" } else { "they are" });
            format!("task \"{task}\" does not publish {names} here; {are} not compared")
        });
        tasks.chain(inputs).chain(signals).collect()
    }

    /// How much it is, as part of a sentence; `None`: nothing.
    pub(super) fn summary(&self) -> Option<String> {
        let of = |by_task: &BTreeMap<_, BTreeSet<_>>| by_task.values().map(BTreeSet::len).sum();
        let counts: [(usize, _); 3] = [
            (of(&self.signals), "signal"),
            (of(&self.inputs), "input"),
            (self.tasks.len(), "task"),
        ];
        let counts = counts.iter().filter(|(count, _)| *count > 0);
        let counts: Vec<String> =
            counts.map(|(count, thing)| counted(*count as u64, thing)).collect();
        let (last, first) = counts.split_last()?;
        let all = match first {
            [] => last.clone(),
            first => format!("{} and {last}", first.join(", ")),
        };
        Some(format!(
            "not compared, as the configuration does not have them: {all} of the recording"
        ))
    }

    /// The same for programs.
    pub(super) fn rows(&self) -> Vec<MissingRow<'_>> {
        let tasks =
            self.tasks.iter().map(|(task, cycles)| MissingRow::Task { task, cycles: *cycles });
        let inputs = each(&self.inputs).map(|(task, input)| MissingRow::Input { task, input });
        let signals = each(&self.signals).map(|(task, signal)| MissingRow::Signal { task, signal });
        tasks.chain(inputs).chain(signals).collect()
    }
}

/// One of them.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum MissingRow<'a> {
    Task { task: &'a str, cycles: u64 },
    Input { task: &'a str, input: &'a str },
    Signal { task: &'a str, signal: &'a str },
}

/// Each name with its task.
fn each(by_task: &BTreeMap<String, BTreeSet<String>>) -> impl Iterator<Item = (&str, &str)> {
    by_task.iter().flat_map(|(task, names)| names.iter().map(move |name| (&**task, &**name)))
}

/// Names, of which there may be thousands.
pub(super) fn listed(names: &BTreeSet<String>) -> String {
    let shown: Vec<&str> = names.iter().take(SHOWN).map(String::as_str).collect();
    let shown = shown.join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        others => format!("{shown} and {others} more"),
    }
}
