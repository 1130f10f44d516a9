//! Constants at pins: numbers, truth values, times, and tasks by their names.

use isochrone_blocks::{Ob, Pin, PinDefault, PinType};

use super::names::Names;
use crate::Diagnostic;
use crate::config::Connection;
use crate::diagnostic::{Among, Problem};
use isochrone_model::{
    Based, TIME_FORMS, is_time, parse_based, parse_time_ms, plain_number, time_help,
};

/// How a constant of type INT or WORD is written.
const WHOLE_NUMBER: &str = "write a whole number, such as 100 or \"16#64\"";

/// The slot of what stands at a pin; `None` if that is a wire.
pub(super) fn constant_slot(
    connection: &Connection,
    pin: &Pin,
    names: &Names<'_>,
) -> Option<Result<f64, Diagnostic>> {
    if let (Connection::Wire(text), PinType::Int | PinType::Word) = (connection, pin.pin_type)
        && let Some(based) = parse_based(text)
    {
        return Some(based_slot(text, based, pin));
    }
    match connection {
        Connection::Wire(text) if pin.names_task => task_slot(text, pin, names),
        Connection::Wire(text) if is_quoted(text, pin, names) => {
            let what = if pin.pin_type == PinType::Bool { "true or false" } else { "a number" };
            let message = format!("\"{text}\" is a text, but pin {} takes {what}", pin.name);
            let plain = text.trim().to_ascii_lowercase();
            let diagnostic = Diagnostic::new(Problem::TypeMismatch, 0..0, message);
            Some(Err(diagnostic.help(format!("write {} = {plain}, without quotes", pin.name))))
        }
        Connection::Wire(text) if is_time(text) => time_slot(connection, text, pin),
        Connection::Wire(_) => None,
        value => Some(value_slot(value, pin)),
    }
}

/// The slot of a number with a base, such as `"16#8F00"`.
fn based_slot(text: &str, based: Result<Based, String>, pin: &Pin) -> Result<f64, Diagnostic> {
    match based {
        Ok(Based { number, .. }) => value_slot(&Connection::Integer(number), pin),
        Err(reason) => {
            let message = format!("pin {} \"{text}\": {reason}", pin.name);
            Err(Diagnostic::new(Problem::OutOfRange, 0..0, message).help(WHOLE_NUMBER))
        }
    }
}

/// Whether a text is a constant for the pin that should have no quotes.
fn is_quoted(text: &str, pin: &Pin, names: &Names<'_>) -> bool {
    let text = text.trim();
    match pin.pin_type {
        PinType::Bool => {
            let is_truth = ["true", "false"].iter().any(|word| text.eq_ignore_ascii_case(word));
            is_truth && names.value(text).is_none()
        }
        PinType::Lreal | PinType::Int | PinType::Word => {
            is_time(text) && text.parse::<f64>().is_ok()
        }
        PinType::Time => false,
    }
}

/// The slot of a time. At a pin of another type, what neither is a time nor begins as a number is left to be
/// a wire.
fn time_slot(connection: &Connection, text: &str, pin: &Pin) -> Option<Result<f64, Diagnostic>> {
    match (parse_time_ms(text), pin.pin_type) {
        (Ok(ms), PinType::Time) => Some(Ok(f64::from(ms))),
        (Err(reason), PinType::Time) => {
            let message = format!("pin {} \"{text}\": {reason}", pin.name);
            let help = time_help(pin.name, text);
            Some(Err(Diagnostic::new(Problem::OutOfRange, 0..0, message).help(help)))
        }
        (Ok(_), _) => Some(value_slot(connection, pin)),
        // A number with a unit.
        (Err(_), _)
            if text
                .trim_start_matches(['+', '-', ' '])
                .starts_with(|c: char| c.is_ascii_digit()) =>
        {
            Some(value_slot(connection, pin))
        }
        (Err(_), _) => None,
    }
}

