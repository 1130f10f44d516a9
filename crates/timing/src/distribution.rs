//! Collects times and tells how they are distributed.

use hdrhistogram::Histogram;

use crate::summary::Summary;

/// Longest time that percentiles resolve, in ns: 73 minutes. Longer ones count as this long there;
/// minimum, mean and maximum stay exact.
pub const HIGHEST_NS: u64 = 1 << 42;
const SIGNIFICANT_DIGITS: u8 = 3;

/// Times from 0 ns to [`HIGHEST_NS`], kept to 3 significant digits (HdrHistogram).
///
/// Takes about 270 kB, once; recording allocates nothing.
#[derive(Debug, Clone)]
pub struct Distribution {
    histogram: Histogram<u64>,
    // HdrHistogram rounds the extremes to its buckets. These are exact.
    min_ns: u64,
    max_ns: u64,
    sum_ns: u128,
}

impl Distribution {
    /// An empty distribution.
    pub fn new() -> Self {
        let Ok(histogram) = Histogram::new_with_bounds(1, HIGHEST_NS, SIGNIFICANT_DIGITS) else {
            unreachable!("the bounds are constants that every test of this crate creates")
        };
        Self { histogram, min_ns: u64::MAX, max_ns: 0, sum_ns: 0 }
    }

    /// Adds one sample, in ns.
    pub fn record(&mut self, ns: u64) {
        self.histogram.saturating_record(ns);
        self.min_ns = self.min_ns.min(ns);
        self.max_ns = self.max_ns.max(ns);
        self.sum_ns += u128::from(ns);
    }

    /// The distribution so far.
    pub fn summary(&self) -> Summary {
        let count = self.histogram.len();
        if count == 0 {
            return Summary::default();
        }
        let mean = self.sum_ns as f64 / count as f64;
        Summary {
            count,
            min: Some(self.min_ns),
            mean: Some((mean * 10.0).round() / 10.0),
            p50: self.percentile(0.5, 2),
            p90: self.percentile(0.9, 10),
            p99: self.percentile(0.99, 100),
            p99_9: self.percentile(0.999, 1_000),
            p99_99: self.percentile(0.9999, 10_000),
            max: Some(self.max_ns),
        }
    }

    fn percentile(&self, quantile: f64, needed: u64) -> Option<u64> {
        let enough = self.histogram.len() >= needed;
        // A bucket is known by its highest value, which may lie beyond any sample.
        enough.then(|| self.histogram.value_at_quantile(quantile).min(self.max_ns))
    }
}

impl Default for Distribution {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn of(samples: impl IntoIterator<Item = u64>) -> Summary {
        let mut distribution = Distribution::new();
        samples.into_iter().for_each(|ns| distribution.record(ns));
        distribution.summary()
    }

    #[test]
    fn an_empty_distribution_has_a_count_of_zero_and_nothing_else() {
        assert_eq!(serde_json::to_string(&of([])).unwrap(), r#"{"count":0}"#);
    }

    #[test]
    fn an_empty_object_reads_as_an_empty_distribution() {
        assert_eq!(serde_json::from_str::<Summary>("{}").unwrap(), of([]));
    }

    #[test]
    fn a_percentile_appears_with_the_sample_that_supports_it() {
        let last_missing = |count: u64| {
            let s = of(0..count);
            [s.p50, s.p90, s.p99, s.p99_9, s.p99_99].iter().filter(|p| p.is_some()).count()
        };
        for (supported, needed) in [(1, 2), (2, 10), (3, 100), (4, 1_000), (5, 10_000)] {
            assert_eq!(last_missing(needed), supported, "{needed} samples");
            assert_eq!(last_missing(needed - 1), supported - 1, "{} samples", needed - 1);
        }
    }

    #[test]
    fn extremes_and_mean_are_exact() {
        let summary = of([123_457, 1_000_003, 7]);
        assert_eq!((summary.min, summary.max), (Some(7), Some(1_000_003)));
        assert_eq!(summary.mean, Some(374_489.0));
    }

    #[test]
    fn no_percentile_lies_beyond_the_largest_sample() {
        assert_eq!(of([1_000_001, 1_000_001]).p50, Some(1_000_001));
    }

    #[test]
    fn a_time_beyond_the_range_saturates_the_percentiles_and_not_the_maximum() {
        let summary = of([u64::MAX, u64::MAX]);
        assert_eq!(summary.max, Some(u64::MAX));
        assert_eq!(summary.mean, Some(u64::MAX as f64));
        assert!(summary.p50.is_some_and(|p50| (HIGHEST_NS..2 * HIGHEST_NS).contains(&p50)));
    }

    proptest! {
        // Each case is ten thousand samples.
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn percentiles_are_those_of_the_sorted_samples_within_three_digits(
            mut samples in prop::collection::vec(0u64..20_000_000_000, 10_000..10_100),
        ) {
            let summary = of(samples.iter().copied());
            samples.sort_unstable();
            for (permyriad, reported) in [
                (5_000, summary.p50),
                (9_000, summary.p90),
                (9_900, summary.p99),
                (9_990, summary.p99_9),
                (9_999, summary.p99_99),
            ] {
                let rank = (samples.len() * permyriad).div_ceil(10_000);
                let exact = samples[rank - 1];
                let reported = reported.unwrap();
                prop_assert!(reported >= exact, "{reported} below {exact}");
                prop_assert!(reported - exact <= exact / 1_000 + 1, "{reported} above {exact}");
            }
        }
    }
}
