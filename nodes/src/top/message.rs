//! The space of a message on the screen.

use std::borrow::Cow;

use isochrone_engine::escaped_lines;
use textwrap::wrap;

use crate::wrapping::at_spaces;

/// Room for a text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Space {
    pub(super) columns: usize,
    pub(super) lines: usize,
}

/// The lines of a message, its title among them: an order can be longer than a title has room for.
pub(super) fn message_lines(title: &str, text: &str, space: Space) -> Vec<String> {
    let title = wrapped(&escaped_lines(title), space.columns);
    let text = wrapped(&escaped_lines(text), space.columns);
    [title, vec![String::new()], text].concat()
}

/// A text in lines of at most so many columns, divided between words where that is possible.
pub(super) fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let options = at_spaces(columns.max(1));
    text.lines().flat_map(|paragraph| wrap(paragraph, &options)).map(Cow::into_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_divided_between_words_and_loses_nothing() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("abcdefghij kl", 4), ["abcd", "efgh", "ij", "kl"]);
        assert_eq!(wrapped("a\n\nb", 9), ["a", "", "b"]);
        let text = "a value of 7.0 is outside the limits [0.0, 5.0] of ramp.setChangeRate";
        for width in 1..80 {
            let lines = wrapped(text, width);
            assert!(lines.iter().all(|line| line.chars().count() <= width), "{lines:?}");
            let without_blanks = |text: &str| text.replace(' ', "");
            assert_eq!(without_blanks(&lines.concat()), without_blanks(text));
        }
    }
}
