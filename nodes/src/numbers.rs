//! Numbers as the CSV files have them.

use isochrone_blocks::PinType;

/// The shortest decimal that reads back to the same value; `NaN`, `inf`, `-inf`.
pub(crate) fn format(value: f64) -> String {
    format!("{value:?}")
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
