//! Values as operators write and read them.

use std::fmt;

use isochrone_blocks::{Ob, PinType, PinValue as _};

use crate::format_duration_ns;

/// A value that a signal is given, or has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// TRUE or FALSE.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Number(f64),
    /// The task that runs the block, at a `callOB`.
    CallingTask,
    /// A task without a number, at a `callOB`: the period that the block takes from it.
    Task {
        /// In nanoseconds.
        period_ns: u64,
    },
}

impl Value {
    /// The value that stands in a slot.
    pub fn of(slot: f64, value_type: PinType) -> Self {
        match value_type {
            PinType::Int if !value_type.holds(slot) => match Ob::from_slot(slot) {
                Ob::Caller => Self::CallingTask,
                Ob::Task { period_ns } => Self::Task { period_ns },
                Ob::Number(number) => Self::Integer(number.into()),
            },
            _ if slot.is_nan() => Self::Number(slot),
            PinType::Bool => Self::Bool(slot != 0.0),
            PinType::Lreal => Self::Number(slot),
            PinType::Int | PinType::Time | PinType::Word => Self::Integer(slot as i64),
        }
    }

    /// How a slot of this type holds the value; `None` if the type does not have it. A BOOL takes
    /// `true` and `false`; INT, TIME and WORD take whole numbers in their range; an LREAL takes every
    /// number but NaN.
    pub fn slot(self, value_type: PinType) -> Option<f64> {
        match (value_type, self) {
            (PinType::Bool, Self::Bool(value)) => Some(f64::from(u8::from(value))),
            (PinType::Bool, _) | (_, Self::Bool(_)) => None,
            // Only a pin that names a task has them.
            (_, Self::CallingTask | Self::Task { .. }) => None,
            (PinType::Lreal, Self::Number(value)) => Some(value).filter(|value| !value.is_nan()),
            (_, Self::Number(value)) => Some(value).filter(|value| value_type.holds(*value)),
            (_, Self::Integer(value)) => {
                Some(value as f64).filter(|value| value_type.holds(*value))
            }
        }
    }
}

impl fmt::Display for Value {
    /// As a configuration writes it; a task without a number has its period here.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Number(value) => write!(f, "{value:?}"),
            Self::CallingTask => f.write_str("nan"),
            Self::Task { period_ns } => f.write_str(&format_duration_ns(*period_ns)),
        }
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Self::Integer(value)
    }
}

impl From<i32> for Value {
    fn from(value: i32) -> Self {
        Self::Integer(value.into())
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_takes_its_own_values_only() {
        let rows: [(PinType, Value, Option<f64>); 14] = [
            (PinType::Bool, true.into(), Some(1.0)),
            (PinType::Bool, 1.into(), None),
            (PinType::Bool, 1.0.into(), None),
            (PinType::Int, 7.into(), Some(7.0)),
            (PinType::Int, 7.0.into(), Some(7.0)),
            (PinType::Int, 7.5.into(), None),
            (PinType::Int, 40_000.into(), None),
            (PinType::Int, true.into(), None),
            (PinType::Time, (-5).into(), Some(-5.0)),
            (PinType::Word, (-5).into(), None),
            (PinType::Lreal, 7.into(), Some(7.0)),
            (PinType::Lreal, f64::INFINITY.into(), Some(f64::INFINITY)),
            (PinType::Lreal, f64::NAN.into(), None),
            (PinType::Lreal, true.into(), None),
        ];
        for (value_type, value, slot) in rows {
            assert_eq!(value.slot(value_type), slot, "{value} as {value_type}");
        }
    }

    #[test]
    fn a_value_that_was_read_can_be_written_again() {
        for value_type in PinType::ALL {
            for slot in [0.0, 1.0] {
                assert_eq!(Value::of(slot, value_type).slot(value_type), Some(slot));
            }
        }
    }
}
