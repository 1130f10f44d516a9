//! Numbers as files and reports have them.

use isochrone_blocks::PinType;

/// The shortest decimal that reads back to the same value; `NaN`, `inf`, `-inf`.
pub(crate) fn format(value: f64) -> String {
    format!("{value:?}")
}

/// A value as LGF's documents write it.
pub(crate) fn literal(value: f64, value_type: PinType) -> String {
    match value_type {
        PinType::Bool => if value == 0.0 { "FALSE" } else { "TRUE" }.into(),
        PinType::Lreal => format(value),
        PinType::Int | PinType::Time | PinType::Word => format!("{value}"),
    }
}

/// A value for programs: a number, a whole number, true or false.
pub(crate) fn json(value: f64, value_type: PinType) -> serde_json::Value {
    match value_type {
        PinType::Bool => (value != 0.0).into(),
        PinType::Lreal => value.into(),
        PinType::Int | PinType::Time | PinType::Word => (value as i64).into(),
    }
}

/// Reads a number; a BOOL may also be written true or false.
pub(crate) fn parse(text: &str, value_type: PinType) -> Option<f64> {
    let text = text.trim();
    match value_type {
        PinType::Bool if text.eq_ignore_ascii_case("true") => Some(1.0),
        PinType::Bool if text.eq_ignore_ascii_case("false") => Some(0.0),
        _ => text.parse().ok(),
    }
}
