//! Benches: arms that take turns in short turns, what disturbed each turn, and whether one arm is
//! better than another.

mod arm;
mod compare;
mod gate;
mod measured;
mod order;
mod reported;
mod turns;

pub use arm::{LoopArm, Outlier};
pub use compare::{RESOLUTION_NS, Ratio, TOLERANCE, TurnSamples, Verdict, ratio, supports};
pub use gate::{Compared, Gate, Outcome, Rule, RuleError, compare_reports, overall};
pub use measured::{Comparison, Measured, PERCENTILES, Percentile};
pub use order::turn_order;
pub(crate) use reported::Reported;
pub use turns::{TurnReport, Turns};
