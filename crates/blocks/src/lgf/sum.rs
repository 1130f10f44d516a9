//! A sum of many LREALs that does not lose what each addition rounds away.

use core::slice::{Iter, IterMut};

use crate::StateField;

/// A sum as an unevaluated pair: `low` is what rounding cut off `high` (Knuth's TwoSum).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sum {
    pub(crate) high: f64,
    pub(crate) low: f64,
}

impl Sum {
    /// The sum with one more term.
    #[inline]
    pub(crate) fn plus(self, term: f64) -> Self {
        let (high, lost) = two_sum(self.high, term);
        // Never the greater one, as either was below a unit of `high`, or `high` is 0.
        let rest = self.low + lost;
        let sum = high + rest;
        Self { high: sum, low: rest - (sum - high) }
    }

    /// The sum with one more term, and without another: sooner ready than by adding both one after the other.
    #[inline]
    pub(crate) fn shifted(self, entering: f64, leaving: f64) -> Self {
        let (more, lost_entering) = two_sum(self.high, entering);
        let (high, lost_leaving) = two_sum(more, -leaving);
        let rest = (self.low + lost_entering) + lost_leaving;
        let (high, low) = two_sum(high, rest);
        Self { high, low }
    }

    /// The quotient by a number up to [`MAX_COUNT`], such that the mean of equal values is that value.
    #[inline]
    pub(crate) fn divided_by(self, count: u16) -> f64 {
        // Two divisions would take longer than all the rest of an average.
        let inverse = INVERSES[usize::from(count) % INVERSES.len()];
        let count = f64::from(count);
        let quotient = self.high * inverse;
        // A product of half of the digits and the count is exact, so the remainder is, too.
        let leading = f64::from_bits(quotient.to_bits() & !0x07FF_FFFF);
        let trailing = quotient - leading;
        let remainder = (self.high - leading * count) - trailing * count;
        quotient + (remainder + self.low) * inverse
    }
}

/// Greatest divisor.
pub(crate) const MAX_COUNT: u16 = 127;

/// The reciprocal of each divisor.
static INVERSES: [f64; MAX_COUNT as usize + 1] = {
    let mut inverses = [0.0; MAX_COUNT as usize + 1];
    let mut count = 1;
    while count < inverses.len() {
        inverses[count] = 1.0 / count as f64;
        count += 1;
    }
    inverses
};

/// The rounded sum and what the rounding cut off.
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

impl StateField for Sum {
    const WORDS: usize = 2;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        Self { high: f64::take(words), low: f64::take(words) }
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        self.high.put(words);
        self.low.put(words);
    }
}
