//! Every key of a configuration file, declared once: the parser, its error messages and the reference
//! page are derived from here.

mod rules;
mod tables;

pub(crate) use rules::{MOST_ENTRY_NAME, VALUE_TYPES};
pub use tables::TABLES;
pub(crate) use tables::{
    alarm, block, file, follow, input, limits, node, on_overrun, on_stale, out, output, pins,
    protect, task, units, variable,
};

/// A table of a configuration file.
#[derive(Debug)]
pub struct TableKeys {
    /// Its title in messages: `[[task]]`.
    pub title: &'static str,
    /// What it is for.
    pub raw_doc: &'static str,
    /// Its keys in the order in which the reference lists them; empty where they are names.
    pub keys: &'static [&'static Key],
}

/// A key of a table.
#[derive(Debug)]
pub struct Key {
    /// As it is written.
    pub name: &'static str,
    /// The form of its value.
    pub form: Form,
    /// Unit of a number; empty if it has none.
    pub unit: &'static str,
    /// What applies if the key is left out.
    pub absent: Absent,
    /// Version that introduced it.
    pub since: &'static str,
    pub(crate) raw_doc: &'static str,
}

/// The form of a key's value.
#[derive(Debug)]
#[non_exhaustive]
pub enum Form {
    /// The name of something.
    Name(NameRule),
    /// A text.
    Text,
    /// A text for people: one line of at most so many bytes.
    Line(usize),
    /// An array of texts.
    Texts,
    /// One of these words.
    Word(&'static [&'static str]),
    /// One of these words, or a table of this form.
    WordOrTable(&'static [&'static str], &'static str),
    /// `true` or `false`.
    Truth,
    /// A whole number.
    Integer(Range<i64>),
    /// One of these words, or a whole number.
    WordOrInteger(&'static [&'static str], Range<i64>),
    /// A number with decimals.
    Number(Range<f64>),
    /// A duration, in nanoseconds: a text such as `"2.5ms"`.
    Duration(Range<u64>),
    /// A value of the type that the same table names.
    Value,
    /// The smallest and the largest of the numbers that are accepted.
    Bounds,
    /// A table.
    Table,
    /// An array of tables.
    Tables,
}

/// The values that a key accepts.
#[derive(Debug)]
pub struct Range<T> {
    pub(crate) accepts: fn(T) -> bool,
    /// In words.
    pub words: &'static str,
}

/// The rule for a name.
#[derive(Debug)]
pub struct NameRule {
    pub(crate) accepts: fn(&str) -> bool,
    /// In words.
    pub words: &'static str,
}

/// What applies if a key is left out.
#[derive(Debug)]
#[non_exhaustive]
pub enum Absent {
    /// An error; this is an example of what to write.
    Required(&'static str),
    /// This value.
    Default(&'static str),
    /// As described by this text.
    Means(&'static str),
}

impl TableKeys {
    /// What it is for.
    pub fn doc(&self) -> &'static str {
        self.raw_doc.trim_ascii()
    }
}

impl Key {
    /// What it means.
    pub fn doc(&self) -> &'static str {
        self.raw_doc.trim_ascii()
    }

    /// What messages say is expected.
    pub(crate) fn expected(&self) -> &'static str {
        match self.form {
            Form::Name(_) | Form::Text | Form::Line(_) | Form::Word(_) => "a text",
            Form::WordOrTable(..) => "a text or a table",
            Form::WordOrInteger(..) => "a whole number or a text",
            Form::Truth => "true or false",
            Form::Texts => "an array of texts",
            Form::Integer(_) => "a whole number",
            Form::Number(_) => "a number such as 0.10",
            Form::Duration(_) => "a duration such as \"1ms\"",
            Form::Value => "a number",
            Form::Bounds => "an array of two numbers, smallest and largest",
            Form::Table => "a table",
            Form::Tables => "an array of tables",
        }
    }

    /// The accepted values, in words; empty if there is no restriction.
    pub fn range(&self) -> String {
        match &self.form {
            Form::Name(rule) => rule.words.into(),
            Form::Line(most) => format!("one line, at most {most} bytes"),
            Form::Word(words) => words_of(words),
            Form::WordOrTable(words, table) => format!("{} or `{table}`", words_of(words)),
            Form::WordOrInteger(words, Range { words: number, .. }) => {
                format!("{} or {number}", words_of(words))
            }
            Form::Integer(Range { words, .. }) => (*words).into(),
            Form::Number(Range { words, .. }) => (*words).into(),
            Form::Duration(Range { words, .. }) => (*words).into(),
            Form::Value => "what the `type` holds; not NaN".into(),
            Form::Bounds => {
                "the first not greater than the second; `-inf` and `inf` are no limit".into()
            }
            Form::Text | Form::Texts | Form::Truth | Form::Table | Form::Tables => String::new(),
        }
    }
}

fn words_of(words: &[&str]) -> String {
    words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}
