//! Errors of a file that is not TOML.

use std::ops::Range;

use crate::Diagnostic;
use crate::diagnostic::Problem;
use crate::keys::TABLES;
use isochrone_model::parse_duration_ns;

/// Places that are not TOML, before anything of a configuration, from which on the file is taken for
/// something else.
const FOREIGN: usize = 10;

/// What the parser says of a key that stands twice.
const DUPLICATE: &str = "duplicate key";

/// A place that is not TOML, and what the parser says of it.
pub(super) type SyntaxError<'a> = (Range<usize>, &'a str);

/// One diagnostic for each line that is not TOML, or a single one if the file is no configuration.
pub(super) fn diagnostics(text: &str, mut errors: Vec<SyntaxError<'_>>) -> Vec<Diagnostic> {
    errors.sort_by_key(|(span, _)| span.start);
    // A parser that recovers stumbles over what is left of the line.
    errors.dedup_by_key(|(span, _)| line(text, span.start).start);
    let mut diagnostics = Vec::new();
    let once: Vec<_> = errors.iter().filter_map(|error| single_table(text, error)).collect();
    if let Some((first, key)) = once.first() {
        // What the second table repeats of the first is no mistake of its own.
        errors.retain(|(span, message)| span.start < first.start || *message != DUPLICATE);
        let message = format!("[{key}] stands twice, with one pair of brackets too few");
        let help = format!("write [[{key}]], for each of them");
        diagnostics.push(Diagnostic::new(Problem::Syntax, first.clone(), message).help(help));
    }
    match errors.first() {
        Some((span, message)) if errors.len() > FOREIGN && !has_header(text, span.start) => {
            let others = errors.len() - 1;
            let message = format!(
                "this is not a configuration: it is not TOML here ({message}), nor in {others} other lines"
            );
            let help = "a configuration is TOML, such as [node] name = \"level\", then [[task]] name = \
                        \"main\", period = \"1ms\"";
            vec![Diagnostic::new(Problem::Syntax, span.clone(), message).help(help)]
        }
        _ => {
            diagnostics.extend(errors.into_iter().map(|error| diagnostic(text, error)));
            diagnostics
        }
    }
}

/// The table that stands a second time in single brackets, and may stand so in double ones.
fn single_table<'a>(text: &'a str, error: &SyntaxError<'_>) -> Option<(Range<usize>, &'a str)> {
    let (span, message) = error;
    let header = text.get(line(text, span.start))?.trim();
    let key = header.strip_prefix('[')?.split(']').next()?.trim();
    let is_array = || TABLES.iter().any(|table| table.title == format!("[[{key}]]"));
    (*message == DUPLICATE && is_array()).then(|| (span.clone(), key))
}

/// Whether one of a configuration's tables begins before a byte.
fn has_header(text: &str, before: usize) -> bool {
    let lines = text.get(..before).unwrap_or_default().lines();
    lines.map(str::trim).any(|line| TABLES.iter().any(|table| line.starts_with(table.title)))
}

fn diagnostic(text: &str, (span, message): SyntaxError<'_>) -> Diagnostic {
    let help = decimal_comma(text, span.start)
        .or_else(|| number_with_unit(text, span.start))
        .or_else(|| value(text, span.start).and_then(quoted));
    let diagnostic = Diagnostic::new(Problem::Syntax, span, format!("this is not TOML: {message}"));
    match help {
        Some(help) => diagnostic.help(help),
        None => diagnostic,
    }
}

/// The value that stands at a byte, or just before it, behind its key.
fn value(text: &str, byte: usize) -> Option<&str> {
    let line = line(text, byte);
    let before = text.get(line.start..byte)?;
    let start = line.start + before.rfind('=')? + 1;
    let value = text.get(start..line.end)?.trim_start();
    value.split(|c: char| c.is_whitespace() || ",]}".contains(c)).next()
}

/// How a number with a decimal comma is written.
fn decimal_comma(text: &str, byte: usize) -> Option<String> {
    let line = line(text, byte);
    let start = line.start + text.get(line.start..byte)?.rfind('=')? + 1;
    let (whole, rest) = text.get(start..line.end)?.trim_start().split_once(',')?;
    let digits = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let (decimals, after) = rest.split_at(end);
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    let ends = after.is_empty() || after.starts_with([' ', '\t', '\r', ',', '}', '#']);
    (is_number(digits) && is_number(decimals) && ends)
        .then(|| format!("decimals have a point, not a comma: {whole}.{decimals}"))
}

/// How a number with a unit behind it is written; a time has one, in quotes.
fn number_with_unit(text: &str, byte: usize) -> Option<String> {
    let line = line(text, byte);
    let start = line.start + text.get(line.start..byte)?.rfind('=')? + 1;
    let value = text.get(start..line.end)?.split([',', ']', '}', '#']).next()?.trim();
    let (number, _) = value.split_once(' ')?;
    number.parse::<f64>().ok()?;
    Some(match parse_duration_ns(value) {
        Ok(_) => format!("a text needs quotes: \"{value}\""),
        Err(_) => format!("a number stands alone, without a unit: {number}"),
    })
}

/// How a value that lacks its quotes is written.
fn quoted(value: &str) -> Option<String> {
    let is_bare = value.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    if !is_bare || value.contains(['"', '\'']) {
        return None;
    }
    Some(match value.to_ascii_lowercase().as_str() {
        word @ ("true" | "false") => format!("write {word}, in lowercase letters"),
        _ => format!("a text needs quotes: \"{value}\""),
    })
}

/// The line that a byte is in, without its end.
fn line(text: &str, byte: usize) -> Range<usize> {
    let start = text.get(..byte).and_then(|before| before.rfind('\n')).map_or(0, |end| end + 1);
    let rest = text.get(start..).unwrap_or_default();
    start..start + rest.find('\n').unwrap_or(rest.len())
}
