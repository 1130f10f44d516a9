//! Values as files, programs and people have them.

use isochrone_blocks::PinType;
use isochrone_model::{CALLING_TASK, Value, format_time_ms};
pub(crate) use isochrone_model::{NumberError, parse_bool, parse_number};

/// The shortest decimal that reads back to the same value; `NaN`, `inf`, `-inf`.
pub(crate) fn format(value: f64) -> String {
    format!("{value:?}")
}

/// A value as LGF's documents write it; a TIME is a number of milliseconds there.
pub(crate) fn literal(value: f64, value_type: PinType) -> String {
    match value_type {
        PinType::Time => format!("{value}"),
        _ => shown(value, value_type, Digits::All),
    }
}

/// How many digits of an LREAL are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Digits {
    /// As many as it takes to read the same value back.
    All,
    /// The same, but a whole number has no decimal point.
    Exact,
    /// As many as people read.
    Six,
}

/// A value as PLC programmers write it: `TRUE`, `16#8F00`, `T#1s500ms`, `-5`, `0.1`. What its type
/// cannot hold stands as the number that it is.
pub(crate) fn shown(value: f64, value_type: PinType, digits: Digits) -> String {
    match value_type {
        PinType::Bool if value == 0.0 => "FALSE".into(),
        PinType::Bool if value == 1.0 => "TRUE".into(),
        PinType::Int if value_type.holds(value) => format!("{}", value as i64),
        PinType::Time if value_type.holds(value) => format_time_ms(value as i64),
        PinType::Word if value_type.holds(value) => format!("16#{:04X}", value as u16),
        _ if digits == Digits::Six => six_digits(value),
        _ if digits == Digits::Exact => {
            let text = format(value);
            text.strip_suffix(".0").map(str::to_owned).unwrap_or(text)
        }
        _ => format(value),
    }
}

/// As [`shown`], a value as a node gives it.
pub(crate) fn shown_value(value: Value, value_type: PinType, digits: Digits) -> String {
    match (value, value.slot(value_type)) {
        (_, Some(slot)) => shown(slot, value_type, digits),
        // As a callOB is given it in JSON, too.
        (Value::Number(number), None) if number.is_nan() && value_type == PinType::Int => {
            CALLING_TASK.into()
        }
        (value, None) => value.to_string(),
    }
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

/// A number with six significant digits.
pub(crate) fn six_digits(value: f64) -> String {
    const DIGITS: usize = 6;
    let size = value.abs();
    if size != 0.0 && size.is_finite() && !(1e-4..1e9).contains(&size) {
        // The digits before the exponent, without zeros that say nothing.
        let text = format!("{value:.*e}", DIGITS - 1);
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{exponent}", without_zeros(digits));
    }
    // 0 has no logarithm, and no digits after the point.
    let exponent = if size > 0.0 { size.log10().floor() } else { DIGITS as f64 };
    let decimals = (DIGITS as f64 - 1.0 - exponent).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    without_zeros(&text).into()
}

/// The type of this name; one that is not known is a number of any kind.
pub(crate) fn type_of(name: &str) -> PinType {
    let is_it = |value_type: &PinType| value_type.as_str() == name;
    PinType::ALL.into_iter().find(is_it).unwrap_or(PinType::Lreal)
}

/// A value for programs: a number, a whole number, true or false.
pub(crate) fn json(value: f64, value_type: PinType) -> serde_json::Value {
    match value_type {
        PinType::Bool => (value != 0.0).into(),
        PinType::Lreal => value.into(),
        PinType::Int | PinType::Time | PinType::Word => (value as i64).into(),
    }
}

/// A value and what it is of. For programs it is what [`json`] makes of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Typed {
    pub(crate) value: f64,
    pub(crate) value_type: PinType,
}

impl Typed {
    /// As PLC programmers write it.
    pub(crate) fn shown(self, digits: Digits) -> String {
        shown(self.value, self.value_type, digits)
    }
}

impl serde::Serialize for Typed {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        json(self.value, self.value_type).serialize(serializer)
    }
}

/// A number for programs; one that JSON has none for is a text.
pub(crate) fn serialize<S: serde::Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
    serialize_some(&Some(*value), to)
}

/// The same of one that may be missing.
pub(crate) fn serialize_some<S: serde::Serializer>(
    value: &Option<f64>,
    to: S,
) -> Result<S::Ok, S::Error> {
    match value {
        Some(value) if !value.is_finite() => to.serialize_str(&format(*value)),
        Some(value) => to.serialize_some(value),
        None => to.serialize_none(),
    }
}

