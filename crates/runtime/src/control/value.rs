//! Values of signals as JSON has them.

use std::fmt;

use isochrone_engine::{format_duration_ns, operate, parse_duration_ns};
use serde::de::{Error, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

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

/// What stands for the task that runs a block.
pub const CALLING_TASK: &str = "calling task";

impl Value {
    /// Reads one JSON value; `None` if it is none that a signal can have.
    pub(super) fn of_json(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
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

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<operate::Value> for Value {
    fn from(value: operate::Value) -> Self {
        match value {
            operate::Value::Bool(value) => Self::Bool(value),
            operate::Value::Integer(value) => Self::Integer(value),
            operate::Value::Number(value) => Self::Number(value),
            operate::Value::CallingTask => Self::CallingTask,
            operate::Value::Task { period_ns } => Self::Task { period_ns },
        }
    }
}

impl From<Value> for operate::Value {
    fn from(value: Value) -> Self {
        match value {
            Value::Bool(value) => Self::Bool(value),
            Value::Integer(value) => Self::Integer(value),
            Value::Number(value) => Self::Number(value),
            Value::CallingTask => Self::CallingTask,
            Value::Task { period_ns } => Self::Task { period_ns },
        }
    }
}

/// What JSON has no number for.
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
                f.write_str(EXPECTED)
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

/// How people are told what a value is.
pub(super) const EXPECTED: &str = r#"true, false, a number, "NaN", "inf" or "-inf", or, for a callOB, "calling task" or a task's period such as "10ms""#;

/// Values by name, in the order in which they are written: a JSON object.
///
/// A name that comes twice is kept twice, so that whoever checks a request can refuse it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Values(pub Vec<(String, Value)>);

impl Values {
    /// The value of a name; the last one, if there are several.
    pub fn get(&self, name: &str) -> Option<Value> {
        self.0.iter().rfind(|(known, _)| known == name).map(|(_, value)| *value)
    }

    /// Names and values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), *value))
    }
}

impl<N: Into<String>, V: Into<Value>> FromIterator<(N, V)> for Values {
    fn from_iter<I: IntoIterator<Item = (N, V)>>(values: I) -> Self {
        Self(values.into_iter().map(|(name, value)| (name.into(), value.into())).collect())
    }
}

impl Serialize for Values {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfValues;
        impl<'de> Visitor<'de> for OfValues {
            type Value = Values;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of names and values")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Values, A::Error> {
                let mut values = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    values.push(entry);
                }
                Ok(Values(values))
            }
        }
        deserializer.deserialize_map(OfValues)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert_eq!(Value::of_json(text), Some(value));
        }
        assert_eq!(serde_json::to_string(&Value::Number(f64::NAN)).unwrap(), "\"NaN\"");
        let nan = Value::of_json("\"NaN\"").unwrap();
        assert!(matches!(nan, Value::Number(value) if value.is_nan()));
    }

    #[test]
    fn what_no_signal_can_have_is_no_value() {
        for text in ["null", "[1]", "{}", "\"on\"", "1e999", "1 2", "", "\"nan\"", "tru"] {
            assert_eq!(Value::of_json(text), None, "{text}");
        }
    }

    #[test]
    fn a_whole_number_beyond_an_integer_is_the_nearest_number() {
        assert_eq!(Value::of_json("18446744073709551616"), Some(Value::Number(2f64.powi(64))));
        assert_eq!(Value::of_json("9223372036854775808"), Some(Value::Number(2f64.powi(63))));
    }
}
