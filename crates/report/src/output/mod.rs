//! A report as files that people and other tools look at: text in, text out, and no I/O.

mod cyclictest;
mod groups;
mod hgrm;
mod hlog;
mod html;
mod picture;
mod table;

pub use cyclictest::cyclictest_histogram;
pub use hgrm::hgrm;
pub use hlog::hlog;
pub use html::{Page, Row, TableColumn, html, pictures, signals_html};
pub use picture::{
    ChartSignal, Series, SignalChart, Timeline, histogram_svg, percentiles_svg, scaling_svg,
    shot_svg, signals_svg, timeline_svg,
};
pub use table::{Alignment, ComparisonTable, Table};

/// A distribution with so many samples of each value, in ns.
#[cfg(test)]
fn of_samples(samples: &[(u64, u64)]) -> isochrone_timing::Distribution {
    let mut distribution = isochrone_timing::Distribution::new();
    samples.iter().for_each(|(ns, count)| distribution.record_many(*ns, *count));
    distribution
}
