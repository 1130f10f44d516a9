//! A value that people type for a signal.

use isochrone_blocks::PinType;
use isochrone_control::{CALLING_TASK, Role, SignalDescription, Value};
use isochrone_model::parse_value;

use crate::base::numbers::{Digits, number, shown_value, type_of};
use crate::operate::limits;

/// A signal that is to get a value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Target {
    pub(crate) name: String,
    pub(crate) role: Role,
    pub(crate) value_type: String,
    pub(crate) unit: Option<String>,
    pub(crate) can_be_unset: bool,
    pub(crate) limits: Option<[f64; 2]>,
}

impl Target {
    pub(crate) fn new(signal: &SignalDescription) -> Self {
        let SignalDescription { name, role, value_type, unit, can_be_unset, limits, .. } =
            signal.clone();
        Self { name, role, value_type, unit, can_be_unset, limits }
    }

    /// The possible values of it.
    pub(crate) fn expected(&self) -> String {
        if let Some(range) = self.limits {
            return limits(range);
        }
        match type_of(&self.value_type) {
            PinType::Bool => "true or false".into(),
            PinType::Int if self.can_be_unset => {
                format!("a whole number from -32768 to 32767, or {CALLING_TASK}")
            }
            PinType::Int => "a whole number from -32768 to 32767".into(),
            PinType::Time => {
                "a time, such as 100ms or T#1s500ms; a number alone is in milliseconds".into()
            }
            PinType::Word => "a whole number from 0 to 65535, or 16#8F00".into(),
            PinType::Lreal => "a number, such as 0.5 or 1e3".into(),
        }
    }

    /// The value that was typed.
    pub(crate) fn read(&self, text: &str) -> Result<Value, String> {
        let unit = self.unit.as_deref().unwrap_or_default();
        let value = parse_value(text, type_of(&self.value_type), unit)?;
        let slot = number(value);
        match self.limits {
            // Where nothing is given, nothing is bounded.
            Some([min, max]) if !slot.is_nan() && !(min..=max).contains(&slot) => {
                Err(format!("{} is outside of the limits: {}", text.trim(), limits([min, max])))
            }
            _ => Ok(value),
        }
    }

    /// A value of its type, with its unit.
    pub(crate) fn shown(&self, value: Value) -> String {
        let value_type = type_of(&self.value_type);
        let value = shown_value(value, value_type, Digits::Six);
        match self.unit.as_deref() {
            // A time is written with its unit.
            Some(unit) if value_type != PinType::Time && !unit.is_empty() => {
                format!("{value} {unit}")
            }
            _ => value,
        }
    }
}
