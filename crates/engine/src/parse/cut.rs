//! Numbers that a comment cuts short: in TOML, `16#64` is 16 and a comment.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::Diagnostic;
use crate::diagnostic::Problem;
use isochrone_model::parse_based;

/// A diagnostic for each number of a document that `#` follows directly.
pub(super) fn diagnostics(text: &str, document: &DeTable<'_>) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut values: Vec<&Spanned<DeValue<'_>>> = document.values().collect();
    while let Some(value) = values.pop() {
        match value.get_ref() {
            DeValue::Table(table) => values.extend(table.values()),
            DeValue::Array(array) => values.extend(array.iter()),
            DeValue::Integer(_) | DeValue::Float(_) => {
                diagnostics.extend(diagnostic(text, value.span(), Problem::OutOfRange));
            }
            _ => {}
        }
    }
    diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
    diagnostics
}

/// The first such number of a text that is not TOML of which the comment swallows the end of a table or an array:
/// the parser, whose errors stand at these places, stumbles over what follows it.
pub(super) fn first_in_broken(text: &str, stumbles: &[usize]) -> Option<Diagnostic> {
    let mut next = 0;
    text.split_inclusive('\n').find_map(|line| {
        let start = next;
        next += line.len();
        let before = line.get(..line.find('#')?)?;
        let number = before.rfind(|c: char| !c.is_ascii_digit() && !"+-_.".contains(c))? + 1;
        let is_value = before.get(..number)?.trim_end().ends_with(['=', ',', '[']);
        let is_quoted = ['"', '\''].iter().any(|mark| before.matches(*mark).count() % 2 == 1);
        let has_digits = before.ends_with(|c: char| c.is_ascii_digit());
        let end = start + before.len();
        let next = behind_comments(text, end);
        let is_at_fault = |at: &usize| *at == end || *at == next && next < text.len();
        (is_value && !is_quoted && has_digits && stumbles.iter().any(is_at_fault))
            .then(|| diagnostic(text, start + number..end, Problem::Syntax))?
    })
}

/// Where the first thing behind a byte stands that is neither blank nor a comment.
fn behind_comments(text: &str, mut at: usize) -> usize {
    loop {
        let rest = text.get(at..).unwrap_or_default();
        let thing = rest.trim_start();
        at += rest.len() - thing.len();
        if !thing.starts_with('#') {
            return at;
        }
        at += thing.find('\n').unwrap_or(thing.len());
    }
}

/// What to say of the number that stands at a place.
fn diagnostic(text: &str, span: Range<usize>, problem: Problem) -> Option<Diagnostic> {
    let number = text.get(span.clone())?;
    let comment = text.get(span.end..)?.strip_prefix('#')?;
    let end = comment.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(comment.len());
    let written = format!("{number}#{}", comment.get(..end)?);
    let message = format!("{written} is read as {number}: in TOML, # begins a comment");
    let help = suggestion(&written).unwrap_or_else(|| "leave a blank before a comment".into());
    let span = span.start..span.end + 1 + end;
    Some(Diagnostic::new(problem, span, message).help(help))
}

/// What to write for a number with a base.
fn suggestion(written: &str) -> Option<String> {
    let number = parse_based(written)?.ok()?.number;
    Some(format!("write {number}; a pin of type INT or WORD also takes \"{written}\", in quotes"))
}
