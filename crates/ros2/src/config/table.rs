//! A table of the file, read key by key with the places of what is wrong.

use std::cell::RefCell;
use std::ops::Range;
use std::time::Duration;

use isochrone_engine::{Diagnostic, KnownNames, Problem};
use isochrone_model::parse_duration_ns;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value and its place in the file.
pub(super) type Entry<'a> = &'a Spanned<DeValue<'a>>;

/// Errors found so far.
#[derive(Default)]
pub(super) struct Errors(RefCell<Vec<Diagnostic>>);

impl Errors {
    pub(super) fn add(&self, diagnostic: Diagnostic) {
        self.0.borrow_mut().push(diagnostic);
    }

    pub(super) fn count(&self) -> usize {
        self.0.borrow().len()
    }

    pub(super) fn into_all(self) -> Vec<Diagnostic> {
        self.0.into_inner()
    }
}

/// A table of the file.
pub(super) struct Table<'a> {
    title: &'static str,
    table: &'a DeTable<'a>,
    pub(super) span: Range<usize>,
    pub(super) errors: &'a Errors,
}

/// A text and its place.
#[derive(Debug, Clone)]
pub(super) struct Text {
    pub(super) text: String,
    pub(super) span: Range<usize>,
}

impl<'a> Table<'a> {
    /// Reports every key that the table does not have.
    pub(super) fn new(
        title: &'static str,
        keys: &[&str],
        table: &'a DeTable<'a>,
        span: Range<usize>,
        errors: &'a Errors,
    ) -> Self {
        for (key, _) in table.iter() {
            let name: &str = key.get_ref();
            if !keys.contains(&name) {
                let message = format!("{title} has no key \"{name}\"");
                let help = KnownNames::new(keys.iter().copied()).suggestion(name);
                errors.add(Diagnostic::new(Problem::UnknownKey, key.span(), message).help(help));
            }
        }
        Self { title, table, span, errors }
    }

