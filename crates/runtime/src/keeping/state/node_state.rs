//! The retained state of a node, and its bytes in a file.
//!
//! A file is a magic, the version of the format, the length of the rest, its CRC-32, and the rest: the length of a
//! header in JSON, the header, and for each task the words of its image and of its private state. All numbers are
//! little-endian, so a state may move to another machine.

use isochrone_blocks::PinType;
use isochrone_control::desk::{AlarmRecord, RetainedValue, Signals};
use isochrone_engine::{Plan, TaskPlan, TaskState};
use isochrone_model::{Role, Value};
use serde::{Deserialize, Serialize, Serializer};

use super::error::DamagedState;
use crate::task::snapshots::signals;

const MAGIC: [u8; 8] = *b"ISOSTATE";
/// The version of the format that is written.
pub const STATE_VERSION: u32 = 1;
/// Magic, version, CRC-32 and length.
pub(super) const PREFIX_BYTES: usize = 24;

/// The retained state of a node: what its configuration cannot give.
/// It serializes as the header of its file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct NodeState {
    /// The node.
    pub node: String,
    /// When it was written, in ns since 1970.
    pub unix_ns: u64,
    /// Whether it was written at the end of the node, after the last cycle of every task.
    pub is_final: bool,
    /// The term with which the process held the node that wrote it; `None`: the node had one process.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub term: Option<u64>,
    /// The configuration's file, and its text: the names of all values follow from it.
    pub file: String,
    /// The text of that configuration.
    pub configuration: String,
    /// Parameters and variables that were set and not undone.
    pub tuned: Vec<RetainedValue>,
    /// Process alarms that were ever active, with what was acknowledged.
    #[serde(default)]
    pub alarms: Vec<AlarmRecord>,
    /// Its tasks, in the order of the configuration. A task whose state is not retained has none.
    #[serde(serialize_with = "headers", skip_deserializing)]
    pub tasks: Vec<Option<RetainedTask>>,
}

/// What is retained of a task.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RetainedTask {
    /// When it had this state, in ns since 1970.
    pub unix_ns: u64,
    /// A checksum of its blocks, as the program that wrote it has them.
    pub layout: u32,
    /// The state.
    pub state: TaskState,
}

impl RetainedTask {
    /// The state of a task at this time.
    pub fn new(unix_ns: u64, layout: u32, state: TaskState) -> Self {
        Self { unix_ns, layout, state }
    }
}

/// A checksum of the types, pins and memory of a task's blocks, in their order: with another one, the words of a state
/// mean something else.
pub(crate) fn layout_of(task: &TaskPlan) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for bank in &task.banks {
        let block_type = bank.block_type;
        let counts = [bank.instances.len(), block_type.state_words, block_type.inputs.len()];
        counts.iter().for_each(|count| hasher.update(&(*count as u64).to_le_bytes()));
        hasher.update(block_type.name.as_bytes());
        for pin in block_type.inputs.iter().chain(block_type.outputs) {
            hasher.update(format!(" {} {}", pin.name, pin.pin_type).as_bytes());
        }
    }
    hasher.finalize()
}

/// A value in a state.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct StateValue {
    /// The signal.
    pub name: String,
    /// Its type.
    pub value_type: PinType,
    /// The value.
    pub value: Value,
}

impl StateValue {
    /// The value of a signal.
    pub fn new(name: String, value_type: PinType, value: Value) -> Self {
        Self { name, value_type, value }
    }
}

/// What the header says of a task, whose words come behind it.
#[derive(Serialize, Deserialize)]
struct TaskHeader {
    unix_ns: u64,
    layout: u32,
    cycle: Option<u64>,
    image: usize,
    state: usize,
}

#[derive(Deserialize)]
struct TaskHeaders {
    tasks: Vec<Option<TaskHeader>>,
}

