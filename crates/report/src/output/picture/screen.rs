//! The screen that a picture is drawn for: at its width the text must be legible.

/// Size of the text of axes and legends. Plotters writes it as 12.1 px: it takes a size for that of
/// the whole line.
pub(super) const TEXT_SIZE: u32 = 15;

/// Where a picture is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Screen {
    /// On a screen: the legend stands beside the plot.
    Wide,
    /// On a phone: the legend stands below the plot, and the axes have fewer labels.
    Narrow,
}

impl Screen {
    /// Width of the picture, in pixels.
    pub(in crate::output) const fn width(self) -> u32 {
        match self {
            Self::Wide => 960,
            Self::Narrow => 340,
        }
    }

    /// Height of the plot with its title and axes, in pixels.
    pub(super) const fn plot_height(self) -> u32 {
        match self {
            Self::Wide => 440,
            Self::Narrow => 270,
        }
    }

    /// Letters of a title that fit into the width.
    pub(super) const fn title_letters(self) -> usize {
        match self {
            Self::Wide => 96,
            Self::Narrow => 50,
        }
    }

    /// Size of the title, as [`TEXT_SIZE`] is one.
    pub(super) const fn title_size(self) -> u32 {
        match self {
            Self::Wide => 18,
            Self::Narrow => 16,
        }
    }

    /// Labels that fit below the plot.
    pub(super) const fn x_labels(self) -> usize {
        match self {
            Self::Wide => 11,
            Self::Narrow => 5,
        }
    }
}
