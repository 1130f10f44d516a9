//! How points are drawn.

use super::mark::Mark;

/// How the points of a layer are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// Joined, with a line this wide.
    Line(u32),
    /// Two by two, each pair with a level line this wide: what lies between the pairs stays empty.
    Bars(u32),
    /// Each as a mark.
    Marks(Mark),
    /// As a rectangle between the first and the second.
    Shade,
}
