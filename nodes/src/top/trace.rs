//! The last values of a signal as a line of blocks.

use std::collections::VecDeque;

/// Values that are kept: more than a line on the widest terminals has room for.
const KEPT: usize = 120;
const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// Where a number is NaN or infinite.
pub(super) const NO_LEVEL: char = '?';
/// Where a pin has no value, which is no fault.
pub(super) const UNSET: char = ' ';

/// The last values of a signal.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Trace(VecDeque<f64>);

impl Trace {
    pub(super) fn push(&mut self, value: f64) {
        if self.0.len() == KEPT {
            self.0.pop_front();
        }
        self.0.push_back(value);
    }

    /// The newest values as a line of at most so many characters, from the smallest of them to the
    /// largest. One that does not change runs along the bottom; `no_level` stands for NaN and infinity.
    pub(super) fn draw(&self, width: usize, no_level: char) -> String {
        let shown = self.0.iter().copied().skip(self.0.len().saturating_sub(width));
        let finite = shown.clone().filter(|value| value.is_finite());
        let least = finite.clone().fold(f64::INFINITY, f64::min);
        let greatest = finite.fold(f64::NEG_INFINITY, f64::max);
        // Halves: the span between two numbers can be more than a number.
        let span = greatest / 2.0 - least / 2.0;
        let level = |value: f64| {
            if !value.is_finite() {
                return no_level;
            }
            let part = if span > 0.0 { (value / 2.0 - least / 2.0) / span } else { 0.0 };
            let level = (part * (LEVELS.len() - 1) as f64).round() as usize;
            LEVELS.get(level).copied().unwrap_or(no_level)
        };
        shown.map(level).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(values: &[f64], width: usize) -> String {
        let mut trace = Trace::default();
        values.iter().for_each(|value| trace.push(*value));
        trace.draw(width, NO_LEVEL)
    }

    #[test]
    fn a_trace_goes_from_the_smallest_to_the_largest_value_that_is_shown() {
        assert_eq!(drawn(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], 8), "▁▂▃▄▅▆▇█");
        assert_eq!(drawn(&[1e9, -1.0, 1.0], 2), "▁█", "what is not shown has no part in it");
        assert_eq!(drawn(&[-1.7e308, 1.7e308], 2), "▁█", "the span is more than an f64 holds");
    }

    #[test]
    fn a_value_that_stays_is_a_line_and_one_that_is_no_number_says_so() {
        assert_eq!(drawn(&[5.0; 4], 3), "▁▁▁");
        assert_eq!(drawn(&[0.0, f64::NAN, f64::INFINITY, 1.0], 9), "▁??█");
        assert_eq!(drawn(&[f64::NAN], 9), "?");
        assert_eq!(drawn(&[], 9), "");
        assert_eq!(drawn(&[1.0], 0), "");
    }

    #[test]
    fn the_oldest_values_are_forgotten() {
        let mut trace = Trace::default();
        (0..10_000).for_each(|value| trace.push(f64::from(value)));
        assert_eq!(trace.draw(10_000, NO_LEVEL).chars().count(), KEPT);
    }
}
