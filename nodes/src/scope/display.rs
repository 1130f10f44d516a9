//! The display of shots: as a chart on stdout, on the whole terminal, or in files.

use std::io::{self, IsTerminal, Write};

use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span, Text};

use super::args::Mode;
use super::captured::Captured;
use super::chart::{self, Grid, Ink, Surplus};
use super::output::Output;
use super::text::note_short;
use crate::base::failure::Failure;
use crate::base::terminal;
use crate::top::{Palette, Screen};

/// Where shots are shown.
pub(super) enum Display {
    Files(Output),
    /// One below the other.
    Printed,
    /// In the place of the one before.
    Live(Box<Screen>),
}

/// A line is the shell's, for its prompt.
const PROMPT: usize = 1;

impl Display {
    pub(super) fn new(output: Option<Output>, screen: Option<Screen>) -> Self {
        match (output, screen) {
            (Some(output), _) => Self::Files(output),
            (None, Some(screen)) => Self::Live(Box::new(screen)),
            (None, None) => Self::Printed,
        }
    }

    /// Whether shots are drawn one over the other.
    pub(super) fn is_live(mode: Mode, output: Option<&Output>) -> bool {
        mode != Mode::Single && output.is_none() && Screen::is_possible()
    }

    /// Shows a shot for good: as a file, or as a chart below what was shown before.
    pub(super) fn show(&mut self, captured: &Captured) -> Result<(), Failure> {
        match self {
            Self::Files(output) => {
                let path = output.write(captured)?;
                note_short(captured);
                terminal::note(&format!("{path}: {}", captured.contents()));
                Ok(())
            }
            Self::Printed => {
                let (columns, rows) = terminal::size();
                let heading = captured.heading();
                let size = (columns, rows.saturating_sub(PROMPT));
                let grid = chart::draw(&captured.shot, &heading, size, Surplus::Drawn);
                print(&grid)?;
                note_short(captured);
                Ok(())
            }
            Self::Live(_) => Ok(()),
        }
    }

    /// Draws a shot, if there is one, and a line that says what is waited for over the whole terminal.
    pub(super) fn draw(
        &mut self,
        captured: Option<&Captured>,
        status: &str,
    ) -> Result<(), Failure> {
        let Self::Live(screen) = self else { return Ok(()) };
        let palette = Palette::of_environment();
        let drawn = screen.terminal.draw(|frame| {
            let area = frame.area();
            let (columns, rows) = (area.width.into(), usize::from(area.height));
            let size = (columns, rows.saturating_sub(1));
            let draw = |it: &Captured| chart::draw(&it.shot, &it.heading(), size, Surplus::LeftOut);
            let grid = captured.map(draw);
            let line = |pieces: Vec<(Ink, String)>| {
                let spans = pieces.into_iter();
                Line::from_iter(spans.map(|(ink, text)| Span::styled(text, style(ink, palette))))
            };
            let pieces = grid.iter().flat_map(Grid::lines);
            let mut lines: Vec<Line<'_>> = pieces.map(line).collect();
            // A screen that is lower than any chart is cut below; the line of the keys is not.
            lines.truncate(rows.saturating_sub(1));
            lines.resize(rows.saturating_sub(1), Line::default());
            lines.push(Line::styled(status.to_owned(), palette.selected()));
            frame.render_widget(Text::from(lines), area);
        });
        drawn.map(drop).map_err(|error| Failure::found(format!("cannot use the terminal: {error}")))
    }

    /// Draws everything again, over whatever another program wrote.
    pub(super) fn clear(&mut self) {
        if let Self::Live(screen) = self {
            // The next drawing tells if the terminal is gone.
            let _ = screen.terminal.clear();
        }
    }
}

/// Colours that are legible on light and on dark.
const COLOURS: [Color; 4] = [Color::Cyan, Color::Green, Color::Magenta, Color::Blue];

fn style(ink: Ink, palette: Palette) -> Style {
    let has_colour = palette == Palette::Colour;
    match ink {
        Ink::Text | Ink::Axis => Style::new(),
        Ink::Gap if has_colour => Style::new().add_modifier(Modifier::DIM),
        Ink::Gap => Style::new(),
        Ink::Heading => palette.heading(),
        Ink::Odd => palette.bad(),
        Ink::Trigger if has_colour => Style::new().fg(Color::Red),
        Ink::Band(index) if has_colour => {
            Style::new().fg(COLOURS.get(index % COLOURS.len()).copied().unwrap_or(Color::Reset))
        }
        Ink::Trigger | Ink::Band(_) => Style::new(),
    }
}

/// Writes a chart to stdout: with colour where that is a terminal and colour is welcome.
fn print(grid: &Grid) -> Result<(), Failure> {
    let palette = Palette::of_environment();
    if !io::stdout().is_terminal() || palette == Palette::Plain {
        return terminal::print(&grid.plain());
    }
    let mut text = String::new();
    for pieces in grid.lines() {
        for (ink, piece) in pieces {
            match sgr(style(ink, palette)) {
                Some(code) => text += &format!("\u{1b}[{code}m{piece}\u{1b}[0m"),
                None => text += &piece,
            }
        }
        text.push('\n');
    }
    // What other processes and files name is escaped in the chart already.
    let mut out = io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    written.map_err(|error| Failure::found(format!("cannot write to the terminal: {error}")))
}

/// The style as a terminal escape sequence.
fn sgr(style: Style) -> Option<String> {
    let colour = style.fg.and_then(|colour| {
        Some(match colour {
            Color::Red => "31",
            Color::Green => "32",
            Color::Blue => "34",
            Color::Magenta => "35",
            Color::Cyan => "36",
            _ => return None,
        })
    });
    let modifiers = [(Modifier::BOLD, "1"), (Modifier::DIM, "2"), (Modifier::UNDERLINED, "4")];
    let has = |(modifier, _): &(Modifier, _)| style.add_modifier.contains(*modifier);
    let modifiers = modifiers.into_iter().filter(has).map(|(_, code)| code);
    let codes: Vec<&str> = modifiers.chain(colour).collect();
    (!codes.is_empty()).then(|| codes.join(";"))
}
