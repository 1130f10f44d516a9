//! Benches: arms that take turns in short turns, what disturbed each turn, and whether one arm is
//! better than another.

mod arm;
mod chance;
mod compare;
mod gate;
#[cfg(test)]
mod made_up;
mod measured;
mod one_report;
mod order;
mod reported;
mod samples;
mod turns;
mod two_reports;
mod wording;

pub use arm::LoopArm;
pub use compare::{Pairing, Ratio, TOLERANCE, TooShort, Verdict, needed, ratio, supports};
pub use gate::{Bound, Gate, Judgement, Rule, RuleError, RuleOutcome};
pub use measured::{Comparison, LeftOut, Measurement, PERCENTILES, Percentile};
pub use order::turn_order;
pub(crate) use reported::Reported;
pub use samples::TurnSamples;
pub use turns::Turns;
pub use two_reports::{Compared, NotCompared, compare_reports, overall};
pub use wording::ratio_in_words;
pub(crate) use wording::{interval_in_words, verdict_in_words};
