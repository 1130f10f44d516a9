//! The connection of a pin, as written.

use toml::de::DeValue;

use super::integer::parse_integer;
use crate::config::Connection;

/// What a value at a pin is; `None` if no pin takes such a value.
pub(super) fn connection(value: &DeValue<'_>) -> Option<Connection> {
    match value {
        DeValue::Integer(integer) => Some(match parse_integer(integer) {
            Some(integer) => Connection::Integer(integer),
            // Digits of another radix would parse as a decimal number, and a wrong one.
            None if integer.radix() == 10 => Connection::Float(integer.as_str().parse().ok()?),
            None => return None,
        }),
        DeValue::Float(float) => Some(Connection::Float(float.as_str().parse().ok()?)),
        DeValue::Boolean(bool) => Some(Connection::Bool(*bool)),
        DeValue::String(wire) => Some(Connection::Wire(wire.to_string())),
        _ => None,
    }
}
