//! Reading Unix time, alone and together with the monotonic clock.

use std::time::{SystemTime, UNIX_EPOCH};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_recording::ClockReading;

/// How often the clocks are read at most, until no interruption came between the readings.
const ATTEMPTS: usize = 8;
/// How far apart two readings of the monotonic clock are at most if nothing interrupted them, in ns.
const PROMPT_NS: u64 = 5_000;

/// What both clocks read now: Unix time and `CLOCK_MONOTONIC`.
pub fn read_clocks() -> ClockReading {
    let mut best = (u64::MAX, ClockReading::default());
    for _ in 0..ATTEMPTS {
        let before_ns = Monotonic.now_ns();
        let unix_ns = unix_ns();
        let took_ns = Monotonic.now_ns().saturating_sub(before_ns);
        if took_ns < best.0 {
            best = (took_ns, ClockReading { monotonic_ns: before_ns + took_ns / 2, unix_ns });
        }
        if took_ns <= PROMPT_NS {
            break;
        }
    }
    best.1
}

/// Now, in ns of UTC since 1970.
pub(crate) fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
