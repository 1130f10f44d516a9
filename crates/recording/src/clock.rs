//! How Unix time and the monotonic clock differ.

use std::collections::BTreeMap;

use mcap::records::Metadata;

/// Name of the metadata.
const NAME: &str = "isochrone.clock";
const MONOTONIC: &str = "monotonic_ns";
const UNIX: &str = "unix_ns";

/// Two clocks, read at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClockReading {
    /// `CLOCK_MONOTONIC`, in ns.
    pub monotonic_ns: u64,
    /// Unix time, in ns.
    pub unix_ns: u64,
}

impl ClockReading {
    /// A time of the monotonic clock in Unix time.
    pub fn unix_ns(self, monotonic_ns: u64) -> u64 {
        monotonic_ns.wrapping_sub(self.monotonic_ns).wrapping_add(self.unix_ns)
    }

    /// A Unix time on the monotonic clock.
    pub fn monotonic_ns(self, unix_ns: u64) -> u64 {
        unix_ns.wrapping_sub(self.unix_ns).wrapping_add(self.monotonic_ns)
    }

    /// By how much Unix time has moved against the monotonic clock between two readings, in ns.
    pub(crate) fn moved_ns(self, since: Self) -> u64 {
        let expected = since.unix_ns(self.monotonic_ns);
        self.unix_ns.wrapping_sub(expected).cast_signed().unsigned_abs()
    }

    pub(crate) fn metadata(self) -> Metadata {
        let entries = [(MONOTONIC, self.monotonic_ns), (UNIX, self.unix_ns)];
        let metadata = entries.map(|(key, ns)| (key.to_owned(), ns.to_string())).into();
        Metadata { name: NAME.into(), metadata }
    }

    pub(crate) fn from_metadata(name: &str, metadata: &BTreeMap<String, String>) -> Option<Self> {
        let ns = |key| metadata.get(key)?.parse().ok();
        (name == NAME).then_some(())?;
        Some(Self { monotonic_ns: ns(MONOTONIC)?, unix_ns: ns(UNIX)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_the_same_instants_on_both_clocks() {
        let reading = ClockReading { monotonic_ns: 1000, unix_ns: 5_000_000 };
        assert_eq!((reading.unix_ns(1010), reading.unix_ns(900)), (5_000_010, 4_999_900));
        assert_eq!(reading.monotonic_ns(reading.unix_ns(7)), 7);
        let later = ClockReading { monotonic_ns: 1500, unix_ns: 5_000_400 };
        assert_eq!((later.moved_ns(reading), reading.moved_ns(reading)), (100, 0));
        let Metadata { name, metadata } = reading.metadata();
        assert_eq!(ClockReading::from_metadata(&name, &metadata), Some(reading));
    }
}
