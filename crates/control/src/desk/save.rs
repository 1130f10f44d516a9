//! Writes the current values into a configuration.

use std::collections::HashMap;
use std::fmt;

use toml_edit::{DocumentMut, Item, Table, TableLike};

use super::operator::Operator;
use super::signals::Signal;
use isochrone_model::{Value, in_base_of, in_form_of};

/// Why the running values cannot be written into a configuration.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SaveError(String);

/// The current values of changed parameters and variables, to be written into the configuration.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes(Vec<(String, Saved)>);

/// The text for a value.
#[derive(Debug, Clone, PartialEq)]
enum Saved {
    Value(Value),
    /// The name of a task.
    Task(String),
}

impl fmt::Display for Saved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(value) => value.fmt(f),
            Self::Task(name) => write!(f, "\"{name}\""),
        }
    }
}

impl Operator {
    /// The parameters and variables whose values differ from the configuration.
    pub fn to_save(&self) -> Changes {
        let named = |(signal, value): (Signal<'_>, Value)| {
            let task = match value {
                Value::Task { period_ns } => self.signals().task_of_period(period_ns),
                _ => None,
            };
            let saved = task.map_or(Saved::Value(value), |task| Saved::Task(task.to_owned()));
            (signal.name, saved)
        };
        Changes(self.changed().into_iter().map(named).collect())
    }

    /// As [`Changes::save`], for the changes up to now.
    ///
    /// # Errors
    /// `text` is not the configuration of this node.
    pub fn save(&self, text: &str) -> Result<String, SaveError> {
        self.to_save().save(text)
    }
}

impl Changes {
    /// Names and values, as a configuration has them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&str, String)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value.to_string()))
    }

    /// Those that are not among `saved` with the same value.
    pub fn beyond(mut self, saved: &Self) -> Self {
        let saved: HashMap<_, _> = saved.0.iter().map(|(name, value)| (name, value)).collect();
        self.0.retain(|(name, value)| saved.get(name) != Some(&value));
        self
    }

    /// The text of the node's configuration with the current values in place of the constants of parameters, and of the
    /// initial values of variables, that were changed. Everything else, including comments and order, stays. A parameter
    /// of one of several instances is written into a table of that instance: `[block.in.17]`.
    ///
    /// # Errors
    /// `text` is not the configuration of this node.
    pub fn save(&self, text: &str) -> Result<String, SaveError> {
        let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
            SaveError(format!("the configuration is not TOML: {error}"))
        })?;
        for (name, value) in &self.0 {
            if write(&mut document, name, value).is_none() {
                return Err(SaveError(format!(
                    "the configuration has no place for \"{name}\", so it is not the one that the node runs"
                )));
            }
        }
        Ok(document.to_string())
    }
}

fn write(document: &mut DocumentMut, name: &str, value: &Saved) -> Option<()> {
    let (place, key) = match name.rsplit_once('.') {
        Some((instance, pin)) => (pins(document, instance)?, pin),
        None => (entry(document.get_mut("variable")?, name)?, "initial"),
    };
    let new = match value {
        Saved::Value(Value::Bool(value)) => toml_edit::Value::from(*value),
        Saved::Value(Value::Integer(value)) => toml_edit::Value::from(*value),
        Saved::Value(Value::Number(value)) => toml_edit::Value::from(*value),
        // A period alone does not name a task.
        Saved::Value(Value::CallingTask | Value::Task { .. }) => toml_edit::Value::from(f64::NAN),
        Saved::Task(name) => toml_edit::Value::from(name),
    };
    match place.get_mut(key) {
        Some(item) => {
            let old = item.as_value_mut()?;
            let new = in_notation_of(old, value).map_or(new, toml_edit::Value::from);
            exchange(old, new);
        }
        None => append(place, key, Item::Value(new)),
    }
    Some(())
}

/// The table of the pins of an instance.
fn pins<'d>(document: &'d mut DocumentMut, instance: &str) -> Option<&'d mut dyn TableLike> {
    let (block, number) = match instance.split_once('.') {
        Some((block, number)) => (block, Some(number)),
        None => (instance, None),
    };
    let pins = table(entry(document.get_mut("block")?, block)?, "in")?;
    match number {
        Some(number) => table(pins, number),
        None => Some(pins),
    }
}

/// A whole number in the notation of the text that it replaces: a time such as `T#500ms`, or a number with a
/// base.
fn in_notation_of(old: &toml_edit::Value, new: &Saved) -> Option<String> {
    let (old, Saved::Value(Value::Integer(new))) = (old.as_str()?, new) else { return None };
    in_base_of(old, *new).or_else(|| in_form_of(old, *new))
}

/// Replaces a value. Blanks and comments around it stay: a comment after it keeps its column as long as there are
/// blanks to give up.
fn exchange(old: &mut toml_edit::Value, new: toml_edit::Value) {
    let mut decor = old.decor().clone();
    let width = |value: toml_edit::Value| value.decorated("", "").to_string().chars().count();
    let before = width(old.clone());
    *old = new;
    if let Some(suffix) = decor.suffix().and_then(|suffix| suffix.as_str())
        && let comment = suffix.trim_start_matches(' ')
        && comment.starts_with('#')
    {
        let column = before + suffix.len() - comment.len();
        let blanks = column.saturating_sub(width(old.clone())).max(1);
        let suffix = format!("{}{comment}", " ".repeat(blanks));
        decor.set_suffix(suffix);
    }
    *old.decor_mut() = decor;
}

/// The entry of a block or a variable.
fn entry<'d>(entries: &'d mut Item, name: &str) -> Option<&'d mut dyn TableLike> {
    let is_meant = |table: &dyn TableLike| table.get("name").and_then(Item::as_str) == Some(name);
    match entries {
        Item::ArrayOfTables(tables) => {
            let found = tables.iter_mut().find(|table| is_meant(*table))?;
            Some(found)
        }
        Item::Value(toml_edit::Value::Array(array)) => {
            let mut tables = array.iter_mut().filter_map(toml_edit::Value::as_inline_table_mut);
            let found = tables.find(|table| is_meant(*table))?;
            Some(found)
        }
        _ => None,
    }
}

/// Adds a key after the others. The blank before the closing brace of an inline table stays there.
fn append(table: &mut dyn TableLike, key: &str, item: Item) {
    let last = table.iter_mut().last().and_then(|(_, item)| item.as_value_mut());
    let blank = last.and_then(|last| {
        let blank = last.decor().suffix()?.as_str()?.to_owned();
        let is_blank = !blank.is_empty() && blank.chars().all(|c| c == ' ');
        is_blank.then(|| last.decor_mut().set_suffix(""))?;
        Some(blank)
    });
    table.insert(key, item);
    if let (Some(blank), Some(new)) = (blank, table.get_mut(key).and_then(Item::as_value_mut)) {
        new.decor_mut().set_suffix(blank);
    }
}

/// A table within another; it is created if it does not exist.
fn table<'d>(parent: &'d mut dyn TableLike, key: &str) -> Option<&'d mut dyn TableLike> {
    if !parent.contains_key(key) {
        // Within an inline table it is inline, too.
        append(parent, key, Item::Table(Table::new()));
    }
    parent.get_mut(key)?.as_table_like_mut()
}

isochrone_model::debug_as_display!(SaveError);
