//! What may stand together, and what is said of that which may not.

use alloc::format;
use alloc::string::String;

use crate::PinType;

/// The type of a part of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    Of(PinType),
    /// A whole number as it is written, such as 5 or 16#8200: an INT, an LREAL or a WORD, as what it meets.
    Whole,
}

/// What an operator or function takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Takes {
    /// LREAL or INT.
    Numbers,
    /// LREAL, INT or TIME.
    Quantities,
    /// Any type but BOOL, to compare which is more; a WORD by its bits.
    Ordered,
    /// BOOL or WORD.
    Bits,
    /// Any type.
    Any,
    One(PinType),
}

impl Takes {
    pub(super) fn takes(self, of: PinType) -> bool {
        match self {
            Self::Numbers => matches!(of, PinType::Lreal | PinType::Int),
            Self::Quantities => matches!(of, PinType::Lreal | PinType::Int | PinType::Time),
            Self::Ordered => of != PinType::Bool,
            Self::Bits => matches!(of, PinType::Bool | PinType::Word),
            Self::Any => true,
            Self::One(pin) => of.feeds(pin),
        }
    }

    pub(super) fn as_str(self) -> &'static str {
        match self {
            Self::Numbers => "numbers (LREAL or INT)",
            Self::Quantities => "LREAL, INT or TIME",
            Self::Ordered => "LREAL, INT, TIME or WORD",
            Self::Bits => "BOOL or WORD",
            Self::Any => "any type",
            Self::One(pin) => pin.as_str(),
        }
    }

    /// The way from a value of a type to what is taken.
    pub(super) fn help(self, of: PinType, shown: &str) -> Option<String> {
        use PinType::{Bool, Int, Lreal, Time, Word};
        Some(match (of, self) {
            (Bool, Self::Ordered) => {
                format!("BOOL is compared by = and <>; BOOL_TO_INT({shown}) is 0 or 1")
            }
            (Bool, Self::Numbers | Self::Quantities | Self::One(Int | Lreal)) => {
                format!("BOOL_TO_INT({shown}) is 0 or 1")
            }
            (Lreal | Int | Time, Self::One(Bool) | Self::Bits) => {
                let zero = if of == Time { "T#0s" } else { "0" };
                format!("compare it: {shown} > {zero}")
            }
            (Word, Self::One(Bool)) => format!("compare it: ({shown}) <> 16#0000"),
            (Time, Self::Numbers | Self::One(Lreal)) => {
                format!("TIME_TO_LREAL({shown}) is its milliseconds")
            }
            (Time, Self::One(Int)) => format!("TIME_TO_INT({shown}) is its milliseconds"),
            (Word, Self::Numbers | Self::Quantities | Self::One(Int | Lreal)) => {
                format!("WORD_TO_INT({shown}) has the same bits")
            }
            (Lreal, Self::One(Int)) => {
                format!("LREAL_TO_INT({shown}) rounds, TRUNC({shown}) drops the decimals")
            }
            (Lreal, Self::One(Time)) => format!("LREAL_TO_TIME({shown}) takes milliseconds"),
            (Int, Self::One(Time)) => {
                format!("INT_TO_TIME({shown}) takes milliseconds; a TIME is written T#2s")
            }
            (Int, Self::One(Word)) => format!("INT_TO_WORD({shown}) has the same bits"),
            (Bool, Self::One(Word)) => format!("BOOL_TO_WORD({shown}) is 0 or 1"),
            _ => return None,
        })
    }
}

/// Two types that do not stand together: the way out.
pub(super) fn help_between(left: PinType, right: PinType, shown: [&str; 2]) -> Option<String> {
    let [a, b] = shown;
    // The one that is further from a number is converted.
    let rank = |of| match of {
        PinType::Lreal => 0,
        PinType::Int => 1,
        PinType::Time => 2,
        PinType::Word => 3,
        PinType::Bool => 4,
    };
    if rank(left) > rank(right) {
        Takes::One(right).help(left, a)
    } else {
        Takes::One(left).help(right, b)
    }
}
