//! Pictures, as SVG: distributions, what happened over time, and what instances cost.

mod chart;
mod distributions;
mod ink;
mod legend;
mod mark;
mod scaling;
mod timeline;

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

pub use distributions::{Series, histogram_svg, percentiles_svg};
pub use scaling::scaling_svg;
pub use timeline::{Timeline, timeline_svg};

use crate::units::period;

/// Times below this are drawn as this: a logarithmic axis has no zero.
const LOWEST_NS: f64 = 10.0;

/// A logarithmic axis of times, up to a little more than the longest.
fn times(highest_ns: f64) -> impl AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>> {
    (LOWEST_NS..highest_ns * 1.5).log_scale()
}

fn as_time(ns: &f64) -> String {
    period(*ns as u64)
}
