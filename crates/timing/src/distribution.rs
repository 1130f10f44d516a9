//! Collects values and computes their distribution.

use std::collections::BTreeMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use hdrhistogram::Histogram;
use hdrhistogram::serialization::{Deserializer, Serializer, V2DeflateSerializer};

use crate::summary::Summary;

/// Highest value that percentiles resolve: 73 minutes in ns, 4.4 s in ps. Percentiles count higher
/// values as this one; minimum, mean and maximum stay exact.
pub const HIGHEST: u64 = 1 << 42;
const SIGNIFICANT_DIGITS: u8 = 3;

/// Values from 0 to [`HIGHEST`] in one unit, usually ns, kept to 3 significant digits
/// (HdrHistogram). The [`Metric`](crate::Metric) defines the unit.
///
/// Allocates about 270 kB once; recording allocates nothing.
#[derive(Debug, Clone)]
pub struct Distribution {
    histogram: Histogram<u64>,
    // HdrHistogram rounds the extremes to its buckets. These are exact.
    min: u64,
    max: u64,
    sum: u128,
}

impl Distribution {
    /// An empty distribution.
    pub fn new() -> Self {
        let Ok(histogram) = Histogram::new_with_bounds(1, HIGHEST, SIGNIFICANT_DIGITS) else {
            unreachable!("the bounds are constants that every test of this crate creates")
        };
        Self { histogram, min: u64::MAX, max: 0, sum: 0 }
    }

    /// Adds one sample.
    pub fn record(&mut self, value: u64) {
        self.histogram.saturating_record(value);
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        self.sum += u128::from(value);
    }

    /// Adds `count` equal samples.
    pub fn record_many(&mut self, value: u64, count: u64) {
        if count == 0 {
            return;
        }
        // A count that does not fit is the only error left, after 2^64 samples.
        let _ = self.histogram.record_n(value.min(HIGHEST), count);
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        self.sum += u128::from(value) * u128::from(count);
    }

    /// Removes all samples. Touches all of the memory, so that recording causes no page fault
    /// afterwards.
    pub fn clear(&mut self) {
        self.histogram.reset();
        (self.min, self.max, self.sum) = (u64::MAX, 0, 0);
    }

    /// Adds all samples of another distribution.
    pub fn merge(&mut self, other: &Self) {
        // Both have the same bounds, so nothing can be out of range.
        let _ = self.histogram.add(&other.histogram);
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.sum += other.sum;
    }

    /// Number of samples so far.
    pub fn count(&self) -> u64 {
        self.histogram.len()
    }

    /// The value that the fraction `quantile` (0 to 1) of the samples does not exceed, at most 0.1
    /// % above a sample. The caller checks whether there are enough samples for it.
    pub fn quantile(&self, quantile: f64) -> u64 {
        // A bucket is known by its highest value, which may lie beyond any sample.
        self.histogram.value_at_quantile(quantile).min(self.max)
    }

    /// The values that occur, rounded to 3 digits, each with its number of samples.
    pub fn buckets(&self) -> impl Iterator<Item = (u64, u64)> {
        self.histogram
            .iter_recorded()
            .map(|step| (step.value_iterated_to().min(self.max), step.count_at_value()))
    }

    /// The underlying histogram; its extremes are rounded to their buckets.
    pub fn histogram(&self) -> &Histogram<u64> {
        &self.histogram
    }

    /// Encodes the distribution for HdrHistogram's tools in any language: V2, deflated, base64. The
    /// extremes are rounded to their buckets.
    pub fn encode(&self) -> String {
        let mut bytes = Vec::new();
        match V2DeflateSerializer::new().serialize(&self.histogram, &mut bytes) {
            Ok(_) => BASE64.encode(bytes),
            Err(_) => unreachable!("writing to memory does not fail, and the counts fit"),
        }
    }

