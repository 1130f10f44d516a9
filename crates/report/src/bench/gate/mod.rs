//! A gate: bounds that the result of a bench must keep.

mod judge;
mod rules;

pub use judge::{Judgement, RuleOutcome};
pub use rules::{Bound, Gate, Rule, RuleError};
