//! From text to tokens.

use core::ops::Range;

use alloc::format;

use super::Mistake;
use super::literal::{Literal, literal};
use super::operator::Operator;

/// A token and its place in the text.
#[derive(Clone, Debug)]
pub(super) struct Token<'a> {
    pub(super) kind: Kind<'a>,
    pub(super) span: Range<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind<'a> {
    /// A bare name: of a signal, or of a function or of one of its inputs.
    Word(&'a str),
    /// A name in double quotes, without them.
    Quoted(&'a str),
    Literal(Literal),
    Operator(Operator),
    Not,
    Open,
    Close,
    Comma,
    /// `:=`
    Gives,
    End,
}

/// What other languages write, and what is written here.
const FOREIGN: [(&str, &str); 27] = [
    ("≥", "at least is >="),
    ("≤", "at most is <="),
    ("≠", "inequality is <>"),
    ("×", "a product is a * b"),
    ("÷", "a quotient is a / b"),
    ("==", "equality is ="),
    ("!=", "inequality is <>"),
    ("=<", "at most is <="),
    ("=>", "at least is >="),
    ("&&", "write AND"),
    ("||", "write OR"),
    ("|", "write OR"),
    ("!", "write NOT"),
    ("~", "write NOT"),
    ("%", "the remainder of a division of INTs is a MOD b"),
    ("^", "a power is a ** b"),
    ("?", "a choice is SEL(condition, if_false, if_true)"),
    ("'", "a name with other characters than letters, digits, _ and . stands in double quotes"),
    ("`", "a name with other characters than letters, digits, _ and . stands in double quotes"),
    ("[", "parentheses are ( and )"),
    ("]", "parentheses are ( and )"),
    ("{i}", "a name with {i} stands in double quotes: \"level.{i}.y\""),
    ("{", "parentheses are ( and )"),
    ("}", "parentheses are ( and )"),
    (";", "an expression ends without ;"),
    ("#", "a literal has its base or type before #: 16#8200, T#2s"),
    (":", "an input of a function is given by :="),
];

/// Takes a text apart.
pub(super) struct Tokens<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { text, at: 0 }
    }

    /// Whether this stands behind the last token that was taken.
    pub(super) fn is_before(&self, signs: &str) -> bool {
        self.behind_comments().is_ok_and(|rest| rest.starts_with(signs))
    }

    /// The text from the next token on.
    fn behind_comments(&self) -> Result<&'a str, Mistake> {
        let mut rest = self.rest().trim_start();
        loop {
            let behind = match rest.get(..2) {
                Some("(*") => behind_comment(rest, ["(*", "*)"]),
                Some("/*") => behind_comment(rest, ["/*", "*/"]),
                Some("//") => Some(rest.find('\n').map_or("", |end| rest.split_at(end).1)),
                _ => return Ok(rest),
            };
            let start = self.text.len() - rest.len();
            let unclosed = || {
                let end = if rest.starts_with('(') { "*)" } else { "*/" };
                Mistake::new(start..start + 2, format!("the comment that begins here has no {end}"))
                    .help(format!(
                        "comments may stand in each other, and each ends with its own {end}"
                    ))
            };
            rest = behind.ok_or_else(unclosed)?.trim_start();
        }
    }

    fn rest(&self) -> &'a str {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// The next token; `End` again and again behind the last one.
    pub(super) fn take(&mut self) -> Result<Token<'a>, Mistake> {
        let rest = self.behind_comments()?;
        let start = self.text.len() - rest.len();
        let Some(first) = rest.chars().next() else {
            return Ok(Token { kind: Kind::End, span: start..start });
        };
        let (kind, len) = match first {
            '"' => self.quoted(rest, start)?,
            '(' => (Kind::Open, 1),
            ')' => (Kind::Close, 1),
            ',' => (Kind::Comma, 1),
            _ if rest.starts_with(":=") => (Kind::Gives, 2),
            _ => match literal(rest) {
                Some((found, len)) => match found {
                    Ok(found) => (Kind::Literal(found), len),
                    Err(mistake) => return Err(self.no_literal(start..start + len, mistake)),
                },
                None if first.is_ascii_alphabetic() || first == '_' => word(rest),
                None => self.signs(rest, first, start)?,
            },
        };
        self.at = start + len;
        Ok(Token { kind, span: start..self.at })
    }

    fn quoted(&self, rest: &'a str, start: usize) -> Result<(Kind<'a>, usize), Mistake> {
        let name = rest.get(1..).and_then(|rest| rest.split_once('"')).map(|(name, _)| name);
        match name {
            None => Err(Mistake::new(
                start..self.text.len(),
                "the double quote that begins this name has no other one",
            )),
            Some("") => Err(Mistake::new(start..start + 2, "there is no name between the quotes")),
            Some(name) => Ok((Kind::Quoted(name), name.len() + 2)),
        }
    }

    fn signs(
        &self,
        rest: &'a str,
        first: char,
        start: usize,
    ) -> Result<(Kind<'a>, usize), Mistake> {
        if let Some((signs, help)) = FOREIGN.into_iter().find(|it| rest.starts_with(it.0)) {
            let span = start..start + signs.len();
            return Err(Mistake::new(span, format!("{signs} is not of this language")).help(help));
        }
        if let Some((operator, len)) = Operator::of_signs(rest) {
            return Ok((Kind::Operator(operator), len));
        }
        let span = start..start + first.len_utf8();
        Err(match self.with_neighbours(&span) {
            Some(name) => quote(span, first, name),
            None => Mistake::new(span, format!("{first} is not of this language")),
        })
    }

    /// A mistake in a literal, which is the rest of a name in `pump-1.y`.
    fn no_literal(
        &self,
        span: Range<usize>,
        mistake: (alloc::string::String, Option<alloc::string::String>),
    ) -> Mistake {
        let sign = self.text.get(..span.start).and_then(|before| before.chars().next_back());
        if let Some(sign @ ('-' | '/')) = sign
            && let Some(name) = self.with_neighbours(&(span.start - 1..span.start))
        {
            return quote(span.start - 1..span.end, sign, name);
        }
        Mistake { span, message: mistake.0, help: mistake.1 }
    }

    /// The whole text without spaces around a place that is part of it and has a name right before it.
    fn with_neighbours(&self, span: &Range<usize>) -> Option<&'a str> {
        let ends = |c: char| !c.is_alphanumeric() && !matches!(c, '_' | '.' | '-' | '@' | '/');
        let before = self.text.get(..span.start)?;
        let start = before.char_indices().rev().find(|it| ends(it.1));
        let start = start.map_or(0, |(at, c)| at + c.len_utf8());
        let behind = self.text.get(span.end..)?;
        let end = span.end + behind.find(ends).unwrap_or(behind.len());
        let name = self.text.get(start..end)?;
        let is_name = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
        (is_name && !name.ends_with(['-', '@', '/'])).then_some(name)
    }
}

