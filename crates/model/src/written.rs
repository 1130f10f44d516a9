//! Values as people write them: with a base, a unit, or the name of a task.

use isochrone_blocks::PinType;
use serde::{Deserialize, Serialize};

use isochrone_blocks::literal::{parse_based, parse_time_ms};

use crate::{CALLING_TASK, Value};

/// A value that a request gives to a signal. Text means what the signal's type makes of it; in JSON it is any string.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Written {
    /// As it is written: `5`, `16#8F00`, `T#100ms`, `true`, `NaN`, or at a `callOB` a task: `fast`, `calling task`.
    Text(String),
    /// As JSON has it.
    Value(Value),
}

impl Written {
    /// The forms that a value may have in a request, in words.
    pub const EXPECTED: &'static str = "true, false, a number, or a string with a value as it is written, such as \"16#8F00\" or \"T#100ms\"";
}

impl<V: Into<Value>> From<V> for Written {
    fn from(value: V) -> Self {
        Self::Value(value.into())
    }
}

impl From<&str> for Written {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

/// A value.
const NO_VALUE: &str = "a value is true, false, a number such as 5, 0.5 or 16#8F00, for a TIME a time such as \
                        T#100ms, or for a callOB the name of a task";

/// The meaning of a text, before the type of its signal is known.
enum Form {
    Value(Value),
    /// A number with a base, such as `16#8F00`, which no TIME has.
    Based(i64),
    /// A number with something behind it, such as `1.5s`, or a time.
    WithUnit,
    Word,
}

/// Reads a value as it is written for a signal of this type and unit; empty: it has none.
///
/// # Errors
/// The fault, and what would be right.
pub fn parse_value(text: &str, value_type: PinType, unit: &str) -> Result<Value, String> {
    let text = text.trim();
    match (form(text)?, value_type) {
        // Which INT names a task is known only with the signals.
        (Form::Value(Value::CallingTask), PinType::Int) => Ok(Value::CallingTask),
        (Form::Value(Value::CallingTask), _) => {
            Err(format!("\"{CALLING_TASK}\" is for a callOB; this is {}", with_article(value_type)))
        }
        (Form::WithUnit | Form::Based(_), PinType::Time) => parse_time_ms(text)
            .map(|ms| Value::Integer(ms.into()))
            .map_err(|why| format!("\"{text}\" is no time: {why}")),
        (Form::Value(value), _) => Ok(value),
        (Form::Based(number), _) => Ok(Value::Integer(number)),
        (Form::Word, _) => Err(NO_VALUE.into()),
        (Form::WithUnit, _) => {
            let unit = if unit.is_empty() { String::new() } else { format!(", in {unit}") };
            Err(format!(
                "\"{text}\" has a unit, which only a TIME has; this is {}: write the number alone{unit}",
                with_article(value_type)
            ))
        }
    }
}

/// As [`parse_value`], for a `callOB`: text that is not a number is looked up with `task`.
///
/// # Errors
/// As [`parse_value`], or those of `task`.
pub fn parse_call_ob(
    text: &str,
    task: impl FnOnce(&str) -> Result<Value, String>,
) -> Result<Value, String> {
    let text = text.trim();
    match form(text)? {
        Form::Value(value) => Ok(value),
        Form::Based(number) => Ok(Value::Integer(number)),
        Form::WithUnit | Form::Word => task(text),
    }
}

fn form(text: &str) -> Result<Form, String> {
    /// Bytes; no number is written with more.
    const LONGEST: usize = 1000;
    if text.len() > LONGEST {
        return Err(NO_VALUE.into());
    }
    if let Some(truth) = parse_bool(text) {
        return Ok(Form::Value(Value::Bool(truth)));
    }
    if text.eq_ignore_ascii_case(CALLING_TASK) {
        return Ok(Form::Value(Value::CallingTask));
    }
    if let Some(based) = parse_based(text) {
        return based.map(|based| Form::Based(based.number));
    }
    if let Ok(value) = text.parse() {
        return Ok(Form::Value(Value::Integer(value)));
    }
    match parse_number(text) {
        Ok(value) => return Ok(Form::Value(Value::Number(value))),
        Err(error @ NumberError::TooLarge) => return Err(error.to_string()),
        Err(NumberError::Text) => {}
    }
    let with_point = text.replace(',', ".");
    if parse_number(&with_point).is_ok() {
        return Err(format!("decimals have a point, not a comma: {with_point}"));
    }
    if let Some((base, here)) = other_base(text) {
        return Err(format!("a number of base {base} is written as {here}, not {text}"));
    }
    if has_unit(text) {
        return Ok(Form::WithUnit);
    }
    let is_in_word = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
    let is_word = !text.is_empty() && text.chars().all(is_in_word);
    if is_word { Ok(Form::Word) } else { Err(NO_VALUE.into()) }
}

/// Reads `true` or `false`.
pub fn parse_bool(text: &str) -> Option<bool> {
    let is_it = |(word, _): &(&str, bool)| text.trim().eq_ignore_ascii_case(word);
    [("true", true), ("false", false)].into_iter().find(is_it).map(|(_, value)| value)
}

/// Reads a number, `NaN`, `inf` or `-inf`.
///
/// # Errors
/// It is not a number.
pub fn parse_number(text: &str) -> Result<f64, NumberError> {
    let value: f64 = text.trim().parse().map_err(|_| NumberError::Text)?;
    // Infinity is a word; digits that come to it were lost.
    if value.is_infinite() && text.contains(|c: char| c.is_ascii_digit()) {
        return Err(NumberError::TooLarge);
    }
    Ok(value)
}

/// Why a text is not a number.
#[derive(Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NumberError {
    /// It is neither digits nor a word for a value.
    Text,
    /// Its digits are beyond the range of an `f64`.
    TooLarge,
}

