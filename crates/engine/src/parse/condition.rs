//! The condition of an alarm, in IEC 61131-3 structured text.
//!
//! Of that grammar it is the part that needs no expressions: one comparison, or one BOOL signal. A bare name is the
//! longest match over letters, digits, `_` and `.`; any other name stands in double quotes. Keywords are read in any
//! case.

use std::ops::Range;

use toml::Spanned;

use crate::Diagnostic;
use crate::config::{AlarmCondition, AlarmOperand, Relation};
use crate::diagnostic::Problem;
use isochrone_model::{parse_based, parse_time_ms};

const EXAMPLES: &str = "a condition is a comparison such as \"level.y > 1.6\", a BOOL signal, or NOT and a BOOL signal";
const KEYWORDS: [&str; 7] = ["NOT", "AND", "OR", "XOR", "MOD", "TRUE", "FALSE"];

type Span = Range<usize>;

/// Reads a condition. `place` gives a place in the file for one in the text.
pub(super) fn condition(
    text: &str,
    place: &dyn Fn(Span) -> Span,
) -> Result<AlarmCondition, Diagnostic> {
    let mut parser = Parser { text, at: 0, place };
    let condition = parser.condition()?;
    match parser.next()? {
        None => Ok(condition),
        Some(rest) => Err(parser.surplus(&rest)),
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    place: &'a dyn Fn(Span) -> Span,
}

/// A token and its place in the text.
struct Token<'a> {
    kind: Kind<'a>,
    span: Span,
}

