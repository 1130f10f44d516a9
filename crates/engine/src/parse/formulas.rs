//! Expressions: those in `[block.out]` of an `Expr`, and how any is read.

use isochrone_blocks::{EXPR, expr, formulas::STATUS};
use toml::Spanned;
use toml::de::DeValue;

use super::places::places;
use super::section::Section;
use super::suggestions::article;
use crate::Diagnostic;
use crate::config::{Formula, Text};
use crate::diagnostic::Problem;
use crate::keys::{self, block};

/// What `out` may look like.
const EXAMPLE: &str = "out = { error = \"sp - pv\" }";

/// The outputs of a block, which has some only if `is_expr`; `file` is the text of the whole file.
pub(super) fn formulas(section: &Section<'_>, is_expr: bool, file: &str) -> Vec<Formula> {
    let Some(out) = section.table(&block::OUT, &keys::out::TABLE) else {
        if is_expr && section.get(&block::OUT).is_none() {
            section.report(no_expressions(section.span()));
        }
        return Vec::new();
    };
    if !is_expr {
        let message = format!("[[block]] has out, which is for type = \"{}\" only", EXPR.name);
        let help =
            format!("wire an {} to its input pins, or give it a block of its own", EXPR.name);
        section.report(Diagnostic::new(Problem::Conflict, out.span(), message).help(help));
        return Vec::new();
    }
    if let Some(pins) = section.get(&block::IN) {
        let message = "an Expr has no input pins";
        let help = "it reads the signals that its expressions name; leave [block.in] out";
        section.report(Diagnostic::new(Problem::Conflict, pins.span(), message).help(help));
    }
    let mut formulas: Vec<_> =
        out.entries().map(|(name, value)| formula(&out, name, value, file)).collect();
    if formulas.is_empty() {
        section.report(no_expressions(out.span()));
    }
    // The table has its keys in the order of the alphabet, the file in that of its outputs.
    formulas.sort_by_key(|formula| formula.name.span().start);
    formulas
}

fn no_expressions(span: std::ops::Range<usize>) -> Diagnostic {
    let diagnostic = Diagnostic::new(Problem::MissingKey, span, "an Expr has no expressions");
    diagnostic.help(format!("write {EXAMPLE}"))
}

fn formula(
    out: &Section<'_>,
    name: Spanned<String>,
    value: &Spanned<DeValue<'_>>,
    file: &str,
) -> Formula {
    if let Some((message, help)) = misnamed(name.get_ref()) {
        out.report(Diagnostic::new(Problem::BadName, name.span(), message).help(help));
    }
    let Some(text) = value.get_ref().as_str() else {
        let name_of = name.get_ref();
        let message = format!(
            "[block.out] {name_of} is an expression as text, not {}",
            article(value.get_ref())
        );
        let written = file.get(value.span()).unwrap_or_default();
        let diagnostic = Diagnostic::new(Problem::WrongType, value.span(), message);
        out.report(diagnostic.help(format!("write {name_of} = \"{written}\"")));
        return Formula { name, text: None, expression: None, names: Vec::new() };
    };
    read(out, "[block.out]", name, Spanned::new(value.span(), text.to_owned()), file)
}

/// Reads an expression in a section, which messages call `shown`, behind the key `name`.
pub(super) fn read(
    section: &Section<'_>,
    shown: &'static str,
    name: Spanned<String>,
    text: Spanned<String>,
    file: &str,
) -> Formula {
    let text = Text { places: places(file, &text), section: shown, text };
    let (mut expression, mut names) = (None, Vec::new());
    match expr::parse(text.as_str()) {
        Ok(parsed) => {
            let place = |it: &expr::Name| Spanned::new(text.place(&it.span), it.name.clone());
            names = parsed.names().iter().map(place).collect();
            expression = Some(parsed);
        }
        Err(mistake) => section.report(text.diagnostic(name.get_ref(), mistake)),
    }
    Formula { name, text: Some(text), expression, names }
}

/// Why an output cannot have a name.
fn misnamed(name: &str) -> Option<(String, &'static str)> {
    let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if name == STATUS.name {
        return Some((
            "every Expr has an output \"status\" of its own".to_owned(),
            "give this one another name; status says whether an expression has an error",
        ));
    }
    (!is_name || name.len() > keys::MOST_ENTRY_NAME).then(|| {
        let message = format!("\"{name}\" cannot be the name of an output");
        (message, "a letter or _, then letters, digits and _, at most 200 in all")
    })
}
