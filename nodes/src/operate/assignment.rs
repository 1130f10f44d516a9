//! `NAME=VALUE` on a command line.

use std::str::FromStr;

use isochrone_blocks::PinType;
use isochrone_engine::{operate, parse_time_ms};
use isochrone_runtime::control::{Value, Values};

use crate::numbers::{self, Digits};

/// A signal and the value that it is to get.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assignment {
    name: String,
    value: Value,
}

impl FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text
            .split_once('=')
            .filter(|(name, _)| !name.is_empty())
            .ok_or("write NAME=VALUE, such as ramp.setChangeRate=5")?;
        Ok(Self { name: name.to_owned(), value: parse(value.trim())? })
    }
}

/// All of them, in the order in which they are written.
pub(crate) fn values(assignments: &[Assignment]) -> Values {
    Values(assignments.iter().map(|one| (one.name.clone(), one.value)).collect())
}

/// Reads a value as `show` writes it, or as a configuration has it.
pub(crate) fn parse(text: &str) -> Result<Value, String> {
    if let Some(value) = numbers::parse_bool(text) {
        return Ok(Value::Bool(value));
    }
    if let Some((base, digits)) = text.split_once('#')
        && let Some(base) = [("2", 2), ("8", 8), ("16", 16)].iter().find(|(name, _)| *name == base)
    {
        let value = i64::from_str_radix(&digits.replace('_', ""), base.1);
        return value.map(Value::Integer).map_err(|_| {
            format!("after {}# come digits of base {}, such as 16#8F00", base.0, base.1)
        });
    }
    if let Ok(value) = text.parse() {
        return Ok(Value::Integer(value));
    }
    if numbers::is_like_time(text) {
        return parse_time_ms(text).map(|ms| Value::Integer(ms.into()));
    }
    let number = numbers::parse_number(text);
    number.map(Value::Number).map_err(|error| match error {
        numbers::NumberError::Text => {
            "a value is true, false, a number such as 5, 0.5 or 16#8F00, or a time such as T#100ms"
                .into()
        }
        error @ numbers::NumberError::TooLarge => error.to_string(),
    })
}

/// A value of a signal of this type, as PLC programmers write it.
pub(crate) fn shown(value: Value, value_type: PinType) -> String {
    match operate::Value::from(value).slot(value_type) {
        Some(slot) => numbers::shown(slot, value_type, Digits::Six),
        None => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value_of(text: &str) -> Result<Value, String> {
        format!("a.b={text}").parse::<Assignment>().map(|one| one.value)
    }

    #[test]
    fn a_value_is_written_as_it_is_shown() {
        for (text, value) in [
            ("true", Value::Bool(true)),
            ("FALSE", Value::Bool(false)),
            ("5", Value::Integer(5)),
            ("-5", Value::Integer(-5)),
            ("16#8F00", Value::Integer(0x8F00)),
            ("2#1010_0000", Value::Integer(160)),
            ("0.5", Value::Number(0.5)),
            ("1e3", Value::Number(1000.0)),
            ("-inf", Value::Number(f64::NEG_INFINITY)),
            ("T#1s500ms", Value::Integer(1500)),
            ("100ms", Value::Integer(100)),
            ("9223372036854775808", Value::Number(2f64.powi(63))),
        ] {
            assert_eq!(value_of(text), Ok(value), "{text}");
        }
        // The node says what it thinks of that.
        assert!(matches!(value_of("NaN"), Ok(Value::Number(value)) if value.is_nan()));
    }

    #[test]
    fn what_is_no_value_is_refused_with_what_would_be_one() {
        for (text, said) in [
            ("", "a value is true"),
            ("on", "a value is true"),
            ("1,5", "a value is true"),
            ("16#XY", "digits of base 16"),
            ("1e400", "1.8e308"),
            ("T#1x5s", ""),
        ] {
            let error = value_of(text).unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
        for text in ["a.b", "=5", ""] {
            let error = text.parse::<Assignment>().unwrap_err();
            assert!(error.contains("NAME=VALUE"), "{text}: {error}");
        }
    }

    #[test]
    fn a_value_is_shown_as_its_type_wants_it() {
        assert_eq!(shown(Value::Integer(36608), PinType::Word), "16#8F00");
        assert_eq!(shown(Value::Bool(true), PinType::Bool), "TRUE");
        assert_eq!(shown(Value::Integer(1500), PinType::Time), "T#1s500ms");
        assert_eq!(shown(Value::Number(0.1 + 0.2), PinType::Lreal), "0.3");
        assert_eq!(shown(Value::Number(f64::NAN), PinType::Lreal), "NaN");
    }
}
