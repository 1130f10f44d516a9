//! Signals by name, and their values as people write them.

use std::collections::{BTreeSet, HashMap};

use isochrone_blocks::PinType;
pub(crate) use isochrone_control::CALLING_TASK;
use isochrone_control::{SignalDescription, Value};

use crate::numbers::{self, Digits};

/// What a node says of some of its signals.
#[derive(Debug, Default)]
pub(crate) struct Known(HashMap<String, SignalDescription>);

impl Known {
    /// The signal of a name, if the node has it.
    pub(super) fn get(&self, name: &str) -> Option<&SignalDescription> {
        self.0.get(name)
    }

    /// A value with all of its digits; of a signal that is not known, as its kind has it.
    pub(super) fn shown(&self, name: &str, value: Value) -> String {
        let known = self.get(name).map(|signal| numbers::type_of(&signal.value_type));
        let value_type = known.unwrap_or(match value {
            Value::Bool(_) => PinType::Bool,
            _ => PinType::Lreal,
        });
        in_words(value, value_type, Digits::Exact)
    }

    /// The tasks of these signals.
    pub(super) fn tasks(&self) -> BTreeSet<&str> {
        self.0.values().map(|signal| signal.task.as_str()).collect()
    }
}

impl FromIterator<SignalDescription> for Known {
    fn from_iter<I: IntoIterator<Item = SignalDescription>>(signals: I) -> Self {
        Self(signals.into_iter().map(|signal| (signal.name.clone(), signal)).collect())
    }
}

/// A value of a signal of this type, as PLC programmers write it, with as many digits as people read.
pub(crate) fn shown(value: Value, value_type: PinType) -> String {
    in_words(value, value_type, Digits::Six)
}

/// A value as a slot holds it.
pub(crate) fn number(value: Value) -> f64 {
    match value {
        Value::Bool(value) => f64::from(u8::from(value)),
        Value::Integer(value) => value as f64,
        Value::Number(value) => value,
        // No number: it is of a callOB, and compared with none.
        Value::CallingTask | Value::Task { .. } => f64::NAN,
    }
}

fn in_words(value: Value, value_type: PinType, digits: Digits) -> String {
    match (value, value.slot(value_type)) {
        (_, Some(slot)) => numbers::shown(slot, value_type, digits),
        // As a callOB is given it in JSON, too.
        (Value::Number(number), None) if number.is_nan() && value_type == PinType::Int => {
            CALLING_TASK.into()
        }
        (value, None) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_shown_as_its_type_wants_it() {
        assert_eq!(shown(Value::Integer(36608), PinType::Word), "16#8F00");
        assert_eq!(shown(Value::Bool(true), PinType::Bool), "TRUE");
        assert_eq!(shown(Value::Integer(1500), PinType::Time), "T#1s500ms");
        assert_eq!(shown(Value::Number(0.1 + 0.2), PinType::Lreal), "0.3");
        assert_eq!(shown(Value::Number(f64::NAN), PinType::Lreal), "NaN");
        assert_eq!(shown(Value::CallingTask, PinType::Int), "calling task");
        assert_eq!(shown(Value::Task { period_ns: 10_000_000 }, PinType::Int), "10ms");
    }

    #[test]
    fn a_value_of_an_unknown_signal_is_shown_as_what_it_is_with_all_digits() {
        let known = Known::default();
        assert_eq!(known.shown("a", Value::Number(0.1 + 0.2)), "0.30000000000000004");
        assert_eq!(known.shown("a", Value::Number(10.0)), "10");
        assert_eq!(known.shown("a", Value::Integer(-7)), "-7");
        assert_eq!(known.shown("a", Value::Bool(false)), "FALSE");
    }
}