fn headers<S: Serializer>(tasks: &[Option<RetainedTask>], to: S) -> Result<S::Ok, S::Error> {
    let header = |task: &RetainedTask| TaskHeader {
        unix_ns: task.unix_ns,
        layout: task.layout,
        cycle: task.state.cycle,
        image: task.state.image.len(),
        state: task.state.state.len(),
    };
    to.collect_seq(tasks.iter().map(|task| task.as_ref().map(header)))
}

impl NodeState {
    /// The bytes of its file.
    pub fn to_bytes(&self) -> Vec<u8> {
        // Strings and numbers only: nothing in it can fail.
        let header = serde_json::to_vec(self).unwrap_or_default();
        let words = self.tasks.iter().flatten().flat_map(|RetainedTask { state, .. }| {
            let image = state.image.iter().map(|value| value.to_bits());
            image.chain(state.state.iter().copied())
        });
        let mut bytes = vec![0; PREFIX_BYTES];
        bytes.extend((header.len() as u64).to_le_bytes());
        bytes.extend(header);
        words.for_each(|word| bytes.extend(word.to_le_bytes()));
        let (prefix, rest) = bytes.split_at_mut(PREFIX_BYTES);
        let crc = crc32fast::hash(rest);
        let parts = [&MAGIC[..], &STATE_VERSION.to_le_bytes(), &crc.to_le_bytes()].concat();
        let length = (rest.len() as u64).to_le_bytes();
        prefix.copy_from_slice(&[&parts[..], &length].concat());
        bytes
    }

    /// The values of inputs, variables and outputs; `plan` is that of the state's
    /// [configuration](Self::configuration).
    pub fn values(&self, plan: &Plan) -> Vec<StateValue> {
        let names = Signals::of(plan);
        let is_shown = |role| matches!(role, Role::Input | Role::Variable | Role::Output);
        let of_task = |(task, (plan, state)): (usize, (&TaskPlan, &Option<RetainedTask>))| {
            let value = |(slot, _): (usize, _)| {
                let signal = names.at(task, slot).filter(|signal| is_shown(signal.role))?;
                let value = Value::of(*state.as_ref()?.state.image.get(slot)?, signal.value_type);
                Some(StateValue::new(signal.name, signal.value_type, value))
            };
            signals(plan).filter_map(value).collect::<Vec<_>>()
        };
        plan.tasks.iter().zip(&self.tasks).enumerate().flat_map(of_task).collect()
    }

    /// How long a file is that begins with these bytes.
    ///
    /// # Errors
    /// It is no state of a version that this program knows.
    pub(super) fn length_of(prefix: &[u8]) -> Result<u64, DamagedState> {
        let (_, length) = Self::prefix(&mut Bytes(prefix))?;
        Ok((PREFIX_BYTES as u64).saturating_add(length))
    }

    /// CRC-32 and length of what follows the first bytes of a file.
    fn prefix(bytes: &mut Bytes<'_>) -> Result<(u32, u64), DamagedState> {
        if bytes.take()? != MAGIC {
            return Err(DamagedState::NoState);
        }
        let version = u32::from_le_bytes(bytes.take()?);
        if version != STATE_VERSION {
            return Err(DamagedState::Version { found: version, known: STATE_VERSION });
        }
        let crc = u32::from_le_bytes(bytes.take()?);
        Ok((crc, u64::from_le_bytes(bytes.take()?)))
    }

