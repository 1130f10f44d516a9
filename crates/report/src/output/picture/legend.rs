//! The legend: beside or below the plot, so that it never covers a sample.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::canvas::{Canvas, Failure};
use super::form::Form;
use super::ink::Ink;
use super::screen::{Screen, TEXT_SIZE};

const ROW: i32 = 20;
const TOP: i32 = 44;
const LEFT: i32 = 4;
/// What stays free to the left of a legend below a plot.
const MARGIN: i32 = 12;
const SYMBOL: i32 = 22;
const GAP: i32 = 8;
const LETTERS: usize = 30;
/// Width of a letter, in pixels: without the font one can only guess, so rather too wide.
const LETTER: i32 = 7;

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

impl Entry {
    fn width(&self) -> i32 {
        LEFT + SYMBOL + 2 * GAP + self.says.chars().count() as i32 * LETTER
    }
}

/// The width that a legend needs beside a plot.
pub(super) fn width(entries: &[Entry]) -> u32 {
    entries.iter().map(Entry::width).max().unwrap_or(0) as u32
}

/// The height that a legend needs.
pub(super) fn height(entries: &[Entry], screen: Screen) -> u32 {
    places(entries, screen).last().map_or(0, |(_, y)| (y + ROW) as u32)
}

/// Where each entry begins: one below the other, or, below a plot, as many in a row as it takes.
fn places(entries: &[Entry], screen: Screen) -> Vec<(i32, i32)> {
    let (mut x, mut y) = match screen {
        Screen::Wide => (LEFT, TOP - ROW),
        Screen::Narrow => (MARGIN, ROW / 2),
    };
    let end = screen.width() as i32;
    let place = |(index, entry): (usize, &Entry)| {
        if screen == Screen::Wide || (index > 0 && x + entry.width() > end) {
            x = if screen == Screen::Wide { LEFT } else { MARGIN };
            y += ROW;
        }
        let place = (x, y);
        x += entry.width();
        place
    };
    entries.iter().enumerate().map(place).collect()
}

/// Draws the legend.
pub(super) fn draw(area: &Canvas<'_>, entries: &[Entry], screen: Screen) -> Result<(), Failure> {
    let text =
        ("sans-serif", TEXT_SIZE).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    for (Entry { form, ink, says }, (x, y)) in entries.iter().zip(places(entries, screen)) {
        let line = [(x, y), (x + SYMBOL, y)];
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
                mark.draw(area, (x + SYMBOL / 2, y), *ink)?;
            }
            (Form::Shade, _) => {
                let corners = [(x, y - ROW / 3), (x + SYMBOL, y + ROW / 3)];
                area.draw(&Rectangle::new(corners, ink.colour.filled()))?;
            }
        }
        area.draw(&Text::new(says.as_str(), (x + SYMBOL + GAP, y), text.clone()))?;
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
    fn no_legend_needs_no_room() {
        assert_eq!(width(&[]), 0);
        assert_eq!(height(&[], Screen::Narrow), 0);
    }

    #[test]
    fn a_legend_below_a_plot_begins_a_row_where_an_entry_does_not_fit() {
        let names = ["sleep", "sleep, corrected", "udp", &"n".repeat(40)];
        let entries = names.map(|name| Entry::new(Form::Shade, Ink::of(0), name));
        let places = places(&entries, Screen::Narrow);
        for ((x, _), entry) in places.iter().zip(&entries) {
            assert!(x + entry.width() <= Screen::Narrow.width() as i32, "{x} {}", entry.says);
        }
        let rows: Vec<i32> = places.iter().map(|(_, y)| *y).collect();
        assert_eq!(rows, [10, 10, 10, 30]);
        assert_eq!(height(&entries, Screen::Narrow), 50);
    }
}
