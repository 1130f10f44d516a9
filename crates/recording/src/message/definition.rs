//! The text of a definition, line by line.

use std::collections::HashSet;

use super::{DefinitionError, Extent, Primitive, RosValue};

/// What a text says of a field, before its type is known.
pub(super) struct WrittenField {
    /// The number of its line, from 1.
    pub(super) line: usize,
    pub(super) base: WrittenBase,
    pub(super) extent: Extent,
    pub(super) name: String,
    pub(super) default: Option<RosValue>,
}

/// A type as it is written.
pub(super) enum WrittenBase {
    Primitive(Primitive),
    Text(Option<usize>),
    /// `geometry_msgs/Vector3`, or `Vector3` of the same package.
    Message(String),
}

/// The fields of a definition, without its constants.
pub(super) fn fields(name: &str, text: &str) -> Result<Vec<WrittenField>, DefinitionError> {
    let (mut fields, mut names) = (Vec::new(), HashSet::new());
    for (index, line) in text.lines().enumerate() {
        let line = without_comment(line).trim();
        if line.is_empty() {
            continue;
        }
        let number = index + 1;
        let wrong = |what: String| DefinitionError(format!("{name}, line {number}: {what}"));
        let (written_type, rest) =
            line.split_once(char::is_whitespace).map_or((line, ""), |(a, b)| (a, b.trim()));
        let (base, extent) = parse_type(written_type).map_err(wrong)?;
        let end = rest.find(|c: char| c.is_whitespace() || c == '=').unwrap_or(rest.len());
        let (field, rest) = (&rest[..end], rest[end..].trim());
        if field.is_empty() || !field.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(wrong(format!(
                "{field:?} is no name of a field; a line is `type name`, `type name default` or `type NAME=value`"
            )));
        }
        if let Some(value) = rest.strip_prefix('=') {
            parse_value(&base, Extent::One, value.trim()).map_err(wrong)?;
            continue;
        }
        if !names.insert(field) {
            return Err(wrong(format!("there is a field {field} already")));
        }
        let default = (!rest.is_empty()).then(|| parse_value(&base, extent, rest));
        let default = default.transpose().map_err(wrong)?;
        fields.push(WrittenField { line: number, base, extent, name: field.to_owned(), default });
    }
    Ok(fields)
}

/// A line up to its `#`, but for one within quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    for (at, c) in line.char_indices() {
        match (quote, c) {
            (None, '#') => return &line[..at],
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if open == c => quote = None,
            _ => {}
        }
    }
    // An apostrophe in a comment opens nothing.
    if quote.is_some() { line.split('#').next().unwrap_or_default() } else { line }
}

fn parse_type(written: &str) -> Result<(WrittenBase, Extent), String> {
    let (base, extent) = match written.split_once('[') {
        None => (written, Extent::One),
        Some((base, rest)) => {
            let Some(count) = rest.strip_suffix(']') else {
                return Err(format!("{written:?} lacks its closing bracket"));
            };
            let number = |text: &str| {
                text.parse::<usize>().map_err(|_| format!("{text:?} is no number of elements"))
            };
            let extent = match (count, count.strip_prefix("<=")) {
                ("", _) => Extent::Sequence(None),
                (_, Some(most)) => Extent::Sequence(Some(number(most)?)),
                (count, None) => match number(count)? {
                    0 => {
                        return Err(format!(
                            "{written:?} has no elements; an array has one or more"
                        ));
                    }
                    count => Extent::Array(count),
                },
            };
            (base, extent)
        }
    };
    let base = match (Primitive::named(base), base) {
        (Some(primitive), _) => WrittenBase::Primitive(primitive),
        (None, "string") => WrittenBase::Text(None),
        (None, "wstring") => {
            return Err(
                "wstring is not supported, as the makers of DDS encode it differently".into()
            );
        }
        (None, base) => match base.strip_prefix("string<=") {
            Some(most) => {
                WrittenBase::Text(Some(most.parse().map_err(|_| format!("{most:?} is no length"))?))
            }
            None => WrittenBase::Message(base.to_owned()),
        },
    };
    Ok((base, extent))
}

/// The value of a constant, or a default.
fn parse_value(base: &WrittenBase, extent: Extent, written: &str) -> Result<RosValue, String> {
    let (most, is_exact) = match extent {
        Extent::One => return parse_one(base, written),
        Extent::Array(count) => (count, true),
        Extent::Sequence(most) => (most.unwrap_or(usize::MAX), false),
    };
    let inner = written.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let Some(inner) = inner else { return Err(format!("{written:?} is no list such as [1, 2]")) };
    let elements = inner.split(',').map(str::trim).filter(|element| !element.is_empty());
    let elements: Vec<RosValue> =
        elements.map(|element| parse_one(base, element)).collect::<Result<_, _>>()?;
    if elements.len() > most || is_exact && elements.len() != most {
        return Err(format!("{written} has {} elements, and {most} are possible", elements.len()));
    }
    Ok(match base {
        WrittenBase::Primitive(primitive) if !primitive.is_wide() => {
            RosValue::Numbers(elements.iter().filter_map(RosValue::number).collect())
        }
        _ => RosValue::Several(elements),
    })
}

fn parse_one(base: &WrittenBase, written: &str) -> Result<RosValue, String> {
    let no = |kind: &str| format!("{written:?} is no {kind}");
    match base {
        WrittenBase::Text(_) => {
            let unquoted = ['"', '\'']
                .iter()
                .find_map(|quote| written.strip_prefix(*quote)?.strip_suffix(*quote));
            Ok(RosValue::Text(unquoted.unwrap_or(written).to_owned()))
        }
        WrittenBase::Message(name) => Err(format!("a {name} has no default")),
        WrittenBase::Primitive(primitive) => match primitive.range() {
            None => {
                let number: f64 = written.parse().map_err(|_| no(primitive.name()))?;
                // As a message has it.
                let held = match primitive {
                    Primitive::Float32 => f64::from(number as f32),
                    _ => number,
                };
                let fits = held.is_finite() || !number.is_finite();
                fits.then_some(RosValue::Number(held)).ok_or_else(|| no(primitive.name()))
            }
            Some((least, most)) => {
                let integer = match written {
                    "true" | "True" if *primitive == Primitive::Bool => Some(1),
                    "false" | "False" if *primitive == Primitive::Bool => Some(0),
                    _ => integer(written),
                };
                let fits = integer.filter(|integer| (least..=most).contains(integer));
                let integer = fits.ok_or_else(|| no(primitive.name()))?;
                Ok(if primitive.is_wide() {
                    RosValue::Integer(integer)
                } else {
                    RosValue::Number(integer as f64)
                })
            }
        },
    }
}

/// A whole number, also in hexadecimal, octal or binary.
fn integer(written: &str) -> Option<i128> {
    let (sign, digits) = match written.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, written.strip_prefix('+').unwrap_or(written)),
    };
    let radix = [("0x", 16), ("0X", 16), ("0o", 8), ("0b", 2)];
    let other =
        radix.iter().find_map(|(prefix, radix)| Some((digits.strip_prefix(prefix)?, *radix)));
    let (digits, radix) = other.unwrap_or((digits, 10));
    i128::from_str_radix(digits, radix).ok()?.checked_mul(sign)
}
