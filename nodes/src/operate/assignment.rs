//! `NAME=VALUE` on a command line.

use std::str::FromStr;

use isochrone_blocks::PinType;
use isochrone_control::{DescribeParams, Value, Values};
use isochrone_engine::{Based, parse_based, parse_duration_ns, parse_time_ms};

use super::known::{CALLING_TASK, Known};
use super::node::Node;
use crate::failure::Failure;
use crate::numbers;

/// A signal and the value that it is to get.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assignment {
    name: String,
    value: Written,
}

/// A value as it is written. Whether it may have a unit depends on the signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Written {
    /// TRUE, FALSE or a number.
    Plain(Value),
    /// A number with a base, such as `16#8F00`.
    Based { text: String, number: i64 },
    /// A number with a unit, such as `T#100ms` or `1.5s`.
    WithUnit(String),
    /// What a `callOB` means that nothing was given to.
    CallingTask,
    /// A word: the name of a task, at a `callOB`.
    Name(String),
}

impl FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').filter(|(name, _)| !name.is_empty()).ok_or(
            "write NAME=VALUE without blanks, such as ramp.setChangeRate=5, after the name of the node; \
             a --comment of several words needs quotes",
        )?;
        let (name, value) = (name.to_owned(), Written::read(value.trim())?);
        Ok(Self { name, value })
    }
}

/// All values, in the order in which they are written, and the signals that they are for.
pub(super) fn resolve(
    node: &mut Node,
    assignments: &[Assignment],
) -> Result<(Values, Known), Failure> {
    let known = node.known(assignments.iter().map(|one| one.name.as_str()))?;
    let (mut values, mut errors) = (Vec::new(), Vec::new());
    for Assignment { name, value } in assignments {
        let value = match (value, known.get(name)) {
            (Written::Plain(value), _) => Ok(*value),
            (_, None) => {
                // The node says which name was meant.
                node.signals(Some(name))?;
                Err(format!("\"{name}\" stands for several signals; name one"))
            }
            (Written::Name(task) | Written::WithUnit(task), Some(signal))
                if signal.can_be_unset =>
            {
                let found = of_task(node, task)?;
                found.map_err(|why| format!("{name}: {why}"))
            }
            (value, Some(signal)) => {
                let value_type = numbers::type_of(&signal.value_type);
                value.of(value_type, signal.unit.as_deref()).map_err(|why| format!("{name}: {why}"))
            }
        };
        match value {
            Ok(value) => values.push((name.clone(), value)),
            Err(error) => errors.push(error),
        }
    }
    if !errors.is_empty() {
        return Err(Failure::usage(errors.join("\n")));
    }
    Ok((Values(values), known))
}

impl Written {
    /// Reads a value as `show` writes it, or as a configuration has it.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        if let Some(value) = numbers::parse_bool(text) {
            return Ok(Self::Plain(Value::Bool(value)));
        }
        if text.eq_ignore_ascii_case(CALLING_TASK) {
            return Ok(Self::CallingTask);
        }
        if let Some(parsed) = parse_based(text) {
            let based = |Based { number, .. }| Self::Based { text: text.to_owned(), number };
            return parsed.map(based);
        }
        if let Ok(value) = text.parse() {
            return Ok(Self::Plain(Value::Integer(value)));
        }
        match numbers::parse_number(text) {
            Ok(value) => Ok(Self::Plain(Value::Number(value))),
            Err(error @ numbers::NumberError::TooLarge) => Err(error.to_string()),
            Err(numbers::NumberError::Text) => {
                let with_point = text.replace(',', ".");
                if numbers::parse_number(&with_point).is_ok() {
                    return Err(format!("decimals have a point, not a comma: {with_point}"));
                }
                if let Some((base, here)) = other_base(text) {
                    return Err(format!(
                        "a number of base {base} is written as {here}, not {text}"
                    ));
                }
                if has_unit(text) {
                    return Ok(Self::WithUnit(text.to_owned()));
                }
                let is_name = !text.is_empty()
                    && text.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
                if is_name { Ok(Self::Name(text.to_owned())) } else { Err(NO_VALUE.into()) }
            }
        }
    }

    /// The value that it is to a signal of this type and unit.
    pub(crate) fn of(&self, value_type: PinType, unit: Option<&str>) -> Result<Value, String> {
        match (self, value_type) {
            (Self::Plain(value), _) => Ok(*value),
            (Self::Based { text, .. } | Self::WithUnit(text), PinType::Time) => parse_time_ms(text)
                .map(|ms| Value::Integer(ms.into()))
                .map_err(|why| format!("\"{text}\" is no time: {why}")),
            (Self::Based { number, .. }, _) => Ok(Value::Integer(*number)),
            // The node knows which INT names a task.
            (Self::CallingTask, PinType::Int) => Ok(Value::CallingTask),
            (Self::Name(_), _) => Err(NO_VALUE.into()),
            (Self::CallingTask, _) => Err(format!(
                "\"{CALLING_TASK}\" is for a callOB; this is {}",
                with_article(value_type)
            )),
            (Self::WithUnit(text), _) => {
                let alone = match unit.filter(|unit| !unit.is_empty()) {
                    Some(unit) => format!("write the number alone, in {unit}"),
                    None => "write the number alone".to_owned(),
                };
                Err(format!(
                    "\"{text}\" has a unit, which only a TIME has; this is {}: {alone}",
                    with_article(value_type)
                ))
            }
        }
    }
}

