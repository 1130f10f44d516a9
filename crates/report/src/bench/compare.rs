//! Comparison of two distributions, with its confidence.
//!
//! Machines are disturbed in bursts, so consecutive samples are correlated and a test that treats
//! each as independent is far too confident. The samples are therefore kept in turns of a second or
//! more, and the interval of a ratio comes from resampling whole turns (block bootstrap).

use serde::{Deserialize, Serialize};

use super::chance::Chance;
use super::samples::{Side, TurnSamples};

/// Draws of the bootstrap.
const DRAWS: usize = 2_000;
/// Part of the draws that lie outside the interval: below it and above it each half of this.
const OUTSIDE: f64 = 0.01;
/// Ratios closer to 1 than this count as no difference.
pub const TOLERANCE: f64 = 0.10;

/// How a quantile of one side compares with that of the other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Ratio {
    /// Quantile of the reference, in the unit of the samples.
    pub reference: u64,
    /// Quantile of the candidate, in the unit of the samples.
    pub candidate: u64,
    /// Reference divided by candidate: above 1 the candidate is lower, which is better.
    pub ratio: f64,
    /// Lower bound of the interval that contains 99 % of the ratios obtained by resampling the
    /// turns.
    pub low: f64,
    /// Upper bound of that interval.
    pub high: f64,
    /// The conclusion from the interval.
    pub verdict: Verdict,
}

/// The result of a comparison.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Verdict {
    /// The candidate is lower, with the whole interval beyond the tolerance.
    Better,
    /// The samples show no difference.
    #[default]
    Same,
    /// The candidate is higher, with the whole interval beyond the tolerance.
    Worse,
}

impl Verdict {
    /// `better`, `same` or `worse`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Same => "same",
            Self::Worse => "worse",
        }
    }
}

/// How the turns of two sides relate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pairing {
    /// Turn *i* of one side ran next to turn *i* of the other. Both are resampled together, so that
    /// disturbances that affected both cancel out.
    Paired,
    /// The sides ran independently, as in two runs, and are resampled separately.
    Apart,
}

/// Why two sides cannot be compared at a quantile: one of them is too short.
#[derive(Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TooShort {
    /// A side has fewer than five valid turns. Run it longer.
    #[error("{found} of {FEWEST_TURNS} valid turns; run it {} times as long", longer(*.found as u64, FEWEST_TURNS as u64))]
    Turns {
        /// Valid turns of the shorter side.
        found: usize,
    },
    /// Fewer than ten samples of a side lie beyond the quantile. Run it longer.
    #[error("{found} of {needed} samples; run it {} times as long", longer(*.found, *.needed))]
    Samples {
        /// Samples of the shorter side.
        found: u64,
        /// Samples of which ten lie beyond.
        needed: u64,
    },
}

isochrone_model::debug_as_display!(TooShort);

const FEWEST_TURNS: usize = 5;

/// How many times as long a run must be that found some of what it needs.
fn longer(found: u64, needed: u64) -> u64 {
    needed.div_ceil(found.max(1)).max(2)
}

/// Compares the quantile (0 to 1) of two sides. Values no further apart than `resolution`, in the
/// unit of the samples, count as the same.
///
/// # Errors
/// A side has fewer than five turns, or fewer than ten of its samples lie beyond the quantile.
pub fn ratio(
    reference: &[TurnSamples],
    candidate: &[TurnSamples],
    quantile: f64,
    pairing: Pairing,
    resolution: u64,
) -> Result<Ratio, TooShort> {
    let paired = pairing == Pairing::Paired && reference.len() == candidate.len();
    let turns = reference.len().min(candidate.len());
    if turns < FEWEST_TURNS {
        return Err(TooShort::Turns { found: turns });
    }
    let (first, second) = (Side::new(reference), Side::new(candidate));
    let samples = first.count().min(second.count());
    if !supports(samples, quantile) {
        return Err(TooShort::Samples { found: samples, needed: needed(quantile) });
    }
    let (reference, candidate) = (first.quantile(quantile), second.quantile(quantile));
    let mut chance = Chance(0x1505_3c29_9e77_01f3);
    let mut draws: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let one = chance.draw(first.turns.len());
            let other = if paired { one.clone() } else { chance.draw(second.turns.len()) };
            quotient(first.weighted(quantile, &one), second.weighted(quantile, &other))
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let at = |part: f64| draws.get((part * (DRAWS - 1) as f64) as usize).copied().unwrap_or(1.0);
    let (low, high) = (at(OUTSIDE / 2.0), at(1.0 - OUTSIDE / 2.0));
    let apart = reference.abs_diff(candidate) > resolution;
    let verdict = match () {
        () if apart && low > 1.0 + TOLERANCE => Verdict::Better,
        () if apart && high < 1.0 / (1.0 + TOLERANCE) => Verdict::Worse,
        () => Verdict::Same,
    };
    let ratio = quotient(reference, candidate);
    Ok(Ratio { reference, candidate, ratio, low, high, verdict })
}

/// Number of samples of which ten lie beyond a quantile (0 to 1).
pub fn needed(quantile: f64) -> u64 {
    (10.0 / (1.0 - quantile) - 1e-6).ceil() as u64
}

