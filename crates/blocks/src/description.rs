//! The description of a block: its pins, its status words, decisions and cautions.

use crate::{Ob, PinType, Slots, Words};

/// One pin, as the catalogue shows it.
#[derive(Clone, Copy, Debug)]
pub struct Pin {
    /// LGF's spelling.
    pub name: &'static str,
    /// Type of its value.
    pub pin_type: PinType,
    /// Unit of its value; empty where it has none or takes that of another pin.
    pub unit: &'static str,
    /// What an input reads when nothing is connected; meaningless for an output.
    pub default: PinDefault,
    /// Whether it is an `OB_CYCLIC`, at which the name of a task can stand.
    pub names_task: bool,
    /// Other names that the documents have for it.
    pub aliases: &'static [&'static str],
    /// The BOOL input without which it is read in the first call only; `None`: read in every call.
    pub latched_by: Option<&'static str>,
    #[doc(hidden)]
    pub raw_doc: &'static str,
}

impl Pin {
    /// What it means, in a sentence.
    pub fn doc(&self) -> &'static str {
        self.raw_doc.trim_ascii()
    }
}

/// What an input pin reads when nothing is connected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PinDefault {
    /// Nothing: the pin must be connected.
    Required,
    /// A value of the pin's type, as it stands in a slot.
    Value(f64),
    /// The task that runs the block.
    CallingTask,
}

impl PinDefault {
    /// The slot's content; `None` if the pin must be connected.
    pub const fn slot(self) -> Option<f64> {
        match self {
            Self::Required => None,
            Self::Value(slot) => Some(slot),
            Self::CallingTask => Some(Ob::Caller.slot()),
        }
    }

    #[doc(hidden)]
    pub const fn of_ob(ob: Ob) -> Self {
        match ob {
            Ob::Caller => Self::CallingTask,
            Ob::Number(_) | Ob::Task { .. } => Self::Value(ob.slot()),
        }
    }
}

/// A word that an output pin `status` can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusWord {
    /// The word; an error from `16#8000` on.
    pub code: u16,
    /// Name of the constant, such as `STATUS_FINISHED_NO_ERROR`.
    pub name: &'static str,
    /// Whose word it is.
    pub origin: Origin,
    /// What it means.
    pub meaning: &'static str,
}

/// Who defines a status word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The document that the block follows.
    Document,
    /// This implementation; the document does not have it.
    Ours,
}

/// What a block does where the document that it follows is silent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decision {
    /// What the document does not say.
    pub silent_on: &'static str,
    /// What was chosen.
    pub chosen: &'static str,
}

/// What people should know of an instance while it lasts, though it is no error: an alarm of a node, and
/// where constants lead to it, a note of `check`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Caution {
    /// Its code among alarms, such as `limits_off`.
    pub code: &'static str,
    /// What is so, as part of a sentence about the block.
    pub meaning: &'static str,
    /// What is so when it is over, likewise.
    pub over: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// What [`block!`](crate::block!) derives from a block's declaration.
pub trait Declaration {
    /// The input pins.
    type Inputs: Slots;
    /// The output pins.
    type Outputs: Slots;
    /// The private state.
    type State: Words;
    /// Words of the buffer, which is part of the state and is not copied in a step.
    const BUFFER: usize = 0;
    /// Name of the type in a configuration.
    const NAME: &'static str;
    /// What it computes.
    const DOC: &'static str;
    /// The document that it follows.
    const FOLLOWS: Option<&'static str>;
    /// Input pins in order.
    const INPUTS: &'static [Pin];
    /// Output pins in order.
    const OUTPUTS: &'static [Pin];
    /// How it computes its outputs, in sentences.
    const COMPUTES: &'static [&'static str];
    /// Status words.
    const STATUS: &'static [StatusWord];
    /// What was chosen where the document that it follows is silent.
    const DECISIONS: &'static [Decision];

    /// Whether the outputs report an error: `status` is `16#8000` or above or, in a block without
    /// `status`, `error` is TRUE.
    fn is_error(outputs: &Self::Outputs) -> bool;
}
