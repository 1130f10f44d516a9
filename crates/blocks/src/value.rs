//! The types of pins, and how a value of each stands in a slot of the process image.
//!
//! A slot is an `f64`. INT, TIME, BOOL and WORD are exact in it, so one contiguous `[f64]` holds
//! every pin of a task.

use core::slice::{Iter, IterMut};

/// Type of a pin, of an input or of a signal in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PinType {
    /// 64-bit floating point, any value.
    Lreal,
    /// 16-bit signed integer, -32768 to 32767.
    Int,
    /// FALSE (0) or TRUE (1).
    Bool,
    /// Time span in milliseconds, 32-bit signed.
    Time,
    /// 16-bit word, 0 to 65535; here a status word.
    Word,
}

impl PinType {
    /// All types, in the order in which documentation lists them.
    pub const ALL: [Self; 5] = [Self::Lreal, Self::Int, Self::Bool, Self::Time, Self::Word];

    /// The name that configuration, attributes and documentation use.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Lreal => "LREAL",
            Self::Int => "INT",
            Self::Bool => "BOOL",
            Self::Time => "TIME",
            Self::Word => "WORD",
        }
    }

    /// Smallest and largest value; LREAL has no bounds.
    pub const fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::Lreal => None,
            Self::Int => Some((i16::MIN as f64, i16::MAX as f64)),
            Self::Bool => Some((0.0, 1.0)),
            Self::Time => Some((i32::MIN as f64, i32::MAX as f64)),
            Self::Word => Some((0.0, u16::MAX as f64)),
        }
    }

    /// Whether a value of this type can be exactly `sample`. LREAL holds everything, NaN too: what
    /// a NaN means is for the block to say. The others hold whole numbers in their range.
    pub fn holds(self, sample: f64) -> bool {
        match self.range() {
            None => true,
            // A NaN fails the range check; the cast is exact for every value inside the range.
            Some((min, max)) => sample >= min && sample <= max && (sample as i64) as f64 == sample,
        }
    }

    /// Whether a wire from a source of this type may feed a pin of type `pin`.
    pub fn feeds(self, pin: Self) -> bool {
        self == pin || (self, pin) == (Self::Int, Self::Lreal)
    }
}

impl core::fmt::Display for PinType {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.as_str())
    }
}

/// A Rust type that a pin can have.
#[diagnostic::on_unimplemented(
    message = "a pin cannot have the type `{Self}`",
    note = "pins are f64 (LREAL), i16 (INT), i32 (TIME, in ms), bool (BOOL), u16 (WORD) or Ob (callOB)"
)]
pub trait PinValue: Copy {
    /// The pin type that it stands for.
    const TYPE: PinType;
    /// Whether the name of a task can stand at a pin of this type.
    const NAMES_TASK: bool = false;
    /// Reads it from a slot. A slot only ever holds what [`PinType::holds`] accepts.
    fn from_slot(slot: f64) -> Self;
    /// The slot's content for this value.
    fn into_slot(self) -> f64;
}

macro_rules! number {
    ($rust:ty, $pin:ident) => {
        impl PinValue for $rust {
            const TYPE: PinType = PinType::$pin;
            #[inline]
            fn from_slot(slot: f64) -> Self {
                slot as Self
            }
            #[inline]
            fn into_slot(self) -> f64 {
                self as f64
            }
        }
    };
}
number!(f64, Lreal);
number!(i16, Int);
number!(i32, Time);
number!(u16, Word);

impl PinValue for bool {
    const TYPE: PinType = PinType::Bool;
    #[inline]
    fn from_slot(slot: f64) -> Self {
        slot != 0.0
    }
    #[inline]
    fn into_slot(self) -> f64 {
        f64::from(u8::from(self))
    }
}

