//! The metadata of a channel of rows: the values of a task's rows.

use std::collections::BTreeMap;
use std::ops::Range;

use isochrone_ipc::SignalSpec;
use serde::{Deserialize, Serialize};

use crate::carried::{ChannelFault, KEY_PERIOD, described, signals};
use crate::definitions;
use crate::spelling::{Field, Spelling};

/// What a node's recording keeps of each cycle of a task.
///
/// A row has the values of these [columns](Self::columns), in their order:
///
/// | column | is |
/// |---|---|
/// | `journal.entries` | how many journal entries tell of what was done to the task so far, expiries left out |
/// | `in.NAME`, `in.NAME.ok`, `in.NAME.age` | for each input what it read, forces left out |
/// | `from.TASK.cycle`, `from.TASK.changes` | for each task with wires to this one the cycle whose values were read (NaN: of none yet), and how many online changes it had had then |
/// | `flags.SERVICE`, `out.SERVICE.SIGNAL` | for each output the flags of its frame as a number, and its signals |
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TaskLayout {
    /// The node.
    #[serde(skip)]
    pub node: String,
    /// The task.
    #[serde(skip)]
    pub task: String,
    /// Its period, in ns.
    #[serde(skip)]
    pub period_ns: u64,
    /// Its inputs, in the order of the configuration.
    pub inputs: Vec<SignalSpec>,
    /// The tasks with wires to it.
    pub wires: Vec<String>,
    /// Its outputs, in the order of the configuration.
    pub outputs: Vec<OutputLayout>,
}

/// One output of a task.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OutputLayout {
    /// The service that carries it.
    pub service: String,
    /// Its signals, in the order of the frame.
    pub signals: Vec<SignalSpec>,
}

const KEY_NODE: &str = "isochrone.node";
const KEY_TASK: &str = "isochrone.task";
const KEY_LAYOUT: &str = "isochrone.layout";
/// Value, `ok` and age.
const INPUT_COLUMNS: usize = 3;
/// Cycle and changes.
const WIRE_COLUMNS: usize = 2;

impl TaskLayout {
    /// What the task is called among topics and marks: `node/task`.
    pub fn path(&self) -> String {
        format!("{}/{}", self.node, self.task)
    }

    /// The values of a row.
    pub fn columns(&self) -> Vec<SignalSpec> {
        let mut columns = vec![SignalSpec::new("journal.entries", "")];
        for SignalSpec { name, value_type, unit } in &self.inputs {
            columns.push(SignalSpec {
                name: format!("in.{name}"),
                value_type: value_type.clone(),
                unit: unit.clone(),
            });
            columns.push(SignalSpec::new(format!("in.{name}.ok"), "BOOL"));
            let age = SignalSpec::new(format!("in.{name}.age"), "LREAL");
            columns.push(SignalSpec { unit: "s".into(), ..age });
        }
        for task in &self.wires {
            let wire = ["cycle", "changes"];
            columns.extend(wire.map(|what| SignalSpec::new(format!("from.{task}.{what}"), "")));
        }
        for OutputLayout { service, signals } in &self.outputs {
            columns.push(SignalSpec::new(format!("flags.{service}"), ""));
            columns.extend(signals.iter().map(|signal| SignalSpec {
                name: format!("out.{service}.{}", signal.name),
                ..signal.clone()
            }));
        }
        columns
    }

    /// How many values a row has.
    pub fn len(&self) -> usize {
        let outputs = self.outputs.iter().map(|output| 1 + output.signals.len());
        self.outputs_begin() + outputs.sum::<usize>()
    }

    /// Whether rows have no values, which never is so.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where an input's value stands in a row, and behind it its `ok` and its age.
    pub fn input(&self, input: usize) -> usize {
        1 + INPUT_COLUMNS * input
    }

    /// Where the cycle of a task that wires come from stands in a row, and behind it its changes.
    pub fn wire(&self, wire: usize) -> usize {
        self.input(self.inputs.len()) + WIRE_COLUMNS * wire
    }

    fn outputs_begin(&self) -> usize {
        self.wire(self.wires.len())
    }

    /// Where an output's signals stand in a row; its flags stand before them. For all of them
    /// [`placed_outputs`](Self::placed_outputs) is faster: this passes over the outputs before it.
    pub fn output(&self, output: usize) -> Range<usize> {
        let behind = self.len() + 1;
        self.placed_outputs().nth(output).map_or(behind..behind, |(_, signals)| signals)
    }

