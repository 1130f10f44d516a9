//! Live values on a terminal: one table, drawn again in its place.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use isochrone_report::Table;

use super::channel::{Channel, NO_VALUE};
use super::heading::Heading;
use crate::failure::Failure;
use crate::numbers::{Digits, shown, type_of};
use crate::terminal;
use crate::top::cut;

/// As often as eyes can follow digits.
const INTERVAL: Duration = Duration::from_millis(100);
/// Room for a value, so that the columns stay where they are while it changes.
const VALUE_WIDTH: usize = 14;
/// The mark of a cut text.
const CUT: &str = "…";

/// A table on the terminal that stdout is.
#[derive(Default)]
pub(crate) struct Screen {
    /// Lines that the cursor stands below.
    drawn: usize,
    last: Option<Instant>,
}

/// A signal and its value.
struct Line<'a> {
    channel: &'a Channel,
    value: String,
}

impl Screen {
    /// Whether it is time to draw again.
    pub(super) fn is_due(&self) -> bool {
        self.last.is_none_or(|last| last.elapsed() >= INTERVAL)
    }

    /// Draws the values of a frame.
    pub(super) fn draw(
        &mut self,
        heading: &Heading<'_>,
        channels: &[Channel],
    ) -> Result<(), Failure> {
        self.last = Some(Instant::now());
        let line = |channel| Line { channel, value: value(channel, &heading.frame.values) };
        let lines: Vec<Line<'_>> = channels.iter().map(line).collect();
        let size = terminal::size();
        let table = table(&heading.line(size.0), &lines, size);
        let mut text = String::new();
        if self.drawn > 0 {
            text += &format!("\u{1b}[{}A", self.drawn);
        }
        for line in table.lines() {
            // To the end of the line: what was longer goes.
            text += &format!("{line}\u{1b}[K\n");
        }
        self.drawn = table.lines().count();
        text += "\u{1b}[J";
        let mut out = io::stdout().lock();
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        written.map_err(|error| Failure::found(format!("cannot write to the terminal: {error}")))
    }

    /// Leaves what is drawn where it stands; the next table comes below it, and below what others
    /// have to say meanwhile.
    pub(super) fn leave(&mut self) {
        self.drawn = 0;
    }
}

fn value(channel: &Channel, values: &[f64]) -> String {
    let value = values.get(channel.place);
    value.map_or_else(
        || NO_VALUE.to_owned(),
        |value| shown(*value, type_of(&channel.value_type), Digits::Six),
    )
}

/// The table, cut to what fits.
fn table(title: &str, lines: &[Line<'_>], (columns, rows): (usize, usize)) -> String {
    // One line is the cursor's.
    let room = rows.saturating_sub(1).max(1);
    // The title and the names of the columns make way for the values: one of them, and one more or
    // the line that says how many are missing.
    let heads = [2, 1, 0].into_iter().find(|heads| heads + lines.len().min(2) <= room).unwrap_or(0);
    let for_lines = room - heads;
    let shown =
        if lines.len() <= for_lines { lines.len() } else { for_lines.saturating_sub(1).max(1) };
    let (shown, hidden) = lines.split_at(shown);
    let widest = |cell: fn(&Line<'_>) -> usize, least: usize| {
        shown.iter().map(cell).max().unwrap_or(0).max(least)
    };
    let types = widest(|line| line.channel.value_type.chars().count(), "type".len());
    let values = widest(|line| line.value.chars().count(), VALUE_WIDTH);
    let units = widest(|line| line.channel.unit.chars().count(), 0);
    let beside = 2 + types + 2 + values + if units > 0 { 2 + units } else { 0 };
    // Type and unit make way for name and value, and room for a longer value for the name.
    let is_narrow = "signal".len() + beside > columns;
    let values =
        if is_narrow { widest(|line| line.value.chars().count(), "value".len()) } else { values };
    let beside = if is_narrow { 2 + values } else { beside };
    let names = columns.saturating_sub(beside).max(1);
    let unit = if units > 0 { "unit" } else { "" };
    let mut table = Table::default();
    let mut row = |name: &str, value_type: &str, value: &str, unit: &str| {
        let (name, value) = (cut(name, names), format!("{value:>values$}"));
        if is_narrow {
            table.row([&*name, &value]);
        } else {
            table.row([&name, value_type, &value, unit]);
        }
    };
    if heads > 1 {
        row("signal", "type", "value", unit);
    }
    for line in shown {
        let Channel { name, value_type, unit, .. } = line.channel;
        row(name, value_type, &line.value, unit);
    }
    let mut text = if heads > 0 { cut(title, columns).into_owned() + "\n" } else { String::new() };
    text.extend(table.draw(0).lines().map(|line| cut(line, columns).into_owned() + "\n"));
    if !hidden.is_empty() && for_lines > 1 {
        let more = format!("{CUT} and {} more; --signals chooses", hidden.len());
        text += &(cut(&more, columns) + "\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(count: usize, name: &str, title: &str, size: (usize, usize)) -> String {
        let channel = |place| Channel {
            place,
            name: format!("{name}{place}"),
            value_type: "LREAL".into(),
            unit: "m".into(),
        };
        let channels: Vec<Channel> = (0..count).map(channel).collect();
        let values = vec![-1.23456789e-12; count];
        let line = |channel| Line { channel, value: value(channel, &values) };
        table(title, &channels.iter().map(line).collect::<Vec<_>>(), size)
    }

    #[test]
    fn a_table_is_never_wider_or_higher_than_its_terminal() {
        let long = "a.name.that.is.longer.than.any.terminal.".repeat(4);
        for (columns, rows) in [(80, 24), (40, 5), (120, 60)] {
            let text = drawn(1000, &long, &long, (columns, rows));
            assert!(text.lines().all(|line| line.chars().count() <= columns), "{text}");
            assert!(text.lines().count() < rows, "{text}");
            assert!(text.contains(CUT) && text.contains("--signals"), "{text}");
            assert!(text.contains("-1.23457e-12"), "the values are what it is for\n{text}");
        }
    }

    #[test]
    fn on_a_small_terminal_the_values_stay() {
        let long = "a.name.that.is.longer.than.any.terminal.".repeat(4);
        for (columns, rows) in [(20, 3), (20, 2), (30, 4)] {
            let text = drawn(1000, &long, &long, (columns, rows));
            assert!(text.lines().all(|line| line.chars().count() <= columns), "{text}");
            assert!(text.lines().count() < rows, "{text}");
            assert!(text.contains("-1.23457e-12"), "{text}");
            assert!(!text.contains("LREAL"), "{text}");
        }
        assert_eq!(
            drawn(1, "level", "plant/level", (20, 3)),
            "plant/level\nlevel0  -1.23457e-12\n"
        );
    }

    #[test]
    fn a_table_that_fits_is_whole() {
        let text = drawn(2, "level", "plant/level", (80, 24));
        let expected = "plant/level\n\
            signal  type            value  unit\n\
            level0  LREAL    -1.23457e-12  m\n\
            level1  LREAL    -1.23457e-12  m\n";
        assert_eq!(text, expected);
    }
}
