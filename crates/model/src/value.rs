//! Values of signals, as operators write and read them.

use std::fmt;

use isochrone_blocks::{Ob, PinType, PinValue as _};
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{format_duration_ns, parse_duration_ns};

/// The value of a signal: BOOL `true` or `false`; INT, TIME (ms) and WORD integers; LREAL any number, and
/// the strings `"NaN"`, `"inf"` and `"-inf"`; a `callOB` also `"calling task"` and the period of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// A BOOL.
    Bool(bool),
    /// A whole number; written without a decimal point.
    Integer(i64),
    /// Any other number; also a whole one that an `i64` does not hold.
    Number(f64),
    /// The task that runs the block, at a `callOB`: `"calling task"`.
    CallingTask,
    /// A task without a number, at a `callOB`: its period, such as `"10ms"`.
    Task {
        /// In nanoseconds.
        period_ns: u64,
    },
}

/// The text for the task that runs a block.
pub const CALLING_TASK: &str = "calling task";

impl Value {
    /// The texts that are values in JSON, in words.
    pub const EXPECTED: &str = r#"true, false, a number, "NaN", "inf" or "-inf", or, for a callOB, "calling task" or a task's period such as "10ms""#;

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

/// As JSON has it, but without the quotation marks.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Number(value) => match word(*value) {
                Some(word) => f.write_str(word),
                None => write!(f, "{value:?}"),
            },
            Self::CallingTask => f.write_str(CALLING_TASK),
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

/// Values for which JSON has no number.
fn word(value: f64) -> Option<&'static str> {
    match value {
        _ if value.is_nan() => Some("NaN"),
        f64::INFINITY => Some("inf"),
        f64::NEG_INFINITY => Some("-inf"),
        _ => None,
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Bool(value) => serializer.serialize_bool(*value),
            Self::Integer(value) => serializer.serialize_i64(*value),
            Self::Number(value) => match word(*value) {
                Some(word) => serializer.serialize_str(word),
                None => serializer.serialize_f64(*value),
            },
            Self::CallingTask | Self::Task { .. } => serializer.collect_str(self),
        }
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfValue;
        impl Visitor<'_> for OfValue {
            type Value = Value;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(Value::EXPECTED)
            }

            fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
                Ok(Value::Bool(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
                Ok(Value::Integer(value))
            }

            fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
                Ok(i64::try_from(value).map_or(Value::Number(value as f64), Value::Integer))
            }

            fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
                Ok(Value::Number(value))
            }

            fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
                match value {
                    "NaN" => Ok(Value::Number(f64::NAN)),
                    "inf" => Ok(Value::Number(f64::INFINITY)),
                    "-inf" => Ok(Value::Number(f64::NEG_INFINITY)),
                    CALLING_TASK => Ok(Value::CallingTask),
                    _ => match parse_duration_ns(value) {
                        Ok(period_ns) => Ok(Value::Task { period_ns }),
                        Err(_) => Err(E::invalid_value(serde::de::Unexpected::Str(value), &self)),
                    },
                }
            }
        }
        deserializer.deserialize_any(OfValue)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_json(text: &str) -> Option<Value> {
        serde_json::from_str(text).ok()
    }

    #[test]
    fn each_type_has_its_own_form_in_json() {
        for (value, text) in [
            (Value::Bool(true), "true"),
            (Value::Integer(-32768), "-32768"),
            (Value::Integer(i64::MAX), "9223372036854775807"),
            (Value::Number(5.0), "5.0"),
            (Value::Number(-0.0), "-0.0"),
            (Value::Number(0.1), "0.1"),
            (Value::Number(f64::INFINITY), "\"inf\""),
            (Value::Number(f64::NEG_INFINITY), "\"-inf\""),
            (Value::CallingTask, "\"calling task\""),
            (Value::Task { period_ns: 10_000_000 }, "\"10ms\""),
        ] {
            assert_eq!(serde_json::to_string(&value).unwrap(), text);
            assert_eq!(of_json(text), Some(value));
        }
        assert_eq!(serde_json::to_string(&Value::Number(f64::NAN)).unwrap(), "\"NaN\"");
        let nan = of_json("\"NaN\"").unwrap();
        assert!(matches!(nan, Value::Number(value) if value.is_nan()));
    }

    #[test]
    fn what_no_signal_can_have_is_no_value() {
        for text in ["null", "[1]", "{}", "\"on\"", "1e999", "1 2", "", "\"nan\"", "tru"] {
            assert_eq!(of_json(text), None, "{text}");
        }
    }

    #[test]
    fn a_whole_number_beyond_an_integer_is_the_nearest_number() {
        assert_eq!(of_json("18446744073709551616"), Some(Value::Number(2f64.powi(64))));
        assert_eq!(of_json("9223372036854775808"), Some(Value::Number(2f64.powi(63))));
    }

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
