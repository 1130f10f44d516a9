//! What pictures are drawn on.

use plotters::coord::Shift;
use plotters::prelude::*;

/// A part of a picture, which becomes SVG.
pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Why something could not be drawn.
pub(super) type Failure = DrawingAreaErrorKind<std::io::Error>;
