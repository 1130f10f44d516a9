//! A configuration as written: every value with its place in the file, nothing resolved.
//!
//! A value that could not be read is `None`; the error about it is already on the list. That is
//! how all errors of a file are found in one go.

mod choices;
mod formula;

use isochrone_blocks::PinType;
use isochrone_model::{Access, AlarmSeverity};
use toml::Spanned;

use crate::TaskSettings;

pub use choices::{Bad, Cpu, OnDamaged, OnStale, OnWarmStart, Retain};
pub use formula::{Formula, Text};

/// A configuration file.
#[derive(Debug, Default)]
pub struct Config {
    /// Name of the node.
    pub node: Option<Spanned<String>>,
    /// What operators may do to the running node.
    pub control: Access,
    /// What is retained over a restart; `None`: nothing.
    pub retain: Option<Retain>,
    /// Names and patterns of all `[[protect]]`.
    pub protected: Vec<Spanned<String>>,
    /// `[limits]`
    pub limits: Vec<Limit>,
    /// `[[task]]`
    pub tasks: Vec<Task>,
    /// `[[input]]`
    pub inputs: Vec<Input>,
    /// `[[variable]]`
    pub variables: Vec<Variable>,
    /// `[[block]]`
    pub blocks: Vec<BlockEntry>,
    /// `[[alarm]]`
    pub alarms: Vec<AlarmSection>,
    /// `[[output]]`
    pub outputs: Vec<Output>,
}

/// Bounds of parameters and variables.
#[derive(Debug)]
pub struct Limit {
    /// Name of a parameter or a variable, or a pattern of such names.
    pub names: Spanned<String>,
    /// Smallest and largest value.
    pub range: Option<Spanned<(f64, f64)>>,
}

/// A cyclic task.
#[derive(Debug)]
pub struct Task {
    /// Unique name.
    pub name: Option<Spanned<String>>,
    /// Place of its OB number, for an error about one that is taken.
    pub ob_span: std::ops::Range<usize>,
    /// All other keys.
    pub settings: TaskSettings,
}

/// A value that another process publishes.
#[derive(Debug)]
pub struct Input {
    /// Unique name.
    pub name: Option<Spanned<String>>,
    /// Type of its samples.
    pub value_type: Option<PinType>,
    /// Service that carries it.
    pub service: Option<Spanned<String>>,
    /// Where it is in the service's frame.
    pub binding: Binding,
    /// Task that reads it.
    pub task: Option<Spanned<String>>,
    /// Value before the first sample.
    pub default: Option<Spanned<f64>>,
    /// Smallest and largest sample that it takes.
    pub range: Option<(f64, f64)>,
    /// It takes neither NaN nor infinity.
    pub finite: bool,
    /// Age beyond which it is stale.
    pub max_age_ns: Option<u64>,
    /// The value of a stale input.
    pub on_stale: OnStale,
    /// How frames with doubtful flags are treated.
    pub bad: Bad,
    /// The input closes a loop of nodes: the quality of its samples is not passed on.
    pub feedback: Option<Spanned<bool>>,
    /// Unit of its value.
    pub unit: Option<String>,
    /// What it is, for people.
    pub comment: Option<String>,
}

/// How an input finds its value in a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Binding {
    /// By its place, from 0.
    Channel(usize),
    /// By the name that the publisher announces for it.
    Signal(String),
}

impl std::fmt::Display for Binding {
    /// The place or the name.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Channel(channel) => channel.fmt(f),
            Self::Signal(signal) => signal.fmt(f),
        }
    }
}

/// A value that operators give.
#[derive(Debug)]
pub struct Variable {
    /// Unique name.
    pub name: Option<Spanned<String>>,
    /// Its type.
    pub value_type: Option<PinType>,
    /// Task that it belongs to.
    pub task: Option<Spanned<String>>,
    /// Value until an operator sets another.
    pub initial: Option<Spanned<f64>>,
    /// Smallest and largest value.
    pub range: Option<Spanned<(f64, f64)>>,
    /// Its unit.
    pub unit: Option<String>,
    /// What it is for, for people.
    pub comment: Option<String>,
}

/// One or more instances of a block.
#[derive(Debug)]
pub struct BlockEntry {
    /// Unique name.
    pub name: Option<Spanned<String>>,
    /// BlockEntry type.
    pub block_type: Option<Spanned<String>>,
    /// Task that runs it.
    pub task: Option<Spanned<String>>,
    /// Number of instances.
    pub count: Option<Spanned<u32>>,
    /// There is a count, but none that could be read.
    pub count_is_wrong: bool,
    /// Unit of its main output.
    pub unit: Option<Spanned<String>>,
    /// Units of pins by name.
    pub units: Vec<(Spanned<String>, String)>,
    /// What it is for, for people.
    pub comment: Option<String>,
    /// Connected input pins.
    pub pins: Pins,
    /// Input pins of single instances, by the number as it is written.
    pub instances: Vec<(Spanned<String>, Pins)>,
    /// Input pins that were written among the block's keys by mistake.
    pub misplaced_pins: Vec<String>,
    /// The outputs of an `Expr`, in file order.
    pub formulas: Vec<Formula>,
}

/// Input pins by name, with their connections.
pub type Pins = Vec<(Spanned<String>, Option<Spanned<Connection>>)>;

/// The constant or wire at an input pin.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Connection {
    /// A whole number.
    Integer(i64),
    /// A decimal number.
    Float(f64),
    /// TRUE or FALSE.
    Bool(bool),
    /// An input or a block's output pin; at a TIME pin also a time such as `T#100ms`, at `callOB`
    /// also the name of a task.
    Wire(String),
}

/// A condition that people should know of.
#[derive(Debug)]
pub struct AlarmSection {
    /// Unique name.
    pub name: Option<Spanned<String>>,
    /// The condition.
    pub when: Option<Formula>,
    /// For how long it must hold.
    pub delay_ns: u64,
    /// How far the signal must come back.
    pub hysteresis: f64,
    /// What it asks of people.
    pub severity: AlarmSeverity,
    /// What it says to people.
    pub text: Option<String>,
    /// Task that evaluates it.
    pub task: Option<Spanned<String>>,
}

/// A frame that the node publishes.
#[derive(Debug)]
pub struct Output {
    /// Service that carries it.
    pub service: Option<Spanned<String>>,
    /// Task whose cycles publish it.
    pub task: Option<Spanned<String>>,
    /// Its channels, in order.
    pub signals: Vec<Spanned<String>>,
    /// Unit of those of its signals that have none of their own.
    pub unit: Option<Spanned<String>>,
    /// How many readers its service is to have places for.
    pub readers: Option<usize>,
    /// What it is for, for people.
    pub comment: Option<String>,
}