/// The value of a `callOB` for a task, given by its name or, as `get` prints one without a number, its period.
fn of_task(node: &mut Node, written: &str) -> Result<Result<Value, String>, Failure> {
    let tasks = node.call(&DescribeParams {})?.tasks;
    if let Some(task) = tasks.iter().find(|task| task.name == written) {
        let period_ns = task.period_ns;
        return Ok(Ok(task.ob.map_or(Value::Task { period_ns }, |ob| Value::Integer(ob.into()))));
    }
    if let Ok(period_ns) = parse_duration_ns(written) {
        return Ok(Ok(Value::Task { period_ns }));
    }
    let number = written.to_ascii_lowercase();
    let number = number.strip_prefix("ob").map(|number| number.trim_start_matches('_'));
    let help = match number.and_then(|number| number.parse::<u16>().ok()) {
        Some(number) => format!("write the number alone: {number}"),
        None => {
            let names: Vec<_> = tasks.iter().map(|task| task.name.as_str()).collect();
            format!("give an OB number, {CALLING_TASK}, or a task: {}", names.join(", "))
        }
    };
    Ok(Err(format!("there is no task \"{written}\"; {help}")))
}

/// What a value is.
const NO_VALUE: &str = "a value is true, false, a number such as 5, 0.5 or 16#8F00, for a TIME a time such as \
                        T#100ms, or for a callOB the name of a task";

fn with_article(value_type: PinType) -> String {
    let article = if value_type == PinType::Int { "an" } else { "a" };
    let article = if value_type == PinType::Lreal { "an" } else { article };
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

/// Whether a text that is no number begins with one, or with the `T#` of a time.
fn has_unit(text: &str) -> bool {
    let lowercase = text.to_lowercase();
    let prefixes = ["t#", "time#"];
    let rest = prefixes.iter().find_map(|prefix| lowercase.strip_prefix(prefix));
    let number = rest.unwrap_or(&lowercase).trim_start_matches(['+', '-']);
    rest.is_some() || number.starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(text: &str) -> Result<Written, String> {
        format!("a.b={text}").parse::<Assignment>().map(|one| one.value)
    }

    #[test]
    fn a_value_is_written_as_it_is_shown() {
        for (text, value) in [
            ("true", Value::Bool(true)),
            ("FALSE", Value::Bool(false)),
            ("5", Value::Integer(5)),
            ("-5", Value::Integer(-5)),
            ("0.5", Value::Number(0.5)),
            ("1e3", Value::Number(1000.0)),
            ("-inf", Value::Number(f64::NEG_INFINITY)),
            ("9223372036854775808", Value::Number(2f64.powi(63))),
        ] {
            assert_eq!(written(text), Ok(Written::Plain(value)), "{text}");
        }
        // The node says what it thinks of that.
        let nan = written("NaN");
        assert!(matches!(nan, Ok(Written::Plain(Value::Number(value))) if value.is_nan()));
    }

    #[test]
    fn a_number_with_a_base_is_one_to_all_but_a_time_as_in_a_configuration() {
        for (text, number) in [("16#8F00", 0x8F00), ("2#1010_0000", 160), ("-16#1", -1)] {
            let written = written(text).unwrap();
            for other in [PinType::Lreal, PinType::Int, PinType::Word] {
                assert_eq!(written.of(other, None), Ok(Value::Integer(number)), "{text}");
            }
            let error = written.of(PinType::Time, None).unwrap_err();
            assert!(error.contains("a TIME begins with T# or TIME#, not"), "{error}");
        }
    }

    #[test]
    fn only_a_time_takes_a_unit() {
        for (text, ms) in [("T#1s500ms", 1500), ("100ms", 100), ("-0.5h", -1_800_000)] {
            let written = written(text).unwrap();
            assert_eq!(written.of(PinType::Time, None), Ok(Value::Integer(ms)), "{text}");
            for other in [PinType::Lreal, PinType::Int, PinType::Word, PinType::Bool] {
                let error = written.of(other, Some("1/s")).unwrap_err();
                assert!(error.contains("only a TIME") && error.contains("in 1/s"), "{error}");
            }
        }
        let metres = written("1.5mm").unwrap();
        let error = metres.of(PinType::Lreal, None).unwrap_err();
        assert!(!error.contains("units are"), "no unit would be right: {error}");
        let error = metres.of(PinType::Time, None).unwrap_err();
        assert!(error.contains("no unit \"mm\""), "{error}");
    }

    #[test]
    fn what_a_call_ob_without_a_value_is_shown_as_takes_its_value_away_again() {
        for text in ["calling task", "Calling Task"] {
            let value = written(text).unwrap().of(PinType::Int, None).unwrap();
            assert_eq!(value, Value::CallingTask, "{text}");
            assert_eq!(super::super::shown(value, PinType::Int), "calling task");
        }
        for other in [PinType::Lreal, PinType::Time, PinType::Word, PinType::Bool] {
            let error = written("calling task").unwrap().of(other, None).unwrap_err();
            assert!(error.contains("is for a callOB") && error.contains(other.as_str()), "{error}");
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
            let error = written(text).and_then(|it| it.of(PinType::Lreal, None)).unwrap_err();
            assert!(error.contains(said), "{text}: {error}");
        }
        assert!(written("T#1x5s").unwrap().of(PinType::Time, None).is_err());
        for text in ["a.b", "=5", ""] {
            let error = text.parse::<Assignment>().unwrap_err();
            assert!(error.contains("NAME=VALUE"), "{text}: {error}");
        }
    }
}
