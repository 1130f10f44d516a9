//! Values of signals, as their types have them.

use isochrone_blocks::PinType;
use isochrone_control::Value;

use crate::base::numbers::{Digits, shown_value, type_of};

/// A value with all of its digits; of a signal without a type, as its kind has it.
pub(super) fn typed(value_type: Option<&String>, value: Value) -> String {
    let value_type = value_type.map(|name| type_of(name)).unwrap_or(match value {
        Value::Bool(_) => PinType::Bool,
        _ => PinType::Lreal,
    });
    shown_value(value, value_type, Digits::Exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_shown_as_its_type_has_it_or_as_what_it_is_with_all_digits() {
        let word = "WORD".to_owned();
        assert_eq!(typed(Some(&word), Value::Integer(36608)), "16#8F00");
        assert_eq!(typed(None, Value::Number(0.1 + 0.2)), "0.30000000000000004");
        assert_eq!(typed(None, Value::Number(10.0)), "10");
        assert_eq!(typed(None, Value::Integer(-7)), "-7");
        assert_eq!(typed(None, Value::Bool(false)), "FALSE");
    }
}
