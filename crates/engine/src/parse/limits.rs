//! `[limits]`: bounds of parameters and variables.

use toml::Spanned;
use toml::de::DeValue;

use super::section::Section;
use super::{ConfigFinding, connection};
use crate::config::{Connection, Limit};
use crate::finding::Problem;
use crate::keys;

pub(super) fn limits(file: &Section<'_>) -> Vec<Limit> {
    let Some(section) = file.table(&keys::file::LIMITS, &keys::limits::TABLE) else {
        return Vec::new();
    };
    let limit = |(names, value): (Spanned<String>, &Spanned<DeValue<'_>>)| {
        let written = format!("\"{}\"", names.get_ref());
        let range = match bounds(value.get_ref(), &format!("[limits] {written}"), &written) {
            Ok(range) => Some(Spanned::new(value.span(), range)),
            Err(finding) => {
                section.report(ConfigFinding { span: value.span(), ..finding });
                None
            }
        };
        Limit { names, range }
    };
    section.entries().map(limit).collect()
}

/// The smallest and the largest value, which messages call `what` and which stand behind `key`.
pub(super) fn bounds(
    value: &DeValue<'_>,
    what: &str,
    key: &str,
) -> Result<(f64, f64), ConfigFinding> {
    let number = |value: &Spanned<DeValue<'_>>| match connection(value.get_ref())? {
        Connection::Integer(integer) => Some(integer as f64),
        Connection::Float(float) => Some(float),
        Connection::Bool(_) | Connection::Wire(_) => None,
    };
    let help = format!("write {key} = [0.0, 50.0]; inf and -inf stand for \"no limit\"");
    let bounds: Option<Vec<f64>> =
        value.as_array().and_then(|array| array.iter().map(number).collect());
    let Some([min, max]) = bounds.as_deref() else {
        let message = format!("{what} is an array of two numbers, smallest and largest");
        return Err(ConfigFinding::new(Problem::WrongType, 0..0, message).help(help));
    };
    if min > max || min.is_nan() || max.is_nan() {
        let message = format!("{what}: {min:?} to {max:?} is no range");
        return Err(ConfigFinding::new(Problem::OutOfRange, 0..0, message).help(help));
    }
    Ok((*min, *max))
}
