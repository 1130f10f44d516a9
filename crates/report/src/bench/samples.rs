//! The samples of turns, and the quantiles of several turns together.

use isochrone_timing::Distribution;

/// The samples of a turn: values in ascending order, each with the number of samples up to it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TurnSamples(Vec<(u64, u64)>);

impl TurnSamples {
    /// The samples of a distribution.
    pub fn of(distribution: &Distribution) -> Self {
        let mut passed = 0;
        let cumulated = distribution.buckets().map(|(value, count)| {
            passed += count;
            (value, passed)
        });
        Self(cumulated.collect())
    }

    fn count(&self) -> u64 {
        self.0.last().map_or(0, |(_, count)| *count)
    }

    /// How many samples are at most `most`.
    fn count_to(&self, most: u64) -> u64 {
        let above = self.0.partition_point(|(value, _)| *value <= most);
        above.checked_sub(1).and_then(|last| self.0.get(last)).map_or(0, |(_, count)| *count)
    }
}

/// One side of a comparison.
pub(super) struct Side<'a> {
    pub(super) turns: &'a [TurnSamples],
    /// The values that occur, ascending.
    values: Vec<u64>,
}

impl<'a> Side<'a> {
    pub(super) fn new(turns: &'a [TurnSamples]) -> Self {
        let mut values: Vec<u64> =
            turns.iter().flat_map(|turn| &turn.0).map(|(value, _)| *value).collect();
        values.sort_unstable();
        values.dedup();
        Self { turns, values }
    }

    pub(super) fn count(&self) -> u64 {
        self.turns.iter().map(TurnSamples::count).sum()
    }

    /// The quantile of all samples.
    pub(super) fn quantile(&self, quantile: f64) -> u64 {
        self.weighted(quantile, &vec![1; self.turns.len()])
    }

    /// The quantile when each turn counts as often as `weights` says.
    pub(super) fn weighted(&self, quantile: f64, weights: &[u64]) -> u64 {
        let sum = |of: &dyn Fn(&TurnSamples) -> u64| -> u64 {
            self.turns.iter().zip(weights).map(|(turn, weight)| weight * of(turn)).sum()
        };
        let wanted = ((sum(&TurnSamples::count) as f64 * quantile).ceil() as u64).max(1);
        let place = self.values.partition_point(|most| sum(&|turn| turn.count_to(*most)) < wanted);
        self.values.get(place).or(self.values.last()).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_over_turns_are_those_of_all_samples() {
        let mut merged = Distribution::new();
        let turns: Vec<TurnSamples> = (1..10)
            .map(|level| {
                let mut part = Distribution::new();
                (0..500).for_each(|step| part.record(level * 1_000 + step * 37));
                merged.merge(&part);
                TurnSamples::of(&part)
            })
            .collect();
        let side = Side::new(&turns);
        assert_eq!(side.count(), merged.count());
        for quantile in [0.0, 0.5, 0.9, 0.999, 1.0] {
            let (exact, of_merged) = (side.quantile(quantile), merged.quantile(quantile));
            assert!(exact.abs_diff(of_merged) <= exact / 1_000 + 1, "{quantile}");
        }
    }
}