impl std::fmt::Display for NumberError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Text => {
                "give a number, such as 13824 or 0.5, or true or false; a TIME is a number of milliseconds"
            }
            Self::TooLarge => "beyond what a value can be, which is 1.8e308 at most",
        })
    }
}

impl std::error::Error for NumberError {}

crate::debug_as_display!(NumberError);

fn with_article(value_type: PinType) -> String {
    let article = if matches!(value_type, PinType::Int | PinType::Lreal) { "an" } else { "a" };
    format!("{article} {value_type}")
}

/// The base of a number as C and Python write it, such as `0x10`, and how it is written here.
fn other_base(text: &str) -> Option<(u32, String)> {
    let lowercase = text.to_ascii_lowercase();
    let (sign, number) = match lowercase.strip_prefix('-') {
        Some(number) => ("-", number),
        None => ("", lowercase.as_str()),
    };
    let (base, digits) = [("0x", 16), ("0o", 8), ("0b", 2)]
        .into_iter()
        .find_map(|(prefix, base)| Some((base, number.strip_prefix(prefix)?)))?;
    i64::from_str_radix(&digits.replace('_', ""), base).ok()?;
    Some((base, format!("{sign}{base}#{}", digits.to_ascii_uppercase())))
}

/// Whether a text that is not a number begins with one, or with the `T#` of a time.
fn has_unit(text: &str) -> bool {
    let lowercase = text.to_lowercase();
    let rest = ["t#", "time#"].iter().find_map(|prefix| lowercase.strip_prefix(prefix));
    let number = rest.unwrap_or(&lowercase).trim_start_matches(['+', '-']);
    rest.is_some() || number.starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_written_as_it_is_shown() {
        for (text, value) in [
            ("true", Value::Bool(true)),
            ("FALSE", Value::Bool(false)),
            ("5", Value::Integer(5)),
            (" -5 ", Value::Integer(-5)),
            ("0.5", Value::Number(0.5)),
            ("1e3", Value::Number(1000.0)),
            ("-inf", Value::Number(f64::NEG_INFINITY)),
            ("9223372036854775808", Value::Number(2f64.powi(63))),
        ] {
            // Whether the type has the value is checked when it is given to the signal.
            for value_type in PinType::ALL {
                assert_eq!(parse_value(text, value_type, ""), Ok(value), "{text}");
            }
        }
        let nan = parse_value("NaN", PinType::Lreal, "");
        assert!(matches!(nan, Ok(Value::Number(value)) if value.is_nan()));
    }

    #[test]
    fn a_number_with_a_base_is_one_to_all_but_a_time_as_in_a_configuration() {
        for (text, number) in [("16#8F00", 0x8F00), ("2#1010_0000", 160), ("-16#1", -1)] {
            for other in [PinType::Lreal, PinType::Int, PinType::Word] {
                assert_eq!(parse_value(text, other, ""), Ok(Value::Integer(number)), "{text}");
            }
            let error = parse_value(text, PinType::Time, "").unwrap_err();
            assert!(error.contains("a TIME begins with T# or TIME#, not"), "{error}");
        }
    }

    #[test]
    fn only_a_time_takes_a_unit() {
        for (text, ms) in [("T#1s500ms", 1500), ("100ms", 100), ("-0.5h", -1_800_000)] {
            assert_eq!(parse_value(text, PinType::Time, ""), Ok(Value::Integer(ms)), "{text}");
            for other in [PinType::Lreal, PinType::Int, PinType::Word, PinType::Bool] {
                let error = parse_value(text, other, "1/s").unwrap_err();
                assert!(error.contains("only a TIME") && error.contains("in 1/s"), "{error}");
            }
        }
        let error = parse_value("1.5mm", PinType::Lreal, "").unwrap_err();
        assert!(!error.contains("units are"), "no unit would be right: {error}");
        let error = parse_value("1.5mm", PinType::Time, "").unwrap_err();
        assert!(error.contains("no unit \"mm\""), "{error}");
        assert!(parse_value("T#1x5s", PinType::Time, "").is_err());
    }

    #[test]
    fn what_a_call_ob_without_a_value_is_shown_as_takes_its_value_away_again() {
        for text in ["calling task", "Calling Task"] {
            assert_eq!(parse_value(text, PinType::Int, ""), Ok(Value::CallingTask), "{text}");
        }
        for other in [PinType::Lreal, PinType::Time, PinType::Word, PinType::Bool] {
            let error = parse_value("calling task", other, "").unwrap_err();
            assert!(error.contains("is for a callOB") && error.contains(other.as_str()), "{error}");
        }
    }

    #[test]
    fn at_a_call_ob_what_is_no_number_names_a_task() {
        let task = |name: &str| match name {
            "fast" => Ok(Value::Integer(35)),
            name => Err(format!("there is no task \"{name}\"")),
        };
        for (text, value) in [
            ("fast", Ok(Value::Integer(35))),
            ("38", Ok(Value::Integer(38))),
            ("calling task", Ok(Value::CallingTask)),
            ("slow", Err("there is no task \"slow\"".to_owned())),
            ("10ms", Err("there is no task \"10ms\"".to_owned())),
            ("1,5", Err("decimals have a point, not a comma: 1.5".to_owned())),
        ] {
            assert_eq!(parse_call_ob(text, task), value, "{text}");
        }
    }

    #[test]
    fn what_is_no_value_is_refused_with_what_would_be_one() {
        for (text, said) in [
            ("", "a value is true"),
            ("on", "a value is true"),
            ("1,5", "a point, not a comma: 1.5"),
            ("16#XY", "digits of base 16"),
            ("1e400", "1.8e308"),
            ("0x8f00", "as 16#8F00, not 0x8f00"),
            ("-0b1_01", "as -2#1_01, not"),
            ("0o17", "as 8#17, not"),
        ] {
            let error = parse_value(text, PinType::Lreal, "").unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn in_json_every_string_is_a_text_and_all_else_a_value() {
        let read = |text: &str| serde_json::from_str::<Written>(text).ok();
        for text in ["NaN", "5", "10ms", "calling task", "on"] {
            let json = format!("\"{text}\"");
            assert_eq!(read(&json), Some(Written::from(text)));
            assert_eq!(serde_json::to_string(&Written::from(text)).unwrap(), json);
        }
        assert_eq!(read("5"), Some(5.into()));
        assert_eq!(read("5.0"), Some(5.0.into()));
        assert_eq!(read("9223372036854775807"), Some(i64::MAX.into()));
        assert_eq!(read("-0.0").map(|zero| zero == Written::from(-0.0)), Some(true));
        for text in ["null", "[1]", "{}", "1e999"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