    /// Reads what [`encode`](Self::encode) or a tool of HdrHistogram wrote.
    ///
    /// # Errors
    /// The text is not such a histogram.
    pub fn decode(text: &str) -> Result<Self, DecodeError> {
        let bytes = BASE64.decode(text.trim()).map_err(|_| DecodeError)?;
        let read: Histogram<u64> =
            Deserializer::new().deserialize(&mut bytes.as_slice()).map_err(|_| DecodeError)?;
        let mut distribution = Self::new();
        for step in read.iter_recorded() {
            distribution.record_many(step.value_iterated_to(), step.count_at_value());
        }
        Ok(distribution)
    }

    /// The distribution so far, summarised.
    pub fn summary(&self) -> Summary {
        let count = self.histogram.len();
        if count == 0 {
            return Summary::default();
        }
        let mean = self.sum as f64 / count as f64;
        Summary {
            count,
            min: Some(self.min),
            mean: Some((mean * 10.0).round() / 10.0),
            p50: self.percentile(0.5, 2),
            p90: self.percentile(0.9, 10),
            p99: self.percentile(0.99, 100),
            p99_9: self.percentile(0.999, 1_000),
            p99_99: self.percentile(0.9999, 10_000),
            max: Some(self.max),
        }
    }

    fn percentile(&self, quantile: f64, needed: u64) -> Option<u64> {
        let enough = self.histogram.len() >= needed;
        enough.then(|| self.quantile(quantile))
    }
}

/// Encodes distributions by name for a report and leaves out empty ones.
pub fn encoded<const N: usize>(
    distributions: [(&str, &Distribution); N],
) -> BTreeMap<String, String> {
    let filled = distributions.into_iter().filter(|(_, distribution)| distribution.count() > 0);
    filled.map(|(name, distribution)| (name.to_owned(), distribution.encode())).collect()
}

/// The text is not an encoded histogram.
#[derive(Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not an HdrHistogram in V2 format, deflated and in base64 (HISTFAAA…)")]
pub struct DecodeError;

isochrone_model::debug_as_display!(DecodeError);

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
        assert!(summary.p50.is_some_and(|p50| (HIGHEST..2 * HIGHEST).contains(&p50)));
    }

    #[test]
    fn many_equal_samples_count_as_if_recorded_one_by_one() {
        let mut many = Distribution::new();
        many.record_many(700, 3);
        many.record_many(9, 0);
        assert_eq!(many.summary(), of([700, 700, 700]));
    }

    #[test]
    fn a_cleared_distribution_is_as_new() {
        let mut distribution = Distribution::new();
        distribution.record_many(900, 20);
        distribution.clear();
        assert_eq!(distribution.summary(), Summary::default());
        distribution.record(700);
        assert_eq!(distribution.summary(), of([700]));
    }

    #[test]
    fn merged_distributions_are_the_distribution_of_all_samples() {
        let mut merged = Distribution::new();
        for samples in [0..40_u64, 900..1_000] {
            let mut part = Distribution::new();
            samples.for_each(|ns| part.record(ns));
            merged.merge(&part);
        }
        assert_eq!(merged.summary(), of((0..40).chain(900..1_000)));
        assert_eq!(merged.count(), 140);
    }

    #[test]
    fn an_encoded_distribution_reads_back_with_all_its_percentiles() {
        let mut written = Distribution::new();
        (0..20_000).for_each(|ns| written.record(ns * 37));
        let text = written.encode();
        assert!(text.starts_with("HISTFAAA"), "{text}");
        let read = Distribution::decode(&text).unwrap();
        let (written, read) = (written.summary(), read.summary());
        assert_eq!((read.p50, read.p99_9), (written.p50, written.p99_9));
        assert_eq!(read.count, written.count);
    }

    #[test]
    fn a_text_that_is_no_histogram_is_an_error() {
        for text in ["", "HISTFAAA", "no", "AAAAAAAAAAAAAAAAAAAAAAAA"] {
            assert_eq!(Distribution::decode(text).unwrap_err(), DecodeError, "{text}");
        }
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