    pub(super) fn get(&self, key: &str) -> Option<Entry<'a>> {
        self.table.get(key)
    }

    pub(super) fn report(&self, problem: Problem, span: Range<usize>, message: &str, help: &str) {
        let diagnostic = Diagnostic::new(problem, span, message);
        self.errors.add(if help.is_empty() { diagnostic } else { diagnostic.help(help) });
    }

    /// Reports a value of another type than the key takes.
    fn wrong(&self, key: &str, entry: Entry<'_>, expected: &str) {
        self.wrong_but(key, entry, expected, "");
    }

    fn wrong_but(&self, key: &str, entry: Entry<'_>, expected: &str, help: &str) {
        let found = entry.get_ref().type_str();
        let message = format!("{} {key} is {expected}, not a value of type {found}", self.title);
        self.report(Problem::WrongType, entry.span(), &message, help);
    }

    /// A text, if the key is there.
    pub(super) fn text(&self, key: &str) -> Option<Text> {
        let entry = self.get(key)?;
        let Some(text) = entry.get_ref().as_str() else {
            self.wrong(key, entry, "a text");
            return None;
        };
        Some(Text { text: text.to_owned(), span: entry.span() })
    }

    /// A text that must be there.
    pub(super) fn wanted(&self, key: &str, example: &str) -> Option<Text> {
        if self.get(key).is_none() {
            let message = format!("{} has no {key}", self.title);
            let help = format!("write {key} = \"{example}\"");
            self.report(Problem::MissingKey, self.span.clone(), &message, &help);
        }
        self.text(key)
    }

    /// One of several words; the first where the key is missing.
    pub(super) fn word<T: Copy>(&self, key: &str, words: &[(&str, T)]) -> T {
        self.word_or(key, words, |_| None)
    }

    /// The same, where other words are known for some of them.
    pub(super) fn word_or<T: Copy>(
        &self,
        key: &str,
        words: &[(&str, T)],
        meant: impl Fn(&str) -> Option<&'static str>,
    ) -> T {
        let Some(text) = self.text(key) else { return words[0].1 };
        let found = words.iter().find(|(word, _)| *word == text.text);
        if found.is_none() {
            let message = format!("{} {key} is not \"{}\"", self.title, text.text);
            let help = match meant(&text.text) {
                Some(word) => format!("write {key} = \"{word}\""),
                None => KnownNames::new(words.iter().map(|it| it.0)).suggestion(&text.text),
            };
            self.report(Problem::OutOfRange, text.span, &message, &help);
        }
        found.unwrap_or(&words[0]).1
    }

    /// Several texts.
    pub(super) fn texts(&self, key: &str) -> Option<Vec<Text>> {
        let entry = self.get(key)?;
        let texts = entry.get_ref().as_array().and_then(|array| {
            let text = |entry: &Spanned<DeValue<'_>>| {
                let text = entry.get_ref().as_str()?.to_owned();
                Some(Text { text, span: entry.span() })
            };
            array.iter().map(text).collect::<Option<Vec<_>>>()
        });
        if texts.is_none() {
            self.wrong(key, entry, "a list of texts");
        }
        texts
    }

    /// A truth value; `false` where the key is missing.
    pub(super) fn truth(&self, key: &str) -> bool {
        let Some(entry) = self.get(key) else { return false };
        let truth = entry.get_ref().as_bool();
        if truth.is_none() {
            self.wrong(key, entry, "true or false");
        }
        truth.unwrap_or_default()
    }

    /// A number within a range.
    pub(super) fn number(&self, key: &str, least: f64, most: f64) -> Option<f64> {
        let entry = self.get(key)?;
        let Some(number) = number(entry.get_ref()) else {
            self.wrong(key, entry, "a number");
            return None;
        };
        if !(least..=most).contains(&number) {
            let message =
                format!("{} {key} is a number from {least} to {most}, not {number}", self.title);
            self.report(Problem::OutOfRange, entry.span(), &message, "");
            return None;
        }
        Some(number)
    }

    /// A whole number within a range.
    pub(super) fn whole(&self, key: &str, least: u32, most: u32) -> Option<u32> {
        let number = self.number(key, least.into(), most.into())?;
        if number.trunc() != number
            && let Some(entry) = self.get(key)
        {
            self.wrong(key, entry, "a whole number");
            return None;
        }
        Some(number as u32)
    }

    /// A duration, such as `"200ms"`.
    pub(super) fn duration(&self, key: &str) -> Option<Duration> {
        let help = format!("write {key} = \"200ms\"");
        let entry = self.get(key)?;
        if entry.get_ref().as_str().is_none() {
            self.wrong_but(key, entry, "a text with a unit", &help);
            return None;
        }
        let text = self.text(key)?;
        match parse_duration_ns(&text.text) {
            Ok(0) => {
                let message = format!("{} {key} is longer than 0", self.title);
                self.report(Problem::OutOfRange, text.span, &message, "");
                None
            }
            Ok(ns) => Some(Duration::from_nanos(ns)),
            Err(why) => {
                let message = format!("{} {key}: {why}", self.title);
                self.report(Problem::OutOfRange, text.span, &message, &help);
                None
            }
        }
    }

    /// The keys and values of a table within this one, whose keys are names.
    pub(super) fn entries(&self, key: &str) -> Option<Vec<(Text, Entry<'a>)>> {
        let entry = self.get(key)?;
        let Some(table) = entry.get_ref().as_table() else {
            self.wrong(key, entry, "a table such as { data = \"level.y\" }");
            return None;
        };
        let name = |(key, entry): (&Spanned<std::borrow::Cow<'_, str>>, Entry<'a>)| {
            (Text { text: key.get_ref().to_string(), span: key.span() }, entry)
        };
        let mut entries: Vec<_> = table.iter().map(name).collect();
        // In the order of the file, which is that of a frame's values.
        entries.sort_by_key(|(key, _)| key.span.start);
        Some(entries)
    }
}

/// The number that a value is.
pub(super) fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|number| number as f64)
        }
        _ => None,
    }
}

/// The tables of an array of tables.
pub(super) fn tables<'a>(
    title: &'static str,
    key: &str,
    keys: &[&str],
    file: &'a DeTable<'a>,
    errors: &'a Errors,
) -> Vec<Table<'a>> {
    let Some(entry) = file.get(key) else { return Vec::new() };
    let Some(array) = entry.get_ref().as_array() else {
        let message = format!("{key} is written as {title}: a file can have several");
        errors.add(Diagnostic::new(Problem::WrongType, entry.span(), message));
        return Vec::new();
    };
    let table = |entry: &'a Spanned<DeValue<'a>>| {
        let table = entry.get_ref().as_table()?;
        Some(Table::new(title, keys, table, entry.span(), errors))
    };
    array.iter().filter_map(table).collect()
}
