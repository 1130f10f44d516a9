//! The quantities that reports measure, with their units.

use crate::units::{duration, picoseconds};

/// The unit of a metric's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unit {
    /// 10^-9 s.
    Nanoseconds,
    /// 10^-12 s.
    Picoseconds,
}

impl Unit {
    /// The symbol of a thousand units: `us` or `ns`.
    pub const fn of_a_thousand(self) -> &'static str {
        match self {
            Self::Nanoseconds => "us",
            Self::Picoseconds => "ns",
        }
    }
}

/// A quantity that reports measure and compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Key of its distribution in a report: `one_way_ns`.
    pub key: &'static str,
    /// Name in tables and on pages: `one-way latency`.
    pub name: &'static str,
    /// Unit of the values.
    pub unit: Unit,
    /// Values no further apart than this, in the unit, count as equal.
    pub resolution: u64,
}

/// Two readings of a clock, in ns.
const TWO_READINGS_NS: u64 = 50;

impl Metric {
    /// Start of a cycle minus its due time, for the cycles that ran.
    pub const RELEASE_JITTER: Self = Self::time("release_jitter_ns", "release jitter");
    /// The same with one sample for each missed release, as late as it would have been.
    pub const RELEASE_JITTER_CORRECTED: Self =
        Self::time("release_jitter_corrected_ns", "release jitter");
    /// Receive time minus publish time.
    pub const ONE_WAY: Self = Self::time("one_way_ns", "one-way latency");
    /// Time of one block instance in one cycle. Two clock readings are spread over a batch of at
    /// least 50 us, so for blocks of up to 50 ns they stay below the resolution.
    pub const STEP: Self = Self {
        key: "step_ps",
        name: "time of one instance",
        unit: Unit::Picoseconds,
        resolution: 50,
    };
    /// All metrics.
    pub const ALL: [Self; 4] =
        [Self::RELEASE_JITTER, Self::RELEASE_JITTER_CORRECTED, Self::ONE_WAY, Self::STEP];

    const fn time(key: &'static str, name: &'static str) -> Self {
        Self { key, name, unit: Unit::Nanoseconds, resolution: TWO_READINGS_NS }
    }

    /// The metric with this key; `None` if this version does not know it.
    pub fn find(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|metric| metric.key == key)
    }

    /// Formats a value with its unit: `52.0 us`, `7.31 ns`.
    pub fn shown(self, value: u64) -> String {
        match self.unit {
            Unit::Nanoseconds => duration(value as f64),
            Unit::Picoseconds => picoseconds(value),
        }
    }

    /// Converts a value to ns.
    pub fn in_ns(self, value: u64) -> f64 {
        match self.unit {
            Unit::Nanoseconds => value as f64,
            Unit::Picoseconds => value as f64 / 1e3,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_shown_in_the_unit_of_its_metric() {
        assert_eq!(Metric::ONE_WAY.shown(52_000), "52.0 us");
        assert_eq!(Metric::STEP.shown(7_312), "7.31 ns");
        assert_eq!((Metric::ONE_WAY.in_ns(500), Metric::STEP.in_ns(500)), (500.0, 0.5));
    }

    #[test]
    fn a_metric_is_found_by_its_key_which_says_its_unit() {
        for metric in Metric::ALL {
            assert_eq!(Metric::find(metric.key), Some(metric));
            let suffix = match metric.unit {
                Unit::Nanoseconds => "_ns",
                Unit::Picoseconds => "_ps",
            };
            assert!(metric.key.ends_with(suffix), "{metric:?}");
        }
        assert_eq!(Metric::find("smell_ns"), None);
    }
}