/// Whether ten of `count` samples lie beyond a quantile (0 to 1), which is enough to compare it.
pub fn supports(count: u64, quantile: f64) -> bool {
    // What binary fractions make of 1 - 0.9999 must not cost a sample.
    count as f64 * (1.0 - quantile) >= 10.0 - 1e-6
}

/// 0 is what lies below the unit: 1 stands for it.
fn quotient(reference: u64, candidate: u64) -> f64 {
    reference.max(1) as f64 / candidate.max(1) as f64
}

#[cfg(test)]
mod tests {
    use isochrone_timing::Distribution;

    use super::*;

    /// Two readings of a clock, in ns.
    const CLOCK: u64 = 50;

    /// A machine with bouts: each turn has its own level (half of them within a third of 10 us, a
    /// few at two or a half of it), and samples with a tail around it.
    fn run(seed: u64, turns: usize, slowdown: f64) -> Vec<TurnSamples> {
        let mut chance = Chance(seed);
        let mut uniform = move || (chance.next() >> 11) as f64 / (1u64 << 53) as f64;
        let turn = |_| {
            // The sum of twelve is as good as normal.
            let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let level_ns = 10_000.0 * (0.4 * normal).exp();
            let mut distribution = Distribution::new();
            for _ in 0..500 {
                let tail = -(uniform().max(1e-12)).ln();
                distribution.record((slowdown * level_ns * (1.0 + 0.3 * tail)) as u64);
            }
            TurnSamples::of(&distribution)
        };
        (0..turns).map(turn).collect()
    }

    fn verdict(a: &[TurnSamples], b: &[TurnSamples], quantile: f64) -> Verdict {
        ratio(a, b, quantile, Pairing::Apart, CLOCK).unwrap().verdict
    }

    #[test]
    fn two_runs_of_the_same_thing_are_the_same_at_least_95_times_of_100() {
        const QUANTILES: [f64; 3] = [0.5, 0.9, 0.99];
        let found = |seed: u64| {
            let (a, b) = (run(2 * seed + 1, 12, 1.0), run(2 * seed + 2, 12, 1.0));
            QUANTILES.map(|quantile| ratio(&a, &b, quantile, Pairing::Apart, CLOCK).unwrap())
        };
        let found: Vec<[Ratio; 3]> = (0..100).map(found).collect();
        let times =
            |is: &dyn Fn(&Ratio) -> bool| found.iter().filter(|run| run.iter().all(is)).count();
        let same = times(&|ratio| ratio.verdict == Verdict::Same);
        assert!(same >= 95, "{same}");
        // Who looks at the ratios alone is wrong most of the time.
        let alike = times(&|ratio| (ratio.ratio.ln()).abs() < (1.0 + TOLERANCE).ln());
        assert!(alike < 50, "{alike}");
    }

    #[test]
    fn a_slowed_side_is_worse_and_the_other_way_round_better() {
        let (usual, slowed) = (run(1, 12, 1.0), run(2, 12, 3.0));
        for quantile in [0.5, 0.99] {
            assert_eq!(verdict(&usual, &slowed, quantile), Verdict::Worse);
            assert_eq!(verdict(&slowed, &usual, quantile), Verdict::Better);
        }
    }

    #[test]
    fn the_ratio_says_how_many_times_lower_and_lies_in_its_interval() {
        let found = ratio(&run(1, 12, 3.0), &run(2, 12, 1.0), 0.5, Pairing::Paired, CLOCK).unwrap();
        assert!((1.5..6.0).contains(&found.ratio), "{found:?}");
        assert!(found.low <= found.ratio && found.ratio <= found.high, "{found:?}");
    }

    #[test]
    fn what_the_clock_cannot_tell_apart_is_the_same() {
        let exactly = |ns: u64| {
            let mut distribution = Distribution::new();
            distribution.record_many(ns, 5_000);
            vec![TurnSamples::of(&distribution); 6]
        };
        assert_eq!(verdict(&exactly(10), &exactly(60), 0.5), Verdict::Same);
        assert_eq!(verdict(&exactly(10), &exactly(61), 0.5), Verdict::Worse);
    }

    #[test]
    fn too_few_turns_or_samples_say_nothing() {
        let (few, enough) = (run(1, 4, 1.0), run(2, 12, 1.0));
        let of = |a: &[TurnSamples], b: &[TurnSamples], quantile| {
            ratio(a, b, quantile, Pairing::Apart, CLOCK)
                .map(|_| ())
                .map_err(|error| error.to_string())
        };
        let why = "4 of 5 valid turns; run it 2 times as long";
        assert_eq!(of(&few, &enough, 0.5).unwrap_err(), why);
        let why = "6000 of 100000 samples; run it 17 times as long";
        assert_eq!(of(&enough, &enough, 0.9999).unwrap_err(), why);
        assert_eq!(of(&enough, &enough, 0.99), Ok(()));
        let why = "0 of 5 valid turns; run it 5 times as long";
        assert_eq!(of(&[], &[], 0.5).unwrap_err(), why);
    }
}
