//! What reports measure, and in which unit.

use crate::units::{duration, picoseconds};

/// The unit of a metric's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// 10^-9 s.
    Nanoseconds,
    /// 10^-12 s.
    Picoseconds,
}

impl Unit {
    /// The symbol of a thousand of it: `us` or `ns`.
    pub const fn of_a_thousand(self) -> &'static str {
        match self {
            Self::Nanoseconds => "us",
            Self::Picoseconds => "ns",
        }
    }
}

/// Something that a report measures and compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// The name of its distribution in a report: `one_way_ns`.
    pub key: &'static str,
    /// Its name for people: `one-way latency`.
    pub name: &'static str,
    /// The unit of its values.
    pub unit: Unit,
    /// Values no further apart than this, in the unit, are not told apart.
    pub resolution: u64,
}

/// Two readings of a clock, in ns.
const TWO_READINGS_NS: u64 = 50;

impl Metric {
    /// Begin of a cycle minus its due time, of the cycles that ran.
    pub const RELEASE_JITTER: Self = Self::time("release_jitter_ns", "release jitter");
    /// The same with the releases that were missed, each as late as it would have been.
    pub const RELEASE_JITTER_CORRECTED: Self =
        Self::time("release_jitter_corrected_ns", "release jitter");
    /// Received minus published.
    pub const ONE_WAY: Self = Self::time("one_way_ns", "one-way latency");
    /// Time of one block instance in one cycle. Two readings of the clock are spread over a batch of
    /// 50 us and more, so they are below this in blocks that take up to 50 ns.
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

    /// The metric of a report's key; `None` if this version does not know it.
    pub fn find(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|metric| metric.key == key)
    }

    /// A value for people, with its unit: `52.0 us`, `7.31 ns`.
    pub fn shown(self, value: u64) -> String {
        match self.unit {
            Unit::Nanoseconds => duration(value as f64),
            Unit::Picoseconds => picoseconds(value),
        }
    }

    /// A value in ns.
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
