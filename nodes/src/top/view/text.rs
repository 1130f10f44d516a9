//! Texts as the screen has them.

use std::borrow::Cow;

use isochrone_control::Value;
use isochrone_engine::escaped;
use ratatui::text::{Line, Span};

use crate::numbers::{Digits, shown_value, type_of};

/// An unknown value.
pub(super) const NONE: &str = "-";

/// A text of another process, with nothing in it that commands the terminal.
pub(super) fn plain(text: &str) -> Cow<'_, str> {
    escaped(text)
}

/// A value of a type by name, as `show` writes it, in at most this many characters.
pub(super) fn value(value: Value, value_type: &str, most: u16) -> String {
    cut(&shown_value(value, type_of(value_type), Digits::Six), most.into()).into_owned()
}

/// A signal's name in at most this many characters: it is cut in the middle, as its end is the pin.
pub(crate) fn cut_name(name: &str, most: usize) -> Cow<'_, str> {
    let length = name.chars().count();
    let Some(kept) = most.checked_sub(1).filter(|_| length > most) else { return cut(name, most) };
    let pin = name.rsplit_once('.').map_or(0, |(_, pin)| pin.chars().count() + 1);
    // Something of the block is left of the longest pin.
    let end = pin.max(kept / 3).min(kept * 3 / 4);
    let begin = name.chars().take(kept - end);
    (begin.chain(['…']).chain(name.chars().skip(length - end)).collect::<String>()).into()
}

/// A line of at most so many characters, whose end says so where it was cut.
pub(super) fn cut_line(spans: Vec<Span<'static>>, most: usize) -> Line<'static> {
    let length: usize = spans.iter().map(|span| span.content.chars().count()).sum();
    if length <= most {
        return Line::from(spans);
    }
    let mut left = most;
    let spans = spans.into_iter().map_while(|span| {
        let length = span.content.chars().count();
        // The last one that has room ends with the sign, as something follows it.
        let is_last = length >= left;
        let content = if is_last && left > 0 {
            cut(&(span.content.into_owned() + " "), left).into_owned()
        } else {
            span.content.into_owned()
        };
        let has_room = left > 0;
        left = left.saturating_sub(length);
        has_room.then(|| Span::styled(content, span.style))
    });
    Line::from(spans.collect::<Vec<_>>())
}

/// A text of at most so many characters.
pub(crate) fn cut(text: &str, most: usize) -> Cow<'_, str> {
    if text.chars().count() <= most {
        return text.into();
    }
    (text.chars().take(most.saturating_sub(1)).collect::<String>() + "…").into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_keeps_its_pin_and_the_beginning_of_its_block() {
        let cut = |name: &str| cut_name(name, 28).into_owned();
        let block = "cooling_water_return_temperature_limiter";
        assert_eq!(cut(&format!("{block}.error")), "cooling_water_retu…ter.error");
        assert_eq!(cut(&format!("{block}.setChangeRate")), "cooling_water….setChangeRate");
        assert_eq!(cut("ramp.setChangeRate"), "ramp.setChangeRate");
        assert!((0..90).all(|most| cut_name(block, most).chars().count() <= most.max(1)));
    }

    #[test]
    fn a_line_that_is_cut_says_so_wherever_it_is_cut() {
        let spans = || vec![Span::raw("abc"), Span::raw("def")];
        assert_eq!(cut_line(spans(), 6).to_string(), "abcdef");
        for (most, shown) in [(5, "abcd…"), (4, "abc…"), (3, "ab…"), (1, "…"), (0, "")] {
            assert_eq!(cut_line(spans(), most).to_string(), shown, "{most}");
        }
    }
}
