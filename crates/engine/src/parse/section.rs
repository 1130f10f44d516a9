//! A table of the file, read by the keys that are declared for it.

use std::cell::RefCell;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::suggestions::{article, suggested_value};
use crate::Diagnostic;
use crate::diagnostic::Problem;
use crate::keys::{Absent, Form, Key, TableKeys};
use crate::nearest::nearest_name;

type Span = std::ops::Range<usize>;
type Entry<'a> = &'a Spanned<DeValue<'a>>;

/// Errors found so far.
#[derive(Default)]
pub(super) struct Errors {
    diagnostics: RefCell<Vec<Diagnostic>>,
    /// Places of values behind misspelt keys. What is wrong there is said of the key alone.
    misspelt: RefCell<Vec<Span>>,
}

impl Errors {
    pub(super) fn into_diagnostics(self) -> Vec<Diagnostic> {
        let misspelt = self.misspelt.into_inner();
        let is_guess = |diagnostic: &Diagnostic| {
            diagnostic.problem != Problem::UnknownKey
                && misspelt.iter().any(|value| {
                    value.start <= diagnostic.span.start && diagnostic.span.end <= value.end
                })
        };
        self.diagnostics
            .into_inner()
            .into_iter()
            .filter(|diagnostic| !is_guess(diagnostic))
            .collect()
    }
}

/// One table.
pub(crate) struct Section<'a> {
    known: &'static TableKeys,
    table: &'a DeTable<'a>,
    /// Where the table's header stands, or the file's start.
    span: Span,
    /// Values of keys that are misspelt, by the key that is meant.
    misspelt: Vec<(&'static str, Entry<'a>)>,
    /// Keys that the table does not have, each with the place of its diagnostic in the list.
    unknown: Vec<(&'a str, usize)>,
    errors: &'a Errors,
}

impl<'a> Section<'a> {
    /// Reports every key that the table does not have. Where one is meant that is not there, its
    /// value is read all the same: one slip is one error.
    pub(super) fn new(
        known: &'static TableKeys,
        table: &'a DeTable<'a>,
        span: Span,
        errors: &'a Errors,
    ) -> Self {
        let mut section =
            Self { known, table, span, misspelt: Vec::new(), unknown: Vec::new(), errors };
        // Where the keys are names, who knows the names checks them.
        if known.keys.is_empty() {
            return section;
        }
        let names = || known.keys.iter().map(|key| key.name);
        for (key, value) in table.iter().filter(|(key, _)| names().all(|k| k != *key.get_ref())) {
            let message = format!("{} has no key \"{}\"", known.title, key.get_ref());
            let diagnostic = Diagnostic::new(Problem::UnknownKey, key.span(), message);
            section.unknown.push((key.get_ref(), errors.diagnostics.borrow().len()));
            section.report(diagnostic.did_you_mean(key.get_ref(), names()));
            let is_free = |name: &&str| {
                !table.contains_key(*name)
                    && section.misspelt.iter().all(|(suggested, _)| suggested != name)
            };
            if let Some(suggested) = nearest_name(key.get_ref(), names()).filter(is_free) {
                section.misspelt.push((suggested, value));
                errors.misspelt.borrow_mut().push(value.span());
            }
        }
        section
    }

    /// Keys that the table does not have and that stand for something else, as `help` says: they are
    /// reported with that.
    pub(super) fn misplaced(&self, help: impl Fn(&str) -> Option<String>) -> Vec<String> {
        let mut diagnostics = self.errors.diagnostics.borrow_mut();
        let mut misplaced = Vec::new();
        for (key, diagnostic) in &self.unknown {
            if let (Some(diagnostic), Some(help)) = (diagnostics.get_mut(*diagnostic), help(key)) {
                *diagnostic = diagnostic.clone().help(help);
                misplaced.push((*key).to_owned());
            }
        }
        misplaced
    }

    pub(super) fn report(&self, diagnostic: Diagnostic) {
        self.errors.diagnostics.borrow_mut().push(diagnostic);
    }

