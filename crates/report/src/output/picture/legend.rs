//! The legend: beside the picture, so that it never covers a sample.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::canvas::{Canvas, Failure};
use super::form::Form;
use super::ink::Ink;

const ROW: i32 = 20;
const TOP: i32 = 44;
const LEFT: i32 = 4;
const SYMBOL: i32 = 22;
const GAP: i32 = 8;
const LETTERS: usize = 30;
/// Width of a letter, in pixels: without the font one can only guess, so rather too wide.
const LETTER: u32 = 7;

/// A line of the legend.
pub(super) struct Entry {
    pub(super) form: Form,
    pub(super) ink: Ink,
    pub(super) says: String,
}

impl Entry {
    pub(super) fn new(form: Form, ink: Ink, says: &str) -> Self {
        Self { form, ink, says: shortened(says, LETTERS) }
    }
}

/// The width that a legend needs.
pub(super) fn width(entries: &[Entry]) -> u32 {
    let letters = entries.iter().map(|entry| entry.says.chars().count()).max();
    letters.map_or(0, |letters| letters as u32 * LETTER + (LEFT + SYMBOL + 2 * GAP) as u32)
}

/// The height that a legend needs.
pub(super) fn height(entries: &[Entry]) -> u32 {
    (TOP + ROW * (entries.len() as i32 + 1)) as u32
}

/// Draws the legend from top to bottom.
pub(super) fn draw(area: &Canvas<'_>, entries: &[Entry]) -> Result<(), Failure> {
    let text = ("sans-serif", 14).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    for (row, Entry { form, ink, says }) in entries.iter().enumerate() {
        let y = TOP + ROW * row as i32;
        let line = [(LEFT, y), (LEFT + SYMBOL, y)];
        match (*form, ink.dash) {
            (Form::Line(stroke_width), None) => {
                let style = ShapeStyle { stroke_width, ..ink.colour.into() };
                area.draw(&PathElement::new(line, style))?;
            }
            (Form::Line(stroke_width), Some((dash, gap))) => {
                let style = ShapeStyle { stroke_width, ..ink.colour.into() };
                area.draw(&DashedPathElement::new(line, dash, gap, style))?;
            }
            (Form::Bars(stroke_width), _) => {
                let style = ShapeStyle { stroke_width, ..ink.colour.into() };
                area.draw(&PathElement::new(line, style))?;
            }
            (Form::Marks(mark), _) => {
                mark.draw(area, (LEFT + SYMBOL / 2, y), *ink)?;
            }
            (Form::Shade, _) => {
                let corners = [(LEFT, y - ROW / 3), (LEFT + SYMBOL, y + ROW / 3)];
                area.draw(&Rectangle::new(corners, ink.colour.filled()))?;
            }
        }
        area.draw(&Text::new(says.as_str(), (LEFT + SYMBOL + GAP, y), text.clone()))?;
    }
    Ok(())
}

/// A text of at most so many letters, without what an XML document may not contain.
pub(super) fn shortened(text: &str, letters: usize) -> String {
    let clean = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let all: Vec<char> = text.chars().map(clean).collect();
    match all.get(..letters.saturating_sub(1)) {
        Some(begin) if all.len() > letters => begin.iter().chain(['…'].iter()).collect(),
        _ => all.into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_name_ends_in_an_ellipsis_and_a_control_character_is_replaced() {
        assert_eq!(shortened("hybrid", 6), "hybrid");
        assert_eq!(shortened("hybrids", 6), "hybri…");
        assert_eq!(shortened("a\u{1}b\n", 9), "a\u{fffd}b\u{fffd}");
    }

    #[test]
    fn no_legend_needs_no_width() {
        assert_eq!(width(&[]), 0);
    }
}
