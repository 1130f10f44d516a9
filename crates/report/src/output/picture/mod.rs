//! Pictures, as SVG: distributions, what happened over time, what instances cost, and signals.

mod axis;
mod canvas;
mod chart;
mod distributions;
mod form;
mod ink;
mod legend;
mod mark;
mod scaling;
mod screen;
mod shot;
mod signals;
mod timeline;
mod trace;

pub(super) use distributions::{Curve, histogram_of, percentiles_of};
pub use distributions::{Series, histogram_svg, percentiles_svg};
pub(super) use scaling::scaling_of;
pub use scaling::scaling_svg;
pub(super) use screen::Screen;
pub(super) use shot::FIRST_COLUMN;
pub use shot::shot_svg;
pub(super) use signals::{Axis, COLUMNS, Pane};
pub use signals::{ChartSignal, SignalChart, signals_svg};
pub(super) use timeline::timeline_of;
pub use timeline::{Timeline, timeline_svg};