    /// All outputs, and where their signals stand in a row; the flags of each stand before them.
    pub fn placed_outputs(&self) -> impl Iterator<Item = (&OutputLayout, Range<usize>)> {
        let mut end = self.outputs_begin();
        self.outputs.iter().map(move |output| {
            let first = end + 1;
            end = first + output.signals.len();
            (output, first..end)
        })
    }

    pub(crate) fn spelling(&self) -> Spelling {
        Spelling::new(&self.path(), &self.columns(), definitions::TASK)
    }

    pub(crate) fn metadata(&self, fields: &[Field]) -> BTreeMap<String, String> {
        let mut metadata = described(&self.columns(), fields);
        // Strings and numbers always have a JSON.
        let layout = serde_json::to_string(self).unwrap_or_default();
        metadata.extend([
            (KEY_NODE.to_owned(), self.node.clone()),
            (KEY_TASK.to_owned(), self.task.clone()),
            (KEY_PERIOD.to_owned(), self.period_ns.to_string()),
            (KEY_LAYOUT.to_owned(), layout),
        ]);
        metadata
    }

    /// Reads it back, with the place of each value; `None` if it is no channel of a task.
    pub(crate) fn from_metadata(
        metadata: &BTreeMap<String, String>,
    ) -> Option<Result<(Self, Vec<usize>), ChannelFault>> {
        let (node, task) = (metadata.get(KEY_NODE)?, metadata.get(KEY_TASK)?);
        let read = || {
            let (columns, places) = signals(metadata)?;
            let known = |key| metadata.get(key).ok_or(ChannelFault::Malformed);
            let layout: Self =
                serde_json::from_str(known(KEY_LAYOUT)?).map_err(|_| ChannelFault::Malformed)?;
            let period_ns = known(KEY_PERIOD)?.parse().map_err(|_| ChannelFault::Malformed)?;
            // The names are not compared: together they may be far longer than what they are made of.
            if columns.len() != layout.len() {
                return Err(ChannelFault::Malformed);
            }
            let (node, task) = (node.clone(), task.clone());
            Ok((Self { node, task, period_ns, ..layout }, places))
        };
        Some(read())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> TaskLayout {
        let signal = |name: &str| SignalSpec::new(name, "LREAL");
        TaskLayout {
            node: "level".into(),
            task: "fast".into(),
            period_ns: 1_000_000,
            inputs: vec![signal("target"), signal("flow")],
            wires: vec!["slow".into()],
            outputs: vec![
                OutputLayout { service: "plant/level".into(), signals: vec![signal("ramp.y")] },
                OutputLayout {
                    service: "plant/both".into(),
                    signals: vec![signal("ramp.y"), signal("target")],
                },
            ],
        }
    }

    #[test]
    fn the_columns_stand_where_they_are_looked_for() {
        let layout = layout();
        let columns = layout.columns();
        assert_eq!(columns.len(), layout.len());
        let names = |places: Range<usize>| -> Vec<&str> {
            columns[places].iter().map(|column| column.name.as_str()).collect()
        };
        let input = layout.input(1);
        assert_eq!(names(input..input + 3), ["in.flow", "in.flow.ok", "in.flow.age"]);
        let wire = layout.wire(0);
        assert_eq!(names(wire..wire + 2), ["from.slow.cycle", "from.slow.changes"]);
        let output = layout.output(1);
        assert_eq!(names(output.start - 1..output.start), ["flags.plant/both"]);
        assert_eq!(names(output), ["out.plant/both.ramp.y", "out.plant/both.target"]);
    }

    #[test]
    fn a_layout_reads_back_and_one_that_contradicts_its_columns_is_refused() {
        let layout = layout();
        let spelling = layout.spelling();
        let mut metadata = layout.metadata(&spelling.fields);
        let (read, places) = TaskLayout::from_metadata(&metadata).unwrap().unwrap();
        assert_eq!((read, places.len()), (layout.clone(), layout.len()));
        let other = TaskLayout { wires: Vec::new(), ..layout };
        let json = serde_json::to_string(&other).unwrap();
        metadata.insert(KEY_LAYOUT.into(), json);
        assert_eq!(TaskLayout::from_metadata(&metadata), Some(Err(ChannelFault::Malformed)));
    }
}
