//! The instant at which a condition becomes true.

use crate::Comparator;

/// The condition on a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Condition {
    /// This comparison with the level becomes true. A NaN is unequal to every level, and nothing else.
    Compare(Comparator, f64),
    /// The value was below the level and reaches it. A NaN in between changes nothing.
    Rising(f64),
    /// The value was above the level and reaches it. A NaN in between changes nothing.
    Falling(f64),
    /// The value becomes another number, NaN, or a number after NaN.
    Changed,
}

/// Looks at a signal cycle by cycle. What is so from the first cycle on has not become so.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    condition: Condition,
    before: Before,
}

/// The cycles so far.
#[derive(Debug, Clone, Copy)]
enum Before {
    Nothing,
    /// Whether the condition may become true with the next cycle: it was false, or the value is on the
    /// side from which it is to come.
    Ready(bool),
    Value(f64),
}

impl Edge {
    /// Nothing was seen yet.
    pub fn new(condition: Condition) -> Self {
        Self { condition, before: Before::Nothing }
    }

    /// Its condition.
    pub fn condition(&self) -> Condition {
        self.condition
    }

    /// The number on whose two sides the condition differs, if it has one.
    pub fn level(&self) -> Option<f64> {
        match self.condition {
            Condition::Compare(_, level) | Condition::Rising(level) | Condition::Falling(level) => {
                Some(level)
            }
            Condition::Changed => None,
        }
    }

    /// Whether the condition becomes true with this cycle's value.
    pub fn fires(&mut self, value: f64) -> bool {
        let was_ready = matches!(self.before, Before::Ready(true));
        match self.condition {
            Condition::Compare(comparison, level) => {
                let is_true = comparison.holds(value, level);
                self.before = Before::Ready(!is_true);
                was_ready && is_true
            }
            Condition::Rising(level) => self.crosses(was_ready, value < level, value >= level),
            Condition::Falling(level) => self.crosses(was_ready, value > level, value <= level),
            Condition::Changed => {
                let before = std::mem::replace(&mut self.before, Before::Value(value));
                let is_same = |before: f64| before == value || (before.is_nan() && value.is_nan());
                matches!(before, Before::Value(before) if !is_same(before))
            }
        }
    }

    /// Neither before nor beyond the level is a NaN only.
    fn crosses(&mut self, was_ready: bool, is_before: bool, is_beyond: bool) -> bool {
        if is_before || is_beyond {
            self.before = Before::Ready(is_before);
        }
        was_ready && is_beyond
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NAN: f64 = f64::NAN;

    /// The cycles in which it fires.
    fn fired(condition: Condition, values: &[f64]) -> Vec<usize> {
        let mut edge = Edge::new(condition);
        let cycles = values.iter().enumerate();
        cycles.filter(|(_, value)| edge.fires(**value)).map(|(cycle, _)| cycle).collect()
    }

    fn compare(comparison: Comparator, level: f64) -> Condition {
        Condition::Compare(comparison, level)
    }

    #[test]
    fn a_condition_fires_when_it_becomes_true_and_not_while_it_is_or_was_from_the_beginning() {
        let greater = compare(Comparator::Greater, 1.0);
        assert_eq!(fired(greater, &[0.0, 1.0, 1.5, 2.0, 0.0, 3.0]), [2, 5]);
        assert_eq!(fired(greater, &[2.0, 3.0, 0.0, 2.0]), [3]);
        assert_eq!(fired(compare(Comparator::AtMost, 1.0), &[2.0, 1.0, 0.0]), [1]);
    }

    #[test]
    fn numbers_are_compared_and_not_their_bits() {
        assert_eq!(fired(compare(Comparator::Equal, 0.0), &[1.0, -0.0]), [1]);
        assert_eq!(fired(Condition::Changed, &[0.0, -0.0, 0.0]), [0; 0]);
    }

    #[test]
    fn a_nan_is_unequal_and_nothing_else() {
        assert_eq!(fired(compare(Comparator::Greater, 1.0), &[0.0, NAN, 0.0]), [0; 0]);
        assert_eq!(fired(compare(Comparator::Less, 1.0), &[2.0, NAN, 2.0]), [0; 0]);
        assert_eq!(fired(compare(Comparator::Equal, 1.0), &[0.0, NAN]), [0; 0]);
        assert_eq!(fired(compare(Comparator::Unequal, 1.0), &[1.0, NAN, NAN]), [1]);
        assert_eq!(fired(compare(Comparator::Greater, 1.0), &[NAN, 2.0]), [1]);
        assert_eq!(fired(Condition::Changed, &[1.0, NAN, NAN, 1.0]), [1, 3]);
    }

    #[test]
    fn a_crossing_comes_from_the_other_side_whatever_nan_lies_between() {
        assert_eq!(fired(Condition::Rising(1.0), &[1.0, 2.0, 0.0, NAN, NAN, 1.0, 2.0]), [5]);
        assert_eq!(fired(Condition::Rising(1.0), &[NAN, 2.0]), [0; 0]);
        assert_eq!(fired(Condition::Falling(1.0), &[0.0, 2.0, 1.0, 0.0, 1.0]), [2]);
        assert_eq!(fired(Condition::Rising(0.5), &[1.0, 0.0, 1.0, 1.0, 0.0, 1.0]), [2, 5]);
    }

    proptest! {
        #[test]
        fn a_comparison_fires_exactly_where_it_is_true_and_was_false_one_cycle_earlier(
            values in prop::collection::vec(prop_oneof![-2.0..2.0, Just(NAN), Just(1.0), Just(0.0)], 0..60),
            sign in 0usize..6,
        ) {
            let comparisons = [
                Comparator::Greater, Comparator::Less, Comparator::AtLeast,
                Comparator::AtMost, Comparator::Equal, Comparator::Unequal,
            ];
            let holds = |value: f64| comparisons[sign].holds(value, 1.0);
            let expected: Vec<usize> = (1..values.len())
                .filter(|cycle| holds(values[*cycle]) && !holds(values[cycle - 1]))
                .collect();
            prop_assert_eq!(fired(compare(comparisons[sign], 1.0), &values), expected);
        }
    }
}
