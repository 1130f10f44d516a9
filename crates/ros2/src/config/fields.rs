//! The keys of `fields`, which name fields of a message.

use isochrone_engine::Problem;
use isochrone_recording::message::{FieldPath, MessageType};
use toml::de::DeValue;

use super::table::{Entry, Table, Text};

/// The field that a key names. What is often written instead is told from what is merely misspelt.
pub(super) fn find_field(
    table: &Table<'_>,
    message: &MessageType,
    path: &Text,
    entry: Entry<'_>,
) -> Option<FieldPath> {
    if let Some((rest, value)) = leaf(entry) {
        let name = format!("{}.{rest}", path.text);
        let problem = format!("{} is a table, as TOML reads a dot in a name", path.text);
        let help = format!("quote the name: \"{name}\" = {}", shown(value));
        table.report(Problem::WrongType, path.span.clone(), &problem, &help);
        return None;
    }
    let error = match FieldPath::find(message, &path.text) {
        Ok(found) => return Some(found),
        Err(error) => error.to_string(),
    };
    let reversed = entry.get_ref().as_str().filter(|it| FieldPath::find(message, it).is_ok());
    let help = reversed.map_or_else(String::new, |field| {
        format!("fields are written message field = signal: \"{field}\" = \"{}\"", path.text)
    });
    table.report(Problem::OutOfRange, path.span.clone(), &error, &help);
    None
}

/// The first value in a table, and the way to it.
fn leaf<'a>(entry: Entry<'a>) -> Option<(String, &'a DeValue<'a>)> {
    let (key, inner) = entry.get_ref().as_table()?.iter().next()?;
    let key: &str = key.get_ref();
    Some(match leaf(inner) {
        Some((rest, value)) => (format!("{key}.{rest}"), value),
        None => (key.to_owned(), inner.get_ref()),
    })
}

fn shown(value: &DeValue<'_>) -> String {
    value.as_str().map_or_else(|| "…".to_owned(), |text| format!("\"{text}\""))
}
