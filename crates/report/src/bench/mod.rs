//! Benches: arms that take turns in short blocks, what disturbed each block, and whether one arm is
//! better than another.

mod arm;
mod blocks;
mod compare;
mod gate;
mod measured;
mod reported;
mod turns;

pub use arm::{LoopArm, Outlier};
pub use blocks::{BlockReport, Blocks};
pub use compare::{Block, RESOLUTION_NS, Ratio, TOLERANCE, Verdict, ratio, supports};
pub use gate::{Compared, Gate, Outcome, Rule, RuleError, compare_reports, overall};
pub use measured::{Comparison, Measured, PERCENTILES, Percentile};
pub(crate) use reported::Reported;
pub use turns::turns;
