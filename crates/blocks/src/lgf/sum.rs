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

    /// The quotient by a whole number, such that the mean of equal values is that value.
    #[inline]
    pub(crate) fn divided_by(self, count: u16) -> f64 {
        let count = f64::from(count);
        let quotient = self.high / count;
        // A product of half of the digits and the count is exact, so the remainder is, too.
        let leading = f64::from_bits(quotient.to_bits() & !0x07FF_FFFF);
        let trailing = quotient - leading;
        let remainder = (self.high - leading * count) - trailing * count;
        quotient + (remainder + self.low) / count
    }
}

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