/// Reads a number; a BOOL may also be written true or false.
pub(crate) fn parse(text: &str, value_type: PinType) -> Result<f64, NumberError> {
    match parse_bool(text) {
        Some(value) if value_type == PinType::Bool => Ok(f64::from(value)),
        _ => parse_number(text),
    }
}

/// Whether a text that is not a number is a time with its unit, such as `T#200ms` or `1.5s`.
pub(crate) fn is_like_time(text: &str) -> bool {
    let text = text.trim().to_lowercase();
    let time = text.strip_prefix("t#").or(text.strip_prefix("time#")).unwrap_or(&text);
    time.starts_with(|c: char| c.is_ascii_digit() || c == '-')
        && time.ends_with(['s', 'm', 'h', 'd'])
}

/// Reads how many of something there shall be.
pub(crate) fn parse_count(text: &str) -> Result<u64, String> {
    match text.parse() {
        Ok(count) if count > 0 => Ok(count),
        _ => Err("give a whole number, 1 or greater".into()),
    }
}

fn without_zeros(digits: &str) -> &str {
    if !digits.contains('.') {
        return digits;
    }
    digits.trim_end_matches('0').trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_is_written_as_plc_programmers_write_it() {
        for (value, value_type, expected) in [
            (36608.0, PinType::Word, "16#8F00"),
            (0.0, PinType::Word, "16#0000"),
            (1.0, PinType::Bool, "TRUE"),
            (0.0, PinType::Bool, "FALSE"),
            (-5.0, PinType::Int, "-5"),
            (0.0, PinType::Time, "T#0ms"),
            (1500.0, PinType::Time, "T#1s500ms"),
            (-90_061_001.0, PinType::Time, "T#-1d1h1m1s1ms"),
            (0.1, PinType::Lreal, "0.1"),
        ] {
            assert_eq!(shown(value, value_type, Digits::All), expected);
            assert_eq!(shown(value, value_type, Digits::Six), expected);
        }
    }

    #[test]
    fn a_value_of_a_node_is_shown_as_its_type_wants_it() {
        let shown = |value, value_type| shown_value(value, value_type, Digits::Six);
        assert_eq!(shown(Value::Integer(36608), PinType::Word), "16#8F00");
        assert_eq!(shown(Value::Bool(true), PinType::Bool), "TRUE");
        assert_eq!(shown(Value::Integer(1500), PinType::Time), "T#1s500ms");
        assert_eq!(shown(Value::Number(0.1 + 0.2), PinType::Lreal), "0.3");
        assert_eq!(shown(Value::Number(f64::NAN), PinType::Lreal), "NaN");
        assert_eq!(shown(Value::CallingTask, PinType::Int), "calling task");
        assert_eq!(shown(Value::Task { period_ns: 10_000_000 }, PinType::Int), "10ms");
    }

    #[test]
    fn what_a_type_cannot_hold_is_not_hidden() {
        for (value, value_type, expected) in [
            (0.5, PinType::Bool, "0.5"),
            (65536.0, PinType::Word, "65536.0"),
            (f64::NAN, PinType::Int, "NaN"),
            (-0.5, PinType::Time, "-0.5"),
        ] {
            assert_eq!(shown(value, value_type, Digits::All), expected);
        }
    }

    #[test]
    fn an_lreal_has_six_digits_on_a_terminal() {
        for (value, expected) in [
            (0.8499999999999999, "0.85"),
            (21850.85193952712, "21850.9"),
            (13824.0, "13824"),
            (0.0, "0"),
            (-1.3435492005640952, "-1.34355"),
            (123456789.0, "123456789"),
            (1234567890123.0, "1.23457e12"),
            (0.000012345678, "1.23457e-5"),
            (0.00012345678, "0.000123457"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(six_digits(value), expected);
        }
    }

    #[test]
    fn digits_beyond_an_f64_are_no_number() {
        let (lreal, bool) = (PinType::Lreal, PinType::Bool);
        assert_eq!(parse("1e400", lreal), Err(NumberError::TooLarge));
        assert_eq!(parse("-1e400", lreal), Err(NumberError::TooLarge));
        assert_eq!(parse("-inf", lreal), Ok(f64::NEG_INFINITY));
        assert_eq!(parse(" TRUE ", bool), Ok(1.0));
        assert_eq!(parse("true", PinType::Int), Err(NumberError::Text));
    }
}
