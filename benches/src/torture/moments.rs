//! Moments and choices that look random, and are the same for the same seed.

use std::ops::Range;
use std::thread;
use std::time::Duration;

/// A sequence of numbers (splitmix64).
#[derive(Debug, Clone)]
pub(super) struct Moments(u64);

impl Moments {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Any number.
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number of a range; its beginning if that is empty.
    pub(super) fn of(&mut self, range: Range<u64>) -> u64 {
        range.start + self.next() % range.end.saturating_sub(range.start).max(1)
    }

    /// Whether something is so once in so many times.
    pub(super) fn once_in(&mut self, times: u64) -> bool {
        self.of(0..times) == 0
    }

    /// Sleeps for up to so many milliseconds.
    pub(super) fn sleep_up_to_ms(&mut self, most_ms: u64) {
        thread::sleep(Duration::from_micros(self.of(0..most_ms * 1_000)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_has_the_same_moments_and_they_stay_in_their_range() {
        let all = |seed| {
            let mut moments = Moments::new(seed);
            (0..100).map(|_| moments.of(5..9)).collect::<Vec<_>>()
        };
        assert_eq!(all(1), all(1));
        assert_ne!(all(1), all(2));
        assert!((5..9).all(|number| all(1).contains(&number)));
        assert!(all(1).iter().all(|number| (5..9).contains(number)));
    }
}
