//! A configuration as written: every value with its place in the file, nothing resolved.
//!
//! A value that could not be read is `None`; the error about it is already on the list. That is
//! how all errors of a file are found in one go.

use isochrone_blocks::PinType;
use isochrone_model::Access;
use toml::Spanned;

use crate::TaskSettings;

/// A configuration file.
#[derive(Debug, Default)]
pub struct Config {
    /// Name of the node.
    pub node: Option<Spanned<String>>,
    /// What operators may do to the running node.
    pub control: Access,
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

/// The CPU of a task's thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// The best CPU at the time that the node starts.
    Auto {
        /// That CPU, once it is known.
        chosen: Option<u32>,
    },
    /// Any CPU; the kernel may move the thread.
    Any,
    /// This CPU.
    Number(u32),
}

impl Cpu {
    /// The choices that are written as a word.
    pub const WORDS: [Self; 2] = [Self::Auto { chosen: None }, Self::Any];

    /// The word that it is written as; `number` for a number.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Auto { .. } => "auto",
            Self::Any => "any",
            Self::Number(_) => "number",
        }
    }

    /// Whether it is chosen when the node starts.
    pub const fn is_auto(self) -> bool {
        matches!(self, Self::Auto { .. })
    }

    /// The CPU, if the configuration names it or it is chosen.
    pub const fn number(self) -> Option<u32> {
        match self {
            Self::Number(cpu) => Some(cpu),
            Self::Auto { chosen } => chosen,
            Self::Any => None,
        }
    }
}

impl std::fmt::Display for Cpu {
    /// The choice in the configuration, whatever CPU was chosen.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(cpu) => cpu.fmt(f),
            word => f.write_str(word.as_str()),
        }
    }
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

/// The value of a stale input.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum OnStale {
    /// The last value.
    #[default]
    Hold,
    /// The default.
    Default,
    /// The default, approached at this rate in units per second; and at the same rate it comes back
    /// to the samples.
    Ramp(f64),
}

impl OnStale {
    /// The choices that are words.
    pub const WORDS: [Self; 2] = [Self::Hold, Self::Default];

    /// The word in configurations: `hold`, `default`, and `ramp` where a rate belongs to it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Default => "default",
            Self::Ramp(_) => "ramp",
        }
    }
}

impl std::fmt::Display for OnStale {
    /// As a configuration says it, without quotation marks.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ramp(rate) => write!(f, "{{ ramp = {rate:?} }}"),
            word => f.write_str(word.as_str()),
        }
    }
}

/// How frames with doubtful flags, that is any but `FORCED`, are treated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Bad {
    /// As good ones: their samples are taken.
    #[default]
    Ignore,
    /// As missing: the input is stale until a good frame arrives.
    Stale,
}

impl Bad {
    /// Both choices.
    pub const ALL: [Self; 2] = [Self::Ignore, Self::Stale];

    /// The word in configurations: `ignore` or `stale`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Ignore => "ignore",
            Self::Stale => "stale",
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
    /// Connected input pins.
    pub pins: Pins,
    /// Input pins of single instances, by the number as it is written.
    pub instances: Vec<(Spanned<String>, Pins)>,
    /// Input pins that were written among the block's keys by mistake.
    pub misplaced_pins: Vec<String>,
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

/// A frame that the node publishes.
#[derive(Debug)]
pub struct Output {
    /// Service that carries it.
    pub service: Option<Spanned<String>>,
    /// Task whose cycles publish it.
    pub task: Option<Spanned<String>>,
    /// Its channels, in order.
    pub signals: Vec<Spanned<String>>,
}