/// What stands behind the comment that a text begins with, and behind those within it.
fn behind_comment<'a>(text: &'a str, [open, close]: [&str; 2]) -> Option<&'a str> {
    let (mut rest, mut depth) = (text, 0_usize);
    loop {
        if let Some(within) = rest.strip_prefix(open) {
            (rest, depth) = (within, depth + 1);
        } else if let Some(behind) = rest.strip_prefix(close) {
            (rest, depth) = (behind, depth - 1);
            if depth == 0 {
                return Some(rest);
            }
        } else {
            let mut characters = rest.chars();
            characters.next()?;
            rest = characters.as_str();
        }
    }
}

fn quote(span: Range<usize>, sign: char, name: &str) -> Mistake {
    Mistake::new(span, format!("a name with {sign} stands in double quotes"))
        .help(format!("write \"{name}\""))
}

/// The name or keyword that a text begins with.
fn word(text: &str) -> (Kind<'_>, usize) {
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    let len = text.find(|c| !is_of_word(c)).unwrap_or(text.len());
    let word = text.get(..len).unwrap_or_default();
    let kind = if word.eq_ignore_ascii_case("NOT") {
        Kind::Not
    } else if let Some(operator) = Operator::of_word(word) {
        Kind::Operator(operator)
    } else if let Some(literal) = Literal::of_word(word) {
        Kind::Literal(literal)
    } else {
        Kind::Word(word)
    };
    (kind, len)
}
