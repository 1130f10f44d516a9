//! Values of signals whose types a node has told.

use isochrone_blocks::PinType;
use isochrone_control::{Types, Value};

use crate::numbers::{Digits, shown_value, type_of};

/// A value with all of its digits; of a signal without a type, as its kind has it.
pub(super) fn typed(types: &Types, name: &str, value: Value) -> String {
    let value_type = types.get(name).map(|name| type_of(name)).unwrap_or(match value {
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
        let types = [("a".to_owned(), "WORD".to_owned())].into();
        assert_eq!(typed(&types, "a", Value::Integer(36608)), "16#8F00");
        assert_eq!(typed(&types, "b", Value::Number(0.1 + 0.2)), "0.30000000000000004");
        assert_eq!(typed(&types, "b", Value::Number(10.0)), "10");
        assert_eq!(typed(&types, "b", Value::Integer(-7)), "-7");
        assert_eq!(typed(&types, "b", Value::Bool(false)), "FALSE");
    }
}
