//! A table of the file that remembers which of its keys were asked for.

use std::cell::RefCell;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::Finding;
use crate::duration::parse_duration_ns;
use crate::finding::Problem;

/// Errors found so far.
pub(crate) type Errors = RefCell<Vec<Finding>>;

/// One table.
pub(crate) struct Section<'a> {
    /// How messages call it: `[[task]]`.
    title: &'static str,
    table: &'a DeTable<'a>,
    /// Where the table's header stands, or the file's start.
    pub(crate) span: Range<usize>,
    known: RefCell<Vec<&'static str>>,
    errors: &'a Errors,
}

impl<'a> Section<'a> {
    pub(crate) fn new(
        title: &'static str,
        table: &'a DeTable<'a>,
        span: Range<usize>,
        errors: &'a Errors,
    ) -> Self {
        Self { title, table, span, known: RefCell::default(), errors }
    }

    pub(crate) fn report(&self, finding: Finding) {
        self.errors.borrow_mut().push(finding);
    }

    /// The value of a key, if it is there.
    pub(crate) fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.known.borrow_mut().push(key);
        self.table.get(key)
    }

    fn wrong_type(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: &str) -> Finding {
        let found = value.get_ref().type_str();
        let message = format!("{} {key} is {expected}, not {}", self.title, article(found));
        Finding::new(Problem::WrongType, value.span(), message)
    }

    /// Reads a key with `read`, which returns `Err(None)` for another TOML type and
    /// `Err(Some(finding))` for a value that the key does not take.
    pub(crate) fn read<T>(
        &self,
        key: &'static str,
        expected: &str,
        read: impl FnOnce(&DeValue<'a>) -> Result<T, Option<Finding>>,
    ) -> Option<Spanned<T>> {
        let value = self.get(key)?;
        match read(value.get_ref()) {
            Ok(read) => Some(Spanned::new(value.span(), read)),
            Err(None) => {
                self.report(self.wrong_type(key, value, expected));
                None
            }
            Err(Some(finding)) => {
                self.report(Finding { span: value.span(), ..finding });
                None
            }
        }
    }

    pub(crate) fn string(&self, key: &'static str) -> Option<Spanned<String>> {
        self.read(key, "a string", |value| value.as_str().map(str::to_owned).ok_or(None))
    }

    /// A name that others refer to.
    pub(crate) fn name(&self, key: &'static str, rule: &Rule) -> Option<Spanned<String>> {
        self.required(key, "\"…\"");
        let name = self.string(key)?;
        if (rule.accepts)(name.get_ref()) {
            return Some(name);
        }
        let message = format!("{} {key} \"{}\" is not a valid name", self.title, name.get_ref());
        self.report(
            Finding::new(Problem::BadName, name.span(), message)
                .help(format!("a name here is {}", rule.form)),
        );
        None
    }

    /// Reports a key that must be there and is not.
    pub(crate) fn required(&self, key: &'static str, example: &str) {
        if !self.table.contains_key(key) {
            let message = format!("{} has no {key}", self.title);
            self.report(
                Finding::new(Problem::MissingKey, self.span.clone(), message)
                    .help(format!("write {key} = {example}")),
            );
        }
    }

    /// A whole number within a range.
    pub(crate) fn integer(
        &self,
        key: &'static str,
        accepts: impl Fn(i64) -> bool,
        range: &str,
    ) -> Option<Spanned<i64>> {
        self.read(key, "a whole number", |value| {
            let integer = value.as_integer().ok_or(None)?;
            match parse_integer(integer) {
                Some(number) if accepts(number) => Ok(number),
                _ => Err(Some(self.out_of_range(key, &integer.to_string(), range))),
            }
        })
    }

    /// A duration within a range, in nanoseconds.
    pub(crate) fn duration_ns(
        &self,
        key: &'static str,
        accepts: impl Fn(u64) -> bool,
        range: &str,
    ) -> Option<Spanned<u64>> {
        self.read(key, "a duration such as \"1ms\"", |value| {
            let text = value.as_str().ok_or(None)?;
            match parse_duration_ns(text) {
                Ok(duration_ns) if accepts(duration_ns) => Ok(duration_ns),
                Ok(_) => Err(Some(self.out_of_range(key, text, range))),
                Err(reason) => {
                    let message = format!("{} {key} \"{text}\": {reason}", self.title);
                    let finding = Finding::new(Problem::OutOfRange, 0..0, message);
                    Err(Some(finding.help(format!("{key} is {range}"))))
                }
            }
        })
    }

    /// One of several words.
    pub(crate) fn choice<T: Copy>(
        &self,
        key: &'static str,
        choices: &[(&'static str, T)],
    ) -> Option<Spanned<T>> {
        self.read(key, "a string", |value| {
            let text = value.as_str().ok_or(None)?;
            let choice = choices.iter().find(|(name, _)| *name == text);
            choice.map(|(_, choice)| *choice).ok_or_else(|| {
                let message = format!("{} {key} cannot be \"{text}\"", self.title);
                let finding = Finding::new(Problem::OutOfRange, 0..0, message);
                Some(finding.did_you_mean(text, choices.iter().map(|(name, _)| *name)))
            })
        })
    }

    pub(crate) fn out_of_range(&self, key: &str, written: &str, range: &str) -> Finding {
        let message = format!("{} {key} {written} is out of range", self.title);
        Finding::new(Problem::OutOfRange, 0..0, message).help(format!("{key} is {range}"))
    }

    /// The tables of an array of tables.
    pub(crate) fn tables(&self, key: &'static str, title: &'static str) -> Vec<Section<'a>> {
        let Some(value) = self.get(key) else { return Vec::new() };
        let Some(array) = value.get_ref().as_array() else {
            self.report(
                self.wrong_type(key, value, "an array of tables").help(format!("write {title}")),
            );
            return Vec::new();
        };
        array
            .iter()
            .filter_map(|item| match item.get_ref().as_table() {
                Some(table) => Some(Section::new(title, table, item.span(), self.errors)),
                None => {
                    self.report(self.wrong_type(key, item, "a table"));
                    None
                }
            })
            .collect()
    }

    /// A table within this one.
    pub(crate) fn table(&self, key: &'static str, title: &'static str) -> Option<Section<'a>> {
        let value = self.get(key)?;
        match value.get_ref().as_table() {
            Some(table) => Some(Section::new(title, table, value.span(), self.errors)),
            None => {
                self.report(self.wrong_type(key, value, "a table"));
                None
            }
        }
    }

    /// All keys and values, for tables whose keys are names.
    pub(crate) fn entries(
        &self,
    ) -> impl Iterator<Item = (Spanned<String>, &'a Spanned<DeValue<'a>>)> {
        self.table
            .iter()
            .map(|(key, value)| (Spanned::new(key.span(), key.get_ref().to_string()), value))
    }

    /// Reports every key that nobody asked for.
    pub(crate) fn finish(self) {
        let known = self.known.borrow();
        for (key, _) in self.entries().filter(|(key, _)| !known.contains(&key.get_ref().as_str())) {
            let message = format!("{} has no key \"{}\"", self.title, key.get_ref());
            self.report(
                Finding::new(Problem::UnknownKey, key.span(), message)
                    .did_you_mean(key.get_ref(), known.iter().copied()),
            );
        }
    }
}

/// What a name may look like.
pub(crate) struct Rule {
    pub(crate) accepts: fn(&str) -> bool,
    pub(crate) form: &'static str,
}

/// The number of a TOML integer in any notation, if it fits.
pub(crate) fn parse_integer(integer: &toml::de::DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}

fn article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}
