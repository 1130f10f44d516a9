//! The contents of a node's recording: its identity, rows of its tasks, entries of its journal.

use std::collections::BTreeMap;

use mcap::records::Metadata;

use crate::TaskLayout;

/// The node that a recording is of.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordedNode {
    /// Its name.
    pub name: String,
    /// Version of the program that ran it.
    pub version: String,
    /// File of its configuration, as it was started with; the text is in the recording.
    pub file: String,
}

/// Name of the metadata.
const NAME: &str = "isochrone.node";

impl RecordedNode {
    pub(crate) fn metadata(&self) -> Metadata {
        let Self { name, version, file } = self;
        let entries = [("node", name), ("version", version), ("file", file)];
        let metadata = entries.map(|(key, value)| (key.to_owned(), value.clone())).into();
        Metadata { name: NAME.into(), metadata }
    }

    pub(crate) fn from_metadata(name: &str, metadata: &BTreeMap<String, String>) -> Option<Self> {
        let text = |key| metadata.get(key).cloned();
        (name == NAME).then_some(())?;
        Some(Self {
            name: text("node")?,
            version: text("version").unwrap_or_default(),
            file: text("file").unwrap_or_default(),
        })
    }
}

/// When a cycle of a task was due and ran. Times are of `CLOCK_MONOTONIC` of the node's machine, in ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RowHead {
    /// Index on the task's grid.
    pub cycle: u64,
    /// When it was due.
    pub release_ns: u64,
    /// When it began.
    pub start_ns: u64,
    /// When its frames were sent.
    pub end_ns: u64,
    /// Releases that were missed since the start.
    pub missed: u64,
    /// How many rows were lost immediately before it: those cycles ran, and nothing is known of them.
    pub lost: u64,
}

/// A row that was read from a file.
#[derive(Debug)]
pub struct RecordedRow<'a> {
    /// Which channel of the file it is from.
    pub channel: u16,
    /// Which values it has.
    pub layout: &'a TaskLayout,
    /// When its cycle ran.
    pub head: RowHead,
    /// The values of the layout's columns.
    pub values: &'a [f64],
    /// When the cycle was due, in Unix ns.
    pub release_unix_ns: u64,
    /// When its frames were sent, in Unix ns.
    pub end_unix_ns: u64,
}

/// The value and the quality of an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordedInput {
    /// Its value.
    pub value: f64,
    /// Its `ok`.
    pub ok: bool,
    /// Its age, in seconds.
    pub age_s: f64,
}

/// Which values of another task a cycle read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedWire {
    /// The cycle that computed them.
    pub cycle: u64,
    /// How many online changes that task had had.
    pub changes: u64,
}

impl RecordedRow<'_> {
    /// How many entries of the journal tell of what was done to the task so far.
    pub fn entries(&self) -> u64 {
        self.value(0) as u64
    }

    /// The value and the quality of an input, by its index in the layout.
    pub fn input(&self, input: usize) -> RecordedInput {
        let at = self.layout.input(input);
        let ok = self.value(at + 1) != 0.0;
        RecordedInput { value: self.value(at), ok, age_s: self.value(at + 2) }
    }

    /// Which values of a task were read that wires come from, by its place in the layout; `None`: it had
    /// finished no cycle yet.
    pub fn wire(&self, wire: usize) -> Option<RecordedWire> {
        let at = self.layout.wire(wire);
        let cycle = Some(self.value(at)).filter(|cycle| !cycle.is_nan())? as u64;
        Some(RecordedWire { cycle, changes: self.value(at + 1) as u64 })
    }

    /// The flags of an output's frame, by its place in the layout.
    pub fn flags(&self, output: usize) -> u64 {
        self.value(self.layout.output(output).start - 1) as u64
    }

    /// The signals of an output, by its place in the layout.
    pub fn output(&self, output: usize) -> &[f64] {
        self.values.get(self.layout.output(output)).unwrap_or_default()
    }

    /// The flags of each output's frame and its signals, in the order of the layout.
    pub fn outputs(&self) -> impl Iterator<Item = (u64, &[f64])> {
        self.layout.placed_outputs().map(|(_, place)| {
            let flags = self.value(place.start - 1) as u64;
            (flags, self.values.get(place).unwrap_or_default())
        })
    }

    fn value(&self, place: usize) -> f64 {
        self.values.get(place).copied().unwrap_or(f64::NAN)
    }
}

/// An entry of a node's journal: a message on `/isochrone/journal`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordedEntry {
    /// When that was known, in ns of the node's `CLOCK_MONOTONIC`.
    pub time_ns: u64,
    /// The first cycle of the task with it.
    pub cycle: u64,
    /// The task.
    pub task: String,
    /// The line of the journal file that says it: JSON, `{"entry": {…}}`.
    pub line: String,
}
