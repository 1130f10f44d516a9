//! Unix time and the monotonic clock.

use std::time::{SystemTime, UNIX_EPOCH};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_recording::ClockReading;

/// What both clocks read now.
pub(crate) fn read_clocks() -> ClockReading {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let unix_ns = u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX);
    ClockReading { monotonic_ns: Monotonic.now_ns(), unix_ns }
}

/// The time of a message on the monotonic clock; `None` for one that lies in the future or before the machine started,
/// as simulated time does.
pub(super) fn monotonic_ns(now: ClockReading, unix_ns: u64) -> Option<u64> {
    let age_ns = now.unix_ns.checked_sub(unix_ns)?;
    now.monotonic_ns.checked_sub(age_ns).filter(|at_ns| *at_ns > 0)
}

/// By how much Unix time was set since another reading, in ns: negative if it went back.
pub(super) fn set_by_ns(now: ClockReading, before: ClockReading) -> i64 {
    let expected_ns = before.unix_ns(now.monotonic_ns);
    now.unix_ns.wrapping_sub(expected_ns).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: ClockReading = ClockReading { monotonic_ns: 1_000, unix_ns: 1_700_000 };

    #[test]
    fn a_stamp_is_used_if_it_is_of_this_run_of_the_machine() {
        assert_eq!(monotonic_ns(NOW, 1_699_900), Some(900));
        assert_eq!(monotonic_ns(NOW, 1_700_000), Some(1_000));
        assert_eq!(monotonic_ns(NOW, 1_700_001), None);
        assert_eq!(monotonic_ns(NOW, 1_699_000), None);
        assert_eq!(monotonic_ns(NOW, 12), None);
    }

    #[test]
    fn a_clock_that_is_set_shows_by_how_much() {
        let later = |unix_ns| ClockReading { monotonic_ns: 1_500, unix_ns };
        assert_eq!(set_by_ns(later(1_700_500), NOW), 0);
        assert_eq!(set_by_ns(later(1_700_300), NOW), -200);
        assert_eq!(set_by_ns(later(1_700_900), NOW), 400);
    }
}