enum Kind<'a> {
    Keyword(&'static str),
    Name(&'a str),
    /// A number or a time.
    Literal(&'a str),
    Relation(Relation),
    /// What no condition has.
    Other(&'a str),
}

impl<'a> Parser<'a> {
    fn condition(&mut self) -> Result<AlarmCondition, Diagnostic> {
        let Some(first) = self.next()? else {
            let span = 0..self.text.len();
            return Err(self.wrong(span, "there is no condition").help(EXAMPLES));
        };
        if matches!(first.kind, Kind::Keyword("NOT")) {
            let Some(Token { kind: Kind::Name(name), span }) = self.next()? else {
                let message = "NOT stands before a BOOL signal";
                return Err(self.wrong(first.span, message).help(EXAMPLES));
            };
            let signal = self.spanned(span, name.to_owned());
            return Ok(AlarmCondition::Is { signal, value: false });
        }
        let Kind::Name(name) = first.kind else {
            let message =
                format!("a condition begins with a signal, not with {}", self.shown(&first.span));
            return Err(self.wrong(first.span, message).help(EXAMPLES));
        };
        let left = self.spanned(first.span, name.to_owned());
        let Some(next) = self.next()? else {
            return Ok(AlarmCondition::Is { signal: left, value: true });
        };
        let Kind::Relation(relation) = next.kind else { return Err(self.surplus(&next)) };
        let relation = self.spanned(next.span.clone(), relation);
        let Some(operand) = self.next()? else {
            let message = format!("nothing stands behind {}", self.shown(&next.span));
            return Err(self.wrong(next.span, message).help("compare with a number or a signal"));
        };
        let right = self.operand(&operand)?;
        Ok(AlarmCondition::Comparison { left, relation, right: self.spanned(operand.span, right) })
    }

    fn operand(&self, token: &Token<'_>) -> Result<AlarmOperand, Diagnostic> {
        let no_number = |reason: &dyn std::fmt::Display| {
            let message = format!("{}: {reason}", self.shown(&token.span));
            self.wrong(token.span.clone(), message)
        };
        match token.kind {
            Kind::Name(name) => Ok(AlarmOperand::Signal(name.to_owned())),
            Kind::Keyword("TRUE") => Ok(AlarmOperand::Bool(true)),
            Kind::Keyword("FALSE") => Ok(AlarmOperand::Bool(false)),
            Kind::Literal(text) if text.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                parse_time_ms(text).map(AlarmOperand::Time).map_err(|reason| no_number(&reason))
            }
            Kind::Literal(text) => {
                if let Some(based) = parse_based(text) {
                    let number = based.map_err(|reason| no_number(&reason))?.number;
                    return Ok(AlarmOperand::Number(number as f64));
                }
                let number =
                    text.replace('_', "").parse().ok().filter(|number: &f64| number.is_finite());
                number.map(AlarmOperand::Number).ok_or_else(|| no_number(&"this is no number"))
            }
            Kind::Keyword(_) | Kind::Relation(_) | Kind::Other(_) => {
                let message = format!("a signal is not compared with {}", self.shown(&token.span));
                Err(self
                    .wrong(token.span.clone(), message)
                    .help("compare it with a number or a signal"))
            }
        }
    }

    /// A token behind the end of the condition.
    fn surplus(&self, token: &Token<'_>) -> Diagnostic {
        let shown = self.shown(&token.span);
        let (message, help) = match token.kind {
            Kind::Keyword(_) | Kind::Relation(_) => (
                format!("a condition has one comparison, and no {shown} behind it"),
                "make an alarm of each comparison, or wire a BOOL signal that a block computes",
            ),
            // What looks like a number behind a name is the rest of the name.
            Kind::Other("-" | "@" | "/") | Kind::Literal(_)
                if shown.starts_with(['-', '@', '/']) =>
            {
                (
                    format!(
                        "a name with {} stands in double quotes",
                        shown.get(..1).unwrap_or_default()
                    ),
                    "in TOML: when = '\"pump-1.y\" > 1.6'",
                )
            }
            Kind::Other("==" | "!=") => {
                (format!("{shown} is no comparison"), "equality is =, inequality is <>")
            }
            _ => (format!("{shown} is too much"), EXAMPLES),
        };
        self.wrong(token.span.clone(), message).help(help)
    }

    fn next(&mut self) -> Result<Option<Token<'a>>, Diagnostic> {
        let rest = self.text.get(self.at..).unwrap_or_default();
        let start = self.at + rest.len() - rest.trim_start().len();
        let rest = rest.trim_start();
        let Some(first) = rest.chars().next() else { return Ok(None) };
        let (kind, len) = if first == '"' {
            let Some(end) = rest.get(1..).and_then(|rest| rest.find('"')) else {
                let message = "the double quote that begins this name has no other one";
                return Err(self.wrong(start..self.text.len(), message));
            };
            (Kind::Name(rest.get(1..=end).unwrap_or_default()), end + 2)
        } else if let Some(relation) = relation(rest) {
            (Kind::Relation(relation), relation.as_str().len())
        } else if let Some(literal) = literal(rest) {
            (Kind::Literal(literal), literal.len())
        } else if first.is_ascii_alphabetic() || first == '_' {
            let is_of_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
            let name =
                rest.get(..rest.find(|c| !is_of_name(c)).unwrap_or(rest.len())).unwrap_or_default();
            let keyword = KEYWORDS.into_iter().find(|word| word.eq_ignore_ascii_case(name));
            (keyword.map_or(Kind::Name(name), Kind::Keyword), name.len())
        } else {
            let len = ["==", "!="]
                .into_iter()
                .find(|two| rest.starts_with(two))
                .map_or(first.len_utf8(), str::len);
            (Kind::Other(rest.get(..len).unwrap_or_default()), len)
        };
        self.at = start + len;
        Ok(Some(Token { kind, span: start..self.at }))
    }

    fn spanned<T>(&self, span: Span, value: T) -> Spanned<T> {
        Spanned::new((self.place)(span), value)
    }

    fn shown(&self, span: &Span) -> &'a str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    fn wrong(&self, span: Span, message: impl Into<String>) -> Diagnostic {
        let message = format!("[[alarm]] when: {}", message.into());
        Diagnostic::new(Problem::BadCondition, (self.place)(span), message)
    }
}

/// The comparison that a text begins with. What other languages write for one is none.
fn relation(text: &str) -> Option<Relation> {
    let found = Relation::ALL.into_iter().find(|relation| text.starts_with(relation.as_str()))?;
    (!text.starts_with("==")).then_some(found)
}

/// The number or time that a text begins with: `-1.5e-3`, `16#8200`, `T#2s`.
fn literal(text: &str) -> Option<&str> {
    let unsigned = text.trim_start_matches(['+', '-']);
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    let word = unsigned.find(|c| !is_of_word(c)).unwrap_or(unsigned.len());
    let has_base = unsigned.get(word..).is_some_and(|rest| rest.starts_with('#'));
    if !has_base && !unsigned.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let mut before = ' ';
    let mut is_of_literal = |c: char| {
        let is_sign =
            matches!(c, '+' | '-') && (before == '#' || !has_base && matches!(before, 'e' | 'E'));
        before = c;
        is_of_word(c) || is_sign || has_base && c == '#'
    };
    let len = unsigned.find(|c| !is_of_literal(c)).unwrap_or(unsigned.len());
    text.get(..text.len() - unsigned.len() + len)
}
