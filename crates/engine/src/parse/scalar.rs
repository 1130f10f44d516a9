//! Values of keys that are one thing: a text, a number, a duration, a word.

use isochrone_blocks::PinType;
use toml::Spanned;

use super::connection::connection;
use super::integer::parse_integer;
use super::section::Section;
use super::suggestions::{plain_duration, suggested_value};
use crate::Diagnostic;
use crate::config::Connection;
use crate::diagnostic::Problem;
use crate::keys::{Form, Key, VALUE_TYPES};
use isochrone_model::{parse_based, parse_duration_ns, parse_time_ms, time_help};

impl Section<'_> {
    pub(crate) fn string(&self, key: &Key) -> Option<Spanned<String>> {
        self.read(key, |value| value.as_str().map(str::to_owned).ok_or(None))
    }

    /// A name that others refer to.
    pub(super) fn name(&self, key: &Key) -> Option<Spanned<String>> {
        let name = self.string(key)?;
        let Form::Name(rule) = &key.form else { return Some(name) };
        if (rule.accepts)(name.get_ref()) {
            return Some(name);
        }
        let message =
            format!("{} {} \"{}\" is not a valid name", self.title(), key.name, name.get_ref());
        self.report(
            Diagnostic::new(Problem::BadName, name.span(), message)
                .help(format!("a name here is {}", rule.words)),
        );
        None
    }

    /// A whole number within the key's range.
    pub(crate) fn integer<T: TryFrom<i64>>(&self, key: &Key) -> Option<Spanned<T>> {
        self.read(key, |value| {
            let integer = value.as_integer().ok_or(None)?;
            let (Form::Integer(range) | Form::WordOrInteger(_, range)) = &key.form else {
                return Err(None);
            };
            let number = parse_integer(integer).filter(|number| (range.accepts)(*number));
            number
                .and_then(|number| T::try_from(number).ok())
                .ok_or_else(|| Some(self.out_of_range(key, &integer.to_string(), range.words)))
        })
    }

    /// A number with decimals within the key's range.
    pub(crate) fn number(&self, key: &Key) -> Option<Spanned<f64>> {
        self.read(key, |value| {
            // A whole number is one with decimals too, where there is no doubt about its type.
            let whole = value.as_integer().and_then(parse_integer).map(|number| number as f64);
            let float = || value.as_float().and_then(|float| float.as_str().parse().ok());
            let number = whole.or_else(float);
            match (&key.form, number) {
                (Form::Number(range), Some(number)) if (range.accepts)(number) => Ok(number),
                (Form::Number(range), Some(number)) => {
                    Err(Some(self.out_of_range(key, &number.to_string(), range.words)))
                }
                _ => Err(None),
            }
        })
    }

    /// A duration within the key's range, in nanoseconds.
    pub(crate) fn duration_ns(&self, key: &Key) -> Option<Spanned<u64>> {
        self.read(key, |value| {
            let text = value.as_str().ok_or(None)?;
            let Form::Duration(range) = &key.form else { return Err(None) };
            match parse_duration_ns(text) {
                Ok(duration_ns) if (range.accepts)(duration_ns) => Ok(duration_ns),
                Ok(_) => Err(Some(self.out_of_range(key, text, range.words))),
                Err(reason) => {
                    let (title, name) = (self.title(), key.name);
                    let message = format!("{title} {name} \"{text}\": {reason}");
                    let diagnostic = Diagnostic::new(Problem::OutOfRange, 0..0, message);
                    let help = plain_duration(text, range).map_or_else(
                        || format!("{name} is {}, such as \"10ms\"", range.words),
                        |plain| format!("write {name} = \"{plain}\""),
                    );
                    Err(Some(diagnostic.help(help)))
                }
            }
        })
    }

    /// One of the key's words: the choice in its place.
    pub(crate) fn choice<T: Copy>(&self, key: &Key, choices: &[T]) -> Option<Spanned<T>> {
        self.read(key, |value| {
            let text = value.as_str().ok_or(None)?;
            let (Form::Word(words) | Form::WordOrTable(words, _) | Form::WordOrInteger(words, _)) =
                &key.form
            else {
                return Err(None);
            };
            let chosen = words.iter().zip(choices).find(|(word, _)| **word == text);
            chosen.map(|(_, choice)| *choice).ok_or_else(|| {
                let message = format!("{} {} cannot be \"{text}\"", self.title(), key.name);
                let diagnostic = Diagnostic::new(Problem::OutOfRange, 0..0, message);
                Some(match suggested_value(key, value) {
                    Some(suggested) => diagnostic.help(format!("write {} = {suggested}", key.name)),
                    None => diagnostic.did_you_mean(text, words.iter().copied()),
                })
            })
        })
    }

    /// `true` or `false`.
    pub(crate) fn truth(&self, key: &Key) -> Option<Spanned<bool>> {
        self.read(key, |value| value.as_bool().ok_or(None))
    }

    /// The type of an input's or a variable's values, LREAL if there is none; `None` for one that does not exist.
    pub(super) fn value_type(&self, key: &Key) -> Option<PinType> {
        match (self.choice(key, &VALUE_TYPES), self.get(key)) {
            (None, Some(_)) => None,
            (value_type, _) => Some(value_type.map_or(PinType::Lreal, Spanned::into_inner)),
        }
    }

    /// A value of a type: a number, for a BOOL also true or false, for a TIME also `"T#100ms"`, for an INT or
    /// WORD also `"16#64"`.
    pub(super) fn value(&self, key: &Key, value_type: Option<PinType>) -> Option<Spanned<f64>> {
        self.read(key, |value| {
            let (title, name) = (self.title(), key.name);
            let number = match (connection(value), value_type) {
                (Some(Connection::Integer(integer)), _) => integer as f64,
                (Some(Connection::Float(float)), _) => float,
                (Some(Connection::Bool(bool)), Some(PinType::Bool) | None) => {
                    f64::from(u8::from(bool))
                }
                (Some(Connection::Wire(text)), Some(PinType::Int | PinType::Word))
                    if let Some(based) = parse_based(&text) =>
                {
                    let wrong = |reason| {
                        let message = format!("{title} {name} \"{text}\": {reason}");
                        Some(Diagnostic::new(Problem::OutOfRange, 0..0, message))
                    };
                    based.map_err(wrong)?.number as f64
                }
                (Some(Connection::Wire(text)), Some(PinType::Time)) => {
                    let wrong = |reason| {
                        let message = format!("{title} {name} \"{text}\": {reason}");
                        let diagnostic = Diagnostic::new(Problem::OutOfRange, 0..0, message);
                        Some(diagnostic.help(time_help(name, &text)))
                    };
                    f64::from(parse_time_ms(&text).map_err(wrong)?)
                }
                _ => return Err(None),
            };
            if !number.is_nan() && value_type.is_none_or(|value_type| value_type.holds(number)) {
                return Ok(number);
            }
            let whole = value_type.filter(|_| number.is_finite() && number.fract() != 0.0);
            if let Some((value_type, (min, max))) = whole.and_then(|t| Some((t, t.range()?))) {
                let message = format!("{title} {name} {number} is not a whole number");
                let help = format!("{value_type} holds whole numbers from {min} to {max}");
                let diagnostic = Diagnostic::new(Problem::OutOfRange, 0..0, message);
                return Err(Some(diagnostic.help(help)));
            }
            let holder = value_type.map_or("LREAL", PinType::as_str);
            let range = format!("a number that {holder} can hold, and not NaN");
            Err(Some(self.out_of_range(key, &number.to_string(), &range)))
        })
    }

    pub(super) fn out_of_range(&self, key: &Key, written: &str, range: &str) -> Diagnostic {
        let message = format!("{} {} {written} is out of range", self.title(), key.name);
        Diagnostic::new(Problem::OutOfRange, 0..0, message).help(format!("{} is {range}", key.name))
    }
}
