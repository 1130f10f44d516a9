//! Ratios in words: `3.85 times higher` rather than `0.26 times lower`.

use isochrone_timing::units::three_digits;

use crate::bench::{Comparison, Verdict};

/// Which side of its reference a candidate is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Lower,
    Higher,
    /// As far as three digits show.
    Equal,
}

impl Side {
    const fn as_str(self) -> &'static str {
        match self {
            Self::Lower => "lower",
            Self::Higher => "higher",
            Self::Equal => "equal",
        }
    }
}

/// A ratio as people say it: how many times, never below 1, and on which side.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Worded {
    times: String,
    side: Side,
}

impl Worded {
    /// Words reference divided by candidate.
    fn new(ratio: f64) -> Self {
        let (times, side) = if ratio < 1.0 {
            (three_digits(ratio.recip()), Side::Higher)
        } else {
            (three_digits(ratio), Side::Lower)
        };
        let side = if times == "1.00" { Side::Equal } else { side };
        Self { times, side }
    }
}

/// Words a ratio (reference divided by candidate): `1241 times lower`, `3.85 times higher`, or
/// `equal` if three digits show no difference.
pub fn ratio_in_words(ratio: f64) -> String {
    match Worded::new(ratio) {
        Worded { side: Side::Equal, .. } => Side::Equal.as_str().to_owned(),
        Worded { times, side } => format!("{times} times {}", side.as_str()),
    }
}

/// Words a ratio as a comparison: `3.85 times higher than sleep`, `equal to sleep`.
pub(crate) fn comparison_in_words(ratio: f64, reference: &str) -> String {
    match Worded::new(ratio).side {
        Side::Equal => format!("equal to {reference}"),
        Side::Lower | Side::Higher => format!("{} than {reference}", ratio_in_words(ratio)),
    }
}

/// Words what a comparison shows: `3.85 times higher`, or `no demonstrable difference` where the verdict is that the
/// samples show none, however far apart the two are.
pub(crate) fn verdict_in_words(comparison: &Comparison) -> String {
    match comparison.verdict {
        Verdict::Same => "no demonstrable difference".to_owned(),
        Verdict::Better | Verdict::Worse => ratio_in_words(comparison.ratio),
    }
}

/// Words the interval of a ratio to follow [`ratio_in_words`]: `3.33 to 5.00`. The bounds ascend on
/// the side of the ratio; those of an interval that contains 1 name their sides: `1.08 lower to 1.77
/// higher`.
pub(crate) fn interval_in_words(ratio: f64, low: f64, high: f64) -> String {
    let side = Worded::new(ratio).side;
    let bounds = if side == Side::Higher { [high, low] } else { [low, high] }.map(Worded::new);
    let differs = |bound: &Worded| bound.side != Side::Equal && bound.side != side;
    let names_sides = bounds.iter().any(differs);
    let [from, to] = bounds.map(|Worded { times, side }| {
        if names_sides && side != Side::Equal {
            format!("{times} {}", side.as_str())
        } else {
            times
        }
    });
    format!("{from} to {to}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_below_one_is_so_many_times_higher() {
        for (ratio, words) in [
            (1_240.6, "1241 times lower"),
            (4.0, "4.00 times lower"),
            (1.01, "1.01 times lower"),
            (1.004, "equal"),
            (1.0, "equal"),
            (0.998, "equal"),
            (0.989, "1.01 times higher"),
            (0.26, "3.85 times higher"),
            (1e-6, "1000000 times higher"),
        ] {
            assert_eq!(ratio_in_words(ratio), words, "{ratio}");
        }
    }

    #[test]
    fn a_comparison_is_a_sentence_on_either_side_and_between() {
        for (ratio, words) in [
            (4.0, "4.00 times lower than sleep"),
            (0.25, "4.00 times higher than sleep"),
            (1.0, "equal to sleep"),
        ] {
            assert_eq!(comparison_in_words(ratio, "sleep"), words);
        }
    }

    #[test]
    fn the_bounds_of_an_interval_swap_with_the_ratio_and_ascend() {
        for (ratio, low, high, words) in [
            (856.0, 733.0, 1_026.0, "733 to 1026"),
            (0.26, 0.2, 0.3, "3.33 to 5.00"),
            (1.05, 0.999, 1.1, "1.00 to 1.10"),
            (1.0, 1.0, 1.0, "1.00 to 1.00"),
        ] {
            assert_eq!(interval_in_words(ratio, low, high), words);
        }
    }

    #[test]
    fn the_bounds_of_an_interval_that_contains_one_name_their_sides() {
        for (ratio, low, high, words) in [
            (1.29, 0.836, 3.15, "1.20 higher to 3.15 lower"),
            (0.739, 0.565, 1.08, "1.08 lower to 1.77 higher"),
            (1.0, 0.98, 1.02, "1.02 higher to 1.02 lower"),
            (1.0, 1.0, 1.02, "1.00 to 1.02 lower"),
        ] {
            assert_eq!(interval_in_words(ratio, low, high), words);
        }
    }
}
