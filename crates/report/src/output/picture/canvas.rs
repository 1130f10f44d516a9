//! The canvas of pictures.

use plotters::coord::Shift;
use plotters::prelude::*;

/// A part of a picture, which becomes SVG.
pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Why something could not be drawn.
pub(super) type Failure = DrawingAreaErrorKind<std::io::Error>;

/// The SVG of what `draw` draws on a picture of this size. A character that XML cannot have, in whatever
/// somebody has named, is replaced by U+FFFD.
pub(super) fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), Failure>,
) -> String {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    let drawn = draw(&area);
    drop(area);
    debug_assert!(drawn.is_ok(), "a string takes everything: {drawn:?}");
    if text.contains(is_no_xml) { text.replace(is_no_xml, "\u{fffd}") } else { text }
}

/// Whether XML 1.0 has no such character, however it is written.
fn is_no_xml(c: char) -> bool {
    matches!(c, '\0'..='\u{8}' | '\u{b}' | '\u{c}' | '\u{e}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}')
}