    /// The value of a key, if it is there.
    pub(crate) fn get(&self, key: &Key) -> Option<Entry<'a>> {
        debug_assert!(
            self.known.keys.iter().any(|known| std::ptr::eq(*known, key)),
            "{} does not declare {}",
            self.known.title,
            key.name
        );
        let misspelt = || self.misspelt.iter().find(|(suggested, _)| *suggested == key.name);
        self.table.get(key.name).or_else(|| misspelt().map(|(_, value)| *value))
    }

    /// The value of a key; reports one that must be there and is not.
    fn wanted(&self, key: &Key) -> Option<Entry<'a>> {
        let value = self.get(key);
        if let (None, Absent::Required(example)) = (value, &key.absent) {
            let message = format!("{} has no {}", self.known.title, key.name);
            let diagnostic = Diagnostic::new(Problem::MissingKey, self.span.clone(), message);
            let example = match key.form {
                Form::Name(_) => "\"…\"",
                _ => example,
            };
            self.report(diagnostic.help(format!("write {} = {example}", key.name)));
        }
        value
    }

    fn wrong_type(&self, key: &Key, value: Entry<'_>) -> Diagnostic {
        let diagnostic = self.not_expected(key, value, key.expected());
        match suggested_value(key, value.get_ref()) {
            Some(suggested) => diagnostic.help(format!("write {} = {suggested}", key.name)),
            None => diagnostic,
        }
    }

    fn not_expected(&self, key: &Key, value: Entry<'_>, expected: &str) -> Diagnostic {
        let found = article(value.get_ref());
        let message = match self.known.title {
            title if title.starts_with('[') => format!("{title} {} is {expected}", key.name),
            _ => format!("{} is {expected}", key.name),
        };
        Diagnostic::new(Problem::WrongType, value.span(), format!("{message}, not {found}"))
    }

    /// Reads a key with `read`, which returns `Err(None)` for another TOML type and
    /// `Err(Some(diagnostic))` for a value that the key does not take.
    pub(super) fn read<T>(
        &self,
        key: &Key,
        read: impl FnOnce(&DeValue<'a>) -> Result<T, Option<Diagnostic>>,
    ) -> Option<Spanned<T>> {
        let value = self.wanted(key)?;
        match read(value.get_ref()) {
            Ok(read) => Some(Spanned::new(value.span(), read)),
            Err(None) => {
                self.report(self.wrong_type(key, value));
                None
            }
            Err(Some(diagnostic)) => {
                self.report(Diagnostic { span: value.span(), ..diagnostic });
                None
            }
        }
    }

    /// The tables of an array of tables.
    pub(super) fn tables(&self, key: &Key, known: &'static TableKeys) -> Vec<Section<'a>> {
        let Some(value) = self.get(key) else { return Vec::new() };
        let Some(array) = value.get_ref().as_array() else {
            let (title, found) = (known.title, article(value.get_ref()));
            let message = match value.get_ref() {
                DeValue::Table(_) => {
                    format!(
                        "[{}] has one pair of brackets too few: a file can have several",
                        key.name
                    )
                }
                _ => format!("{} is written as {title}, not as {found}", key.name),
            };
            let diagnostic = Diagnostic::new(Problem::WrongType, value.span(), message);
            self.report(diagnostic.help(format!("write {title}")));
            return Vec::new();
        };
        array.iter().filter_map(|item| self.section(key, item, known, "a table")).collect()
    }

    /// A table within this one.
    pub(crate) fn table(&self, key: &Key, known: &'static TableKeys) -> Option<Section<'a>> {
        self.section(key, self.get(key)?, known, key.expected())
    }

    fn section(
        &self,
        key: &Key,
        value: Entry<'a>,
        known: &'static TableKeys,
        expected: &str,
    ) -> Option<Section<'a>> {
        if let Some(table) = value.get_ref().as_table() {
            return Some(Section::new(known, table, value.span(), self.errors));
        }
        self.report(self.not_expected(key, value, expected));
        None
    }

    /// Where it stands, or its header does.
    pub(super) fn span(&self) -> Span {
        self.span.clone()
    }

    /// Its title in messages.
    pub(super) fn title(&self) -> &'static str {
        self.known.title
    }

    /// The tables in this one whose keys are numbers.
    pub(super) fn tables_by_number(
        &self,
        known: &'static TableKeys,
    ) -> Vec<(Spanned<String>, Section<'a>)> {
        let tables = self.table.iter().filter(|(key, value)| is_instance(key.get_ref(), value));
        let section = |(key, value): (&Spanned<_>, Entry<'a>)| {
            let table = value.get_ref().as_table()?;
            let number: &std::borrow::Cow<'_, str> = key.get_ref();
            let name = Spanned::new(key.span(), number.to_string());
            Some((name, Section::new(known, table, value.span(), self.errors)))
        };
        tables.filter_map(section).collect()
    }

    /// All keys and values, for tables whose keys are names.
    pub(super) fn entries(&self) -> impl Iterator<Item = (Spanned<String>, Entry<'a>)> {
        self.table
            .iter()
            .map(|(key, value)| (Spanned::new(key.span(), key.get_ref().to_string()), value))
    }
}

/// Whether a key and its value are the pins of a single instance: `[block.in.17]`.
pub(super) fn is_instance(key: &str, value: &Spanned<DeValue<'_>>) -> bool {
    value.get_ref().is_table() && key.starts_with(|c: char| c.is_ascii_digit())
}
