//! Texts as the screen has them.

use std::borrow::Cow;

use isochrone_engine::escaped;
use isochrone_runtime::control::Value;

use crate::numbers::type_of;
use crate::operate::shown;

/// What is not known.
pub(super) const NONE: &str = "-";

/// A text of another process, with nothing in it that commands the terminal.
pub(super) fn plain(text: &str) -> Cow<'_, str> {
    escaped(text)
}

/// A value of a type by name, as `show` writes it, in at most so many characters.
pub(super) fn value(value: Value, value_type: &str, most: u16) -> String {
    cut(&shown(value, type_of(value_type)), most.into()).into_owned()
}

/// A text of at most so many characters.
pub(super) fn cut(text: &str, most: usize) -> Cow<'_, str> {
    if text.chars().count() <= most {
        return text.into();
    }
    (text.chars().take(most.saturating_sub(1)).collect::<String>() + "…").into()
}