/// The slot of the task that a text names. An input or a variable of that name is a wire, as at every pin.
fn task_slot(text: &str, pin: &Pin, names: &Names<'_>) -> Option<Result<f64, Diagnostic>> {
    let task = names.tasks.iter().find(|task| task.name == text);
    match (names.value(text), task) {
        (Some(value), Some(_)) if value.value_type == Some(PinType::Int) => {
            let other = if names.inputs.contains_key(text) { "an input" } else { "a variable" };
            let message = format!("\"{text}\" at pin {} is a task and {other}", pin.name);
            let diagnostic = Diagnostic::new(Problem::Duplicate, 0..0, message);
            Some(Err(diagnostic.help("give one of the two another name")))
        }
        (Some(_), _) => None,
        (None, Some(task)) => {
            let period_ns = task.period_ns;
            Some(Ok(task.ob.map_or(Ob::Task { period_ns }, Ob::Number).slot()))
        }
        (None, None) if text.contains(['.', '@', '{']) || names.blocks.contains_key(text) => None,
        (None, None) => {
            let message = format!("there is no task or input \"{text}\"");
            let diagnostic = Diagnostic::new(Problem::UnknownTask, 0..0, message);
            // TIA Portal calls the OB with number 35 OB35.
            let number = match text.get(..2) {
                Some(ob) if ob.eq_ignore_ascii_case("ob") => text.get(2..).unwrap_or_default(),
                _ => text,
            };
            Some(Err(match number.trim_start_matches(['_', ' ']).parse::<i64>() {
                Ok(number) => {
                    diagnostic.help(format!("write {} = {number}, without quotes", pin.name))
                }
                Err(_) => diagnostic.seek(text, Among::TasksAndInputs),
            }))
        }
    }
}

/// The slot of a number or truth value, if its type is the pin's.
fn value_slot(constant: &Connection, pin: &Pin) -> Result<f64, Diagnostic> {
    let (written, slot) = match (constant, pin.pin_type) {
        (Connection::Float(float), PinType::Lreal) if float.is_nan() => {
            let message = format!("pin {} cannot be NaN", pin.name);
            return Err(Diagnostic::new(Problem::OutOfRange, 0..0, message)
                .help("inf and -inf stand for \"no limit\""));
        }
        (Connection::Float(float), PinType::Lreal) => return Ok(*float),
        (Connection::Float(float), _)
            if float.is_nan() && pin.default == PinDefault::CallingTask =>
        {
            return Ok(Ob::Caller.slot());
        }
        (Connection::Bool(bool), PinType::Bool) => return Ok(f64::from(u8::from(*bool))),
        (Connection::Integer(integer), PinType::Bool) => (integer.to_string(), None),
        (Connection::Integer(integer), _) => (integer.to_string(), Some(*integer as f64)),
        (Connection::Float(float), _) => (format!("{float:?}"), None),
        (Connection::Bool(bool), _) => (bool.to_string(), None),
        (Connection::Wire(text), _) => (format!("\"{text}\""), None),
    };
    match slot {
        Some(slot) if pin.pin_type.holds(slot) => Ok(slot),
        Some(_) => {
            let (min, max) = pin.pin_type.range().unwrap_or_default();
            let message = format!("{written} does not fit pin {}", pin.name);
            Err(Diagnostic::new(Problem::OutOfRange, 0..0, message)
                .help(format!("{} holds {min} to {max}", pin.pin_type)))
        }
        None => {
            let message = format!("{written} is no {}, which pin {} takes", pin.pin_type, pin.name);
            let diagnostic = Diagnostic::new(Problem::TypeMismatch, 0..0, message);
            if let Connection::Wire(text) = constant
                && let Some(help) = number_help(text, pin)
            {
                return Err(diagnostic.help(help));
            }
            Err(diagnostic.help(match pin.pin_type {
                PinType::Lreal => "write a number such as 1.0",
                PinType::Bool => "write true or false",
                PinType::Time => TIME_FORMS,
                PinType::Int | PinType::Word => WHOLE_NUMBER,
            }))
        }
    }
}

/// What to write at a pin for a text that is a number with a decimal comma or a unit.
fn number_help(text: &str, pin: &Pin) -> Option<String> {
    if !matches!(pin.pin_type, PinType::Lreal | PinType::Int | PinType::Word) {
        return None;
    }
    let Some(plain) = plain_number(text) else {
        let has_separators = text.contains(',') && text.contains(|c: char| c.is_ascii_digit());
        return has_separators.then(|| {
            "decimals have a point, not a comma, and nothing stands between thousands".to_owned()
        });
    };
    let number: f64 = plain.parse().ok().filter(|number| pin.pin_type.holds(*number))?;
    let plain = if pin.pin_type == PinType::Lreal { plain } else { number.to_string() };
    let has_unit = text.trim().replace(',', ".").parse::<f64>().is_err();
    let why = match (has_unit, pin.unit) {
        (false, _) => ": decimals have a point, not a comma".into(),
        (true, "") => ", the number alone".into(),
        (true, unit) => format!(", the number alone, in {unit}"),
    };
    Some(format!("write {} = {plain}{why}", pin.name))
}
