//! Values of another form than their key's: their names, and suggestions.

use toml::de::DeValue;

use super::integer::parse_integer;
use crate::keys::{Form, Key, Range};
use isochrone_model::{parse_duration_ns, plain_number, respelled};

/// A suggestion for a duration without a unit, or with a comma.
pub(super) fn plain_duration(text: &str, range: &Range<u64>) -> Option<String> {
    let text = text.trim().replace(',', ".");
    let respelled = respelled(&text);
    let mut forms = [Some(text.clone()), respelled, Some(text + "ms")].into_iter().flatten();
    forms.find(|plain| parse_duration_ns(plain).is_ok_and(range.accepts))
}

/// A suggestion for a value of another type, as it would be written.
pub(super) fn suggested_value(key: &Key, value: &DeValue<'_>) -> Option<String> {
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
            let plain = text.trim().to_ascii_lowercase().replace(',', ".");
            let is_number = || plain.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c));
            let is_value = matches!(&*plain, "true" | "false")
                || (is_number() && plain.parse::<f64>().is_ok());
            is_value
                .then_some(plain)
                .or_else(|| plain_number(text).filter(|_| matches!(key.form, Form::Value)))
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
