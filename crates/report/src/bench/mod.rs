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
pub use compare::{
    Pairing, Ratio, TOLERANCE, TooShort, TurnSamples, Verdict, needed, ratio, supports,
};
pub use gate::{
    Bound, Compared, Gate, Judgement, NotCompared, Outcome, Rule, RuleError, compare_reports,
    overall,
};
pub use measured::{Comparison, LeftOut, Measured, PERCENTILES, Percentile};
pub use order::turn_order;
pub(crate) use reported::Reported;
pub use turns::{TurnReport, Turns};
