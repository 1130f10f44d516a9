//! **Documents**: the results of a run or a bench, for people and for other tools.
//!
//! A [`Report`] is written as JSON (serde, both ways), as a table (`Display`), as a page ([`html`])
//! and in the formats of other tools ([`hgrm`], [`hlog`], [`cyclictest_histogram`]). Arms of a
//! bench are compared with each other ([`Report::compare_arms`]), reports with each other
//! ([`compare_reports`]), and both can be checked against bounds ([`Gate`]).
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod bench;
mod output;
mod report;

pub use bench::{
    Bound, Compared, Comparison, Gate, Judgement, LeftOut, LoopArm, Measurement, NotCompared,
    PERCENTILES, Pairing, Percentile, Ratio, Rule, RuleError, RuleOutcome, TOLERANCE, TooShort,
    TurnSamples, Turns, Verdict, compare_reports, needed, overall, ratio, ratio_in_words, supports,
    turn_order,
};
pub use output::{
    Alignment, ChartSignal, ComparisonTable, Page, Row, Series, SignalChart, Table, TableColumn,
    Timeline, cyclictest_histogram, hgrm, histogram_svg, hlog, html, percentiles_svg, pictures,
    scaling_svg, shot_svg, signals_html, signals_svg, timeline_svg,
};
pub use report::{
    CostReport, LinkArm, Outlier, ProgramVersion, RecordingReport, Report, TaskArm, TurnReport,
};
