//! `[limits]`: bounds of parameters and variables.

use isochrone_blocks::PinType;
use toml::Spanned;
use toml::de::DeValue;

use super::connection::connection;
use super::section::Section;
use crate::Diagnostic;
use crate::config::{Connection, Limit};
use crate::diagnostic::Problem;
use crate::keys::{self, Key};

pub(super) fn limits(file: &Section<'_>) -> Vec<Limit> {
    let Some(section) = file.table(&keys::file::LIMITS, &keys::limits::TABLE) else {
        return Vec::new();
    };
    let limit = |(names, value): (Spanned<String>, &Spanned<DeValue<'_>>)| {
        let key = format!("\"{}\"", names.get_ref());
        let range = match bounds(section.title(), &key, value.get_ref()) {
            Ok(range) => Some(Spanned::new(value.span(), range)),
            Err(diagnostic) => {
                section.report(Diagnostic { span: value.span(), ..diagnostic });
                None
            }
        };
        Limit { names, range }
    };
    section.entries().map(limit).collect()
}

impl Section<'_> {
    /// The smallest and the largest value of an input or a variable.
    pub(super) fn range(
        &self,
        key: &Key,
        value_type: Option<PinType>,
    ) -> Option<Spanned<(f64, f64)>> {
        let range = self.read(key, |value| bounds(self.title(), key.name, value).map_err(Some))?;
        if value_type == Some(PinType::Bool) {
            let message = format!("{} {} is not for BOOL", self.title(), key.name);
            let help = format!("a BOOL is true or false; leave {} out", key.name);
            self.report(Diagnostic::new(Problem::Conflict, range.span(), message).help(help));
        }
        Some(range)
    }
}

/// The smallest and the largest number that something may have.
fn bounds(table: &str, key: &str, value: &DeValue<'_>) -> Result<(f64, f64), Diagnostic> {
    let number = |value: &Spanned<DeValue<'_>>| match connection(value.get_ref())? {
        Connection::Integer(integer) => Some(integer as f64),
        Connection::Float(float) => Some(float),
        Connection::Bool(_) | Connection::Wire(_) => None,
    };
    let help = format!("write {key} = [0.0, 50.0]; inf and -inf stand for \"no limit\"");
    let numbers: Option<Vec<f64>> =
        value.as_array().and_then(|array| array.iter().map(number).collect());
    let Some([min, max]) = numbers.as_deref() else {
        let message = format!("{table} {key} is an array of two numbers, smallest and largest");
        return Err(Diagnostic::new(Problem::WrongType, 0..0, message).help(help));
    };
    if min > max || min.is_nan() || max.is_nan() {
        let message = format!("{table} {key}: {min:?} to {max:?} is no range");
        return Err(Diagnostic::new(Problem::OutOfRange, 0..0, message).help(help));
    }
    Ok((*min, *max))
}
