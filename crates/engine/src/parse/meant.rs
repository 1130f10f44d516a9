//! Values of another form than their key's: what they are called, and what was meant by them.

use toml::de::DeValue;

use super::section::parse_integer;
use crate::duration::{parse_duration_ns, respelled};
use crate::keys::{Form, Key, Range};

/// The duration that was meant by one without a unit, or by a TIME literal such as `T#2ms`.
pub(super) fn plain_duration(text: &str, range: &Range<u64>) -> Option<String> {
    let text = text.trim();
    let plain = match text.split_once('#') {
        Some((prefix, rest)) if ["t", "time"].contains(&&*prefix.to_lowercase()) => {
            rest.to_lowercase().replace('_', "")
        }
        Some(_) => return None,
        None => respelled(text).unwrap_or_else(|| format!("{text}ms")),
    };
    parse_duration_ns(&plain).is_ok_and(range.accepts).then_some(plain)
}

/// What was meant by a value of another type, as it is written.
pub(super) fn meant_value(key: &Key, value: &DeValue<'_>) -> Option<String> {
    match (&key.form, value) {
        (Form::Duration(range), DeValue::Integer(number)) => {
            let plain = plain_duration(&parse_integer(number)?.to_string(), range)?;
            Some(format!("\"{plain}\""))
        }
        (Form::Duration(range), DeValue::Float(number)) => {
            Some(format!("\"{}\"", plain_duration(number.as_str(), range)?))
        }
        (Form::Texts, DeValue::String(text)) => Some(format!("[\"{text}\"]")),
        (Form::Truth, DeValue::String(text)) => {
            let plain = text.trim().to_ascii_lowercase();
            matches!(&*plain, "true" | "false").then_some(plain)
        }
        (Form::Integer(_) | Form::WordOrInteger(..), DeValue::String(text)) => {
            text.trim().parse::<i64>().ok().map(|number| number.to_string())
        }
        (Form::Number(_) | Form::Value, DeValue::String(text)) => {
            let plain = text.trim().to_ascii_lowercase();
            let is_number = || plain.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
            let is_value = matches!(&*plain, "true" | "false")
                || (is_number() && plain.parse::<f64>().is_ok());
            is_value.then_some(plain)
        }
        _ => None,
    }
}

pub(super) fn article(value: &DeValue<'_>) -> String {
    let noun = match value.type_str() {
        "string" => "text",
        noun => noun,
    };
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}