/// The cyclic-interrupt OB whose period is a block's sample time (LGF: `OB_CYCLIC`, an INT).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ob {
    /// The task that runs the block: what a `callOB` that nothing is connected to means.
    #[default]
    Caller,
    /// The task with this OB number.
    Number(i16),
    /// A task that was named and has no OB number: what a block needs of it.
    Task {
        /// Its configured period in nanoseconds, at most an hour.
        period_ns: u64,
    },
}

impl Ob {
    /// Slots from here on are periods. Every INT is a possible (wrong) OB number.
    const PERIODS: f64 = i16::MAX as f64 + 1.0;

    /// The slot's content. What is no number is no INT either, and configuration refuses it, so it
    /// cannot come from a constant or a wire.
    pub const fn slot(self) -> f64 {
        match self {
            Self::Caller => f64::NAN,
            Self::Number(number) => number as f64,
            Self::Task { period_ns } => Self::PERIODS + period_ns as f64,
        }
    }
}

impl PinValue for Ob {
    const TYPE: PinType = PinType::Int;
    const NAMES_TASK: bool = true;
    #[inline]
    fn from_slot(slot: f64) -> Self {
        if slot.is_nan() {
            Self::Caller
        } else if slot >= Self::PERIODS {
            Self::Task { period_ns: (slot - Self::PERIODS) as u64 }
        } else {
            Self::Number(slot as i16)
        }
    }
    #[inline]
    fn into_slot(self) -> f64 {
        self.slot()
    }
}

/// A Rust type that a block's private state can be made of: a number, a `bool`, or an array of what state can be
/// made of. All words zero is every type's initial value.
#[diagnostic::on_unimplemented(
    message = "private state cannot have the type `{Self}`",
    note = "state is made of f64, u64, u16, i16, i32 and bool, and of arrays of them, such as [f64; 16]"
)]
pub trait StateField: Copy {
    /// State words that it takes.
    const WORDS: usize;
    /// Takes it from the next state words; those that are missing are zero.
    fn take(words: &mut Iter<'_, u64>) -> Self;
    /// Puts it into the next state words.
    fn put(self, words: &mut IterMut<'_, u64>);
}

macro_rules! state_field {
    ($rust:ty, $from:expr, $into:expr) => {
        impl StateField for $rust {
            const WORDS: usize = 1;
            #[inline]
            fn take(words: &mut Iter<'_, u64>) -> Self {
                $from(words.next().copied().unwrap_or_default())
            }
            #[inline]
            fn put(self, words: &mut IterMut<'_, u64>) {
                if let Some(word) = words.next() {
                    *word = $into(self);
                }
            }
        }
    };
}
state_field!(f64, f64::from_bits, f64::to_bits);
state_field!(u64, core::convert::identity, core::convert::identity);
state_field!(bool, |word| word != 0, u64::from);
state_field!(u16, |word| word as u16, u64::from);
state_field!(i16, |word| word as i16, |value| value as u16 as u64);
state_field!(i32, |word| word as i32, |value| value as u32 as u64);

impl<T: StateField, const N: usize> StateField for [T; N] {
    const WORDS: usize = N * T::WORDS;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        core::array::from_fn(|_| T::take(words))
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        self.into_iter().for_each(|element| element.put(words));
    }
}

/// The pins of one direction, as a struct with a field for each. Made by [`block!`](crate::block!).
pub trait Slots: Copy + Default {
    /// Number of pins.
    const LEN: usize;
    /// Reads all pins from their slots, in the order of declaration.
    fn read(slots: &[f64]) -> Self;
    /// Reads the first pin, if there is one, from its slot.
    fn set_first(&mut self, slot: f64);
    /// Writes all pins to their slots.
    fn write(self, slots: &mut [f64]);
}

/// A block's private state, as a struct. Made by [`block!`](crate::block!).
pub trait Words: Copy + Default {
    /// Number of state words; an array has one for each element.
    const LEN: usize;
    /// Reads the state; words that are missing are zero, and all zero is the initial state.
    fn read(words: &[u64]) -> Self;
    /// Writes the state back.
    fn write(self, words: &mut [u64]);
}
