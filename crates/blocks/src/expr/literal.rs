//! Literals: numbers, with and without a base or type, times, TRUE and FALSE.

use alloc::format;
use alloc::string::{String, ToString};

use super::types::Type;
use crate::PinType;
use crate::literal::{parse_based, parse_time_ms};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Literal {
    pub(super) of: Type,
    pub(super) value: f64,
}

/// What is wrong with a literal, and the way out.
pub(super) type Fault = (String, Option<String>);

impl Literal {
    fn of(of: PinType, value: f64) -> Self {
        Self { of: Type::Of(of), value }
    }

    /// TRUE or FALSE, in any case.
    pub(super) fn of_word(word: &str) -> Option<Self> {
        let value = ["FALSE", "TRUE"].iter().position(|it| it.eq_ignore_ascii_case(word))?;
        Some(Self::of(PinType::Bool, value as f64))
    }
}

/// The literal that a text begins with, and its length. `None`: it begins with something else.
pub(super) fn literal(text: &str) -> Option<(Result<Literal, Fault>, usize)> {
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    let first = text.chars().next()?;
    let word = text.find(|c| !is_of_word(c)).unwrap_or(text.len());
    let is_typed = first.is_ascii_alphabetic() && text.get(word..)?.starts_with('#');
    let has_digit = text.trim_start_matches('.').starts_with(|c: char| c.is_ascii_digit());
    if !is_typed && !(has_digit && (first.is_ascii_digit() || first == '.')) {
        return None;
    }
    // What stands since the last #: the part in which an e is the mark of an exponent, unless it has a base.
    let (mut since, mut has_base) = (0, false);
    let mut end = text.len();
    for (at, c) in text.char_indices() {
        let part = text.get(since..at).unwrap_or_default();
        let is_sign = matches!(c, '+' | '-')
            && (part.is_empty() && since > 0 || !has_base && is_before_exponent(part));
        if c == '#' {
            has_base = part.starts_with(|c: char| c.is_ascii_digit());
            since = at + 1;
        } else if !is_of_word(c) && !is_sign {
            end = at;
            break;
        }
    }
    let text = text.get(..end)?;
    Some((read(text), end))
}

/// Whether a text is digits and the mark of an exponent: `1.5e`.
fn is_before_exponent(text: &str) -> bool {
    let digits = text.strip_suffix(['e', 'E']).unwrap_or_default().trim_start_matches(['+', '-']);
    !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit() || matches!(c, '_' | '.'))
}

fn read(text: &str) -> Result<Literal, Fault> {
    let Some((prefix, body)) = text.split_once('#') else { return without_prefix(text) };
    if prefix.starts_with(|c: char| c.is_ascii_digit()) {
        return whole(text);
    }
    let of = match &*prefix.to_ascii_uppercase() {
        "T" | "TIME" => return time(text),
        "INT" => PinType::Int,
        "WORD" => PinType::Word,
        "LREAL" => PinType::Lreal,
        "BOOL" => PinType::Bool,
        _ => {
            let message = format!("{text}: there are no literals of type {prefix}");
            let help = "types of literals are INT#, LREAL#, BOOL#, WORD# and TIME# or T#";
            return Err((message, Some(help.to_string())));
        }
    };
    if let (PinType::Bool, Some(truth)) = (of, Literal::of_word(body)) {
        return Ok(truth);
    }
    let unsigned = body.trim_start_matches(['+', '-']);
    let number = if unsigned.contains('#') { whole(unsigned)? } else { without_prefix(unsigned)? };
    let is_signed = matches!(of, PinType::Int | PinType::Lreal);
    let value = match body.strip_suffix(unsigned).unwrap_or_default() {
        "" => number.value,
        "+" if is_signed => number.value,
        "-" if of == PinType::Lreal => -number.value,
        "-" if is_signed => 0.0 - number.value,
        _ => f64::NAN,
    };
    let is_number = of == PinType::Lreal && number.of == Type::Of(of) || number.of == Type::Whole;
    if !is_number || value.is_nan() || !of.holds(value) {
        return Err((format!("{text}: {body} is no value of {of}"), None));
    }
    Ok(Literal::of(of, value))
}

fn time(text: &str) -> Result<Literal, Fault> {
    let ms = parse_time_ms(text).map_err(|reason| (format!("{text}: {reason}"), None))?;
    Ok(Literal::of(PinType::Time, f64::from(ms)))
}

/// A whole number with a base.
fn whole(text: &str) -> Result<Literal, Fault> {
    match parse_based(text) {
        Some(Ok(based)) => Ok(Literal { of: Type::Whole, value: based.number as f64 }),
        Some(Err(reason)) => Err((format!("{text}: {reason}"), None)),
        None => Err((format!("{text}: a base is 2, 8 or 16"), None)),
    }
}

/// Digits, or a time without `T#`.
fn without_prefix(text: &str) -> Result<Literal, Fault> {
    let no_number = |help: Option<String>| (format!("{text}: this is no number"), help);
    for (other, base) in [("0x", 16), ("0X", 16), ("0o", 8), ("0b", 2)] {
        if let Some(digits) = text.strip_prefix(other) {
            return Err(no_number(Some(format!("write {base}#{digits}"))));
        }
    }
    if text.contains(|c: char| c.is_ascii_alphabetic() && !matches!(c, 'e' | 'E')) {
        return time(text);
    }
    if text.starts_with('.') {
        return Err(no_number(Some(format!("write 0{text}"))));
    }
    let mantissa = text.split(['e', 'E']).next().unwrap_or_default();
    let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let stands_between_digits = |(at, sign): (usize, &str)| {
        let before = text.get(..at).and_then(|before| before.chars().next_back());
        let behind = text.get(at + sign.len()..).and_then(|behind| behind.chars().next());
        is_digit(before) && is_digit(behind)
    };
    let is_well_formed = text.match_indices(['_', '.']).all(stands_between_digits);
    let value: Option<f64> = text.replace('_', "").parse().ok().filter(|_| is_well_formed);
    match value {
        None => {
            let digits = mantissa.strip_suffix('.').map(|digits| format!("write {digits}.0"));
            Err(no_number(digits.filter(|_| mantissa == text)))
        }
        Some(value) if value.is_infinite() => {
            Err((format!("{text}: LREAL holds numbers up to 1.8e308"), None))
        }
        Some(value) if text.chars().all(|c| c.is_ascii_digit() || c == '_') => {
            Ok(Literal { of: Type::Whole, value })
        }
        Some(value) => Ok(Literal::of(PinType::Lreal, value)),
    }
}
