//! How things stand out: by style alone, or with colour as well.

use ratatui::style::{Color, Modifier, Style};

/// Which styles the terminal is given. Letters and words say the same, so that nothing is lost without
/// colour; foreground and background are always the terminal's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Palette {
    /// Bold, underlined and reversed text alone.
    Plain,
    /// Two of the sixteen colours as well, which are legible on light and on dark.
    Colour,
}

impl Palette {
    /// A set `NO_COLOR` asks for none, as everywhere.
    pub(crate) fn of_environment() -> Self {
        match std::env::var_os("NO_COLOR") {
            Some(value) if !value.is_empty() => Self::Plain,
            _ => Self::Colour,
        }
    }

    pub(crate) fn heading(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    pub(crate) fn selected(self) -> Style {
        Style::new().add_modifier(Modifier::REVERSED)
    }

    /// Forced values.
    pub(crate) fn forced(self) -> Style {
        self.with(Color::Magenta, Modifier::BOLD)
    }

    /// Faults.
    pub(crate) fn bad(self) -> Style {
        self.with(Color::Red, Modifier::BOLD | Modifier::UNDERLINED)
    }

    fn with(self, colour: Color, modifier: Modifier) -> Style {
        let style = Style::new().add_modifier(modifier);
        match self {
            Self::Plain => style,
            Self::Colour => style.fg(colour),
        }
    }
}
