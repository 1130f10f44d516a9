//! What a message takes on the screen.

use isochrone_engine::escaped_lines;

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

/// A text in lines of at most so many characters, divided between words where that is possible.
pub(super) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let width = width.max(1);
    let mut lines = Vec::new();
    for paragraph in text.lines() {
        let mut line = String::new();
        for word in paragraph.split(' ') {
            let mut word: Vec<char> = word.chars().collect();
            let used = line.chars().count();
            if !line.is_empty() && used + 1 + word.len() > width {
                lines.push(std::mem::take(&mut line));
            } else if used > 0 {
                line.push(' ');
            }
            while word.len() > width {
                lines.push(word.drain(..width).collect());
            }
            line.extend(word);
        }
        lines.push(line);
    }
    lines
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
