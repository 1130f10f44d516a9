//! Pictures, as SVG: distributions, what happened over time, and what instances cost.

mod axis;
mod canvas;
mod chart;
mod distributions;
mod form;
mod ink;
mod legend;
mod mark;
mod scaling;
mod timeline;

pub(super) use distributions::{Curve, histogram_of, percentiles_of};
pub use distributions::{Series, histogram_svg, percentiles_svg};
pub use scaling::scaling_svg;
pub use timeline::{Timeline, timeline_svg};
