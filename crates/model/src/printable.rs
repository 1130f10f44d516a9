//! Text from outside as people are shown it. To a terminal, control characters are commands: a name
//! could clear the screen, or show another one.

use std::borrow::Cow;
use std::fmt::Write;

/// A text in one line: every control character is escaped as TOML and JSON write it, such as `\n`
/// and `\u001b`. So are the characters that change the direction of what follows.
///
/// What is escaped within a string of a JSON document leaves that document as it was.
pub fn escaped(text: &str) -> Cow<'_, str> {
    escaped_but(text, |_| false)
}

/// As [`escaped`], for a text of several lines: line ends and tabs stay.
pub fn escaped_lines(text: &str) -> Cow<'_, str> {
    escaped_but(text, |c| matches!(c, '\n' | '\t'))
}

fn escaped_but(text: &str, stays: impl Fn(char) -> bool) -> Cow<'_, str> {
    let is_escaped = |c: char| is_command(c) && !stays(c);
    if !text.chars().any(is_escaped) {
        return text.into();
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            c if !is_escaped(c) => escaped.push(c),
            '\n' => escaped.push_str("\\n"),
            '\r' => escaped.push_str("\\r"),
            '\t' => escaped.push_str("\\t"),
            // Writing to a string does not fail.
            c => drop(write!(escaped, "\\u{:04x}", u32::from(c))),
        }
    }
    escaped.into()
}

/// Whether a terminal does something else with it than to show it. All of them have at most 16 bits.
fn is_command(c: char) -> bool {
    let changes_direction = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let ends_a_line = matches!(c, '\u{2028}' | '\u{2029}');
    c.is_control() || changes_direction || ends_a_line || c == '\u{feff}'
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn control_characters_are_escaped_as_in_toml_and_json() {
        assert_eq!(
            escaped("a\u{1b}[2J\u{9b}b\r\n\t\0\u{7f}"),
            r"a\u001b[2J\u009bb\r\n\t\u0000\u007f"
        );
        assert_eq!(escaped_lines("a\tb\r\nc\u{1b}"), "a\tb\\r\nc\\u001b");
        assert_eq!(escaped("\u{202e}lru\u{2028}"), r"\u202elru\u2028");
    }

    #[test]
    fn what_can_be_shown_stays_as_it_is() {
        for text in ["", "plant/level", "Füllstand 3 µm … 水位 👩‍🔬", r"C:\new"] {
            assert!(matches!(escaped(text), Cow::Borrowed(same) if same == text));
        }
    }

    proptest! {
        #[test]
        fn nothing_is_left_that_a_terminal_takes_as_a_command(text in any::<String>()) {
            prop_assert!(!escaped(&text).chars().any(is_command));
            let lines = escaped_lines(&text);
            prop_assert!(!lines.chars().any(|c| is_command(c) && c != '\n' && c != '\t'));
        }
    }
}
