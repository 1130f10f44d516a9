//! The plot area of a chart.

use isochrone_scope::{Shot, Span};

/// Where the curves are: the columns of the terminal from `left` on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plot {
    pub(super) left: usize,
    pub(super) width: usize,
}

impl Plot {
    /// The column of the terminal where an instant is.
    pub(super) fn column(self, shot: &Shot, at_ns: u64) -> usize {
        self.left + Span::of(shot, self.width).column(at_ns)
    }
}