    /// The state in the bytes of a file.
    ///
    /// # Errors
    /// They are not a whole state of a version that this program knows.
    pub fn of_bytes(bytes: &[u8]) -> Result<Self, DamagedState> {
        let mut rest = Bytes(bytes);
        let (crc, length) = Self::prefix(&mut rest)?;
        if length != rest.0.len() as u64 {
            return Err(DamagedState::Truncated);
        }
        if crc32fast::hash(rest.0) != crc {
            return Err(DamagedState::Checksum);
        }
        let length = u64::from_le_bytes(rest.take()?);
        let length = usize::try_from(length).map_err(|_| DamagedState::Truncated)?;
        let header = rest.0.get(..length).ok_or(DamagedState::Truncated)?;
        rest.0 = rest.0.get(length..).unwrap_or_default();
        let unreadable = |cause: serde_json::Error| DamagedState::Header(cause.to_string());
        let state: Self = serde_json::from_slice(header).map_err(unreadable)?;
        let TaskHeaders { tasks } = serde_json::from_slice(header).map_err(unreadable)?;
        let mut task = |task: TaskHeader| {
            let image = rest.words(task.image)?.map(f64::from_bits).collect();
            let state = TaskState::new(task.cycle, image, rest.words(task.state)?.collect());
            Ok(RetainedTask::new(task.unix_ns, task.layout, state))
        };
        let tasks = tasks.into_iter().map(|of| of.map(&mut task).transpose());
        let tasks = tasks.collect::<Result<_, DamagedState>>()?;
        if !rest.0.is_empty() {
            return Err(DamagedState::Truncated);
        }
        Ok(Self { tasks, ..state })
    }
}

/// Bytes that are read from their start.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], DamagedState> {
        let (bytes, rest) = self.0.split_first_chunk().ok_or(DamagedState::Truncated)?;
        self.0 = rest;
        Ok(*bytes)
    }

    fn words(&mut self, count: usize) -> Result<impl Iterator<Item = u64> + use<'a>, DamagedState> {
        let bytes = count.checked_mul(size_of::<u64>());
        let split = bytes.and_then(|bytes| self.0.split_at_checked(bytes));
        let (words, rest) = split.ok_or(DamagedState::Truncated)?;
        self.0 = rest;
        let (words, _) = words.as_chunks();
        Ok(words.iter().map(|word| u64::from_le_bytes(*word)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn state() -> NodeState {
        let task = TaskState::new(Some(7), [1.5, f64::NAN, -0.0].into(), [u64::MAX, 3].into());
        NodeState {
            node: "level".to_owned(),
            unix_ns: 1_700_000_000_000_000_000,
            is_final: true,
            term: Some(7),
            file: "level.toml".to_owned(),
            configuration: "[node]\nname = \"level\"\n".to_owned(),
            tuned: vec![
                serde_json::from_str(r#"{"name":"ramp.x","type":"INT","value":5,"constant":6}"#)
                    .unwrap(),
            ],
            alarms: vec![AlarmRecord { occurrence: 3, ..AlarmRecord::default() }],
            tasks: vec![Some(RetainedTask::new(7, 8, task)), None],
        }
    }

    #[test]
    fn what_is_read_is_what_was_written_to_the_bit() {
        let bytes = state().to_bytes();
        let read = NodeState::of_bytes(&bytes).unwrap();
        assert_eq!(read.to_bytes(), bytes);
        let bits = |state: &NodeState| -> Vec<u64> {
            let image = state.tasks[0].iter().flat_map(|of| &of.state.image);
            image.map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(&read), bits(&state()));
        assert_eq!((read.node, read.tuned), (state().node, state().tuned));
        assert_eq!(read.alarms, state().alarms);
    }

    #[test]
    fn a_state_that_is_cut_anywhere_is_damaged() {
        let bytes = state().to_bytes();
        for length in 0..bytes.len() {
            NodeState::of_bytes(&bytes[..length]).unwrap_err();
        }
        NodeState::of_bytes(&[&bytes[..], &[0]].concat()).unwrap_err();
    }

    #[test]
    fn a_state_with_any_bit_flipped_is_damaged() {
        let bytes = state().to_bytes();
        for bit in 0..bytes.len() * 8 {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            NodeState::of_bytes(&flipped).unwrap_err();
        }
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(rest: Vec<u8>) {
            let crc = crc32fast::hash(&rest).to_le_bytes();
            let length = (rest.len() as u64).to_le_bytes();
            let version = STATE_VERSION.to_le_bytes();
            let whole = [&MAGIC[..], &version, &crc, &length, &rest].concat();
            let _ = NodeState::of_bytes(&whole);
            let _ = NodeState::of_bytes(&rest);
        }
    }
}
