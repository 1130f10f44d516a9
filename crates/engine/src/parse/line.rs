//! Units and comments: texts for people.

use isochrone_blocks::PinType;
use toml::Spanned;
use toml::de::DeValue;

use super::section::Section;
use crate::Diagnostic;
use crate::diagnostic::Problem;
use crate::keys::{self, Form, Key};
use isochrone_model::escaped;

impl Section<'_> {
    /// A text in one line.
    pub(crate) fn line(&self, key: &Key) -> Option<Spanned<String>> {
        let Form::Line(most) = key.form else { return None };
        self.read(key, |value| line(self.title(), key.name, value, most))
    }

    /// The unit of an input or a variable.
    pub(super) fn unit(&self, key: &Key, value_type: Option<PinType>) -> Option<String> {
        let unit = self.line(key)?;
        if let Some(value_type) = value_type.filter(|value_type| !has_unit(*value_type)) {
            let message = format!("{} {} is not for {value_type}", self.title(), key.name);
            self.report(Diagnostic::new(Problem::Conflict, unit.span(), message).help(NO_UNIT));
        }
        Some(unit.into_inner())
    }

    /// A comment.
    pub(crate) fn comment(&self, key: &Key) -> Option<String> {
        self.line(key).map(Spanned::into_inner)
    }

    /// The units of a block's pins.
    pub(super) fn units(&self) -> Vec<(Spanned<String>, String)> {
        let Form::Line(most) = keys::block::UNIT.form else { return Vec::new() };
        let Some(section) = self.table(&keys::block::UNITS, &keys::units::TABLE) else {
            return Vec::new();
        };
        let mut units = Vec::new();
        for (pin, value) in section.entries() {
            match line(section.title(), pin.get_ref(), value.get_ref(), most) {
                Ok(unit) => units.push((pin, unit)),
                Err(diagnostic) => {
                    let diagnostic = diagnostic.unwrap_or_else(|| {
                        let title = section.title();
                        let message = format!("{title} {} is a text, such as \"m\"", pin.get_ref());
                        Diagnostic::new(Problem::WrongType, 0..0, message)
                    });
                    section.report(Diagnostic { span: value.span(), ..diagnostic });
                }
            }
        }
        units
    }
}

/// Why some values have no unit.
pub(crate) const NO_UNIT: &str = "an LREAL or an INT has a unit; a TIME is written with its own, and a BOOL or a WORD \
                                  has none";

/// Whether values of a type may have a unit.
pub(crate) fn has_unit(value_type: PinType) -> bool {
    matches!(value_type, PinType::Lreal | PinType::Int)
}

/// A text that a screen, a file and the layout of a frame can have as it is.
fn line(
    table: &str,
    key: &str,
    value: &DeValue<'_>,
    most: usize,
) -> Result<String, Option<Diagnostic>> {
    let text = value.as_str().ok_or(None)?;
    let (why, help) = if text.trim().is_empty() {
        ("is empty".to_owned(), "leave it out, or write what it is".to_owned())
    } else if text.trim() != text {
        let help = "blanks cannot be seen, and units are compared byte for byte: take them out";
        ("begins or ends with a blank".to_owned(), help.to_owned())
    } else if escaped(text) != text {
        let help = "write one line, without line ends and other control characters".to_owned();
        (format!("\"{}\" has a control character", escaped(text)), help)
    } else if text.len() > most {
        (format!("has {} bytes", text.len()), format!("at most {most} are possible"))
    } else {
        return Ok(text.to_owned());
    };
    let message = format!("{table} {key} {why}");
    Err(Some(Diagnostic::new(Problem::OutOfRange, 0..0, message).help(help)))
}
