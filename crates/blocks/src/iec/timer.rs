//! The time of the timers, and what they decide alike.

use crate::{Cycle, Decision};

const NS_PER_MS: u64 = 1_000_000;

pub(super) const TIME_BASE: Decision = Decision {
    silent_on: "the time base",
    chosen: "the task's grid, cycles times period in whole nanoseconds, so nothing drifts; `ET` is rounded down to \
             milliseconds",
};
pub(super) const SKIPPED_CYCLES: Decision = Decision {
    silent_on: "cycles skipped after an overrun",
    chosen: "counted as elapsed time; changes of `IN` in them are not seen",
};
pub(super) const NEGATIVE_PT: Decision = Decision {
    silent_on: "a negative `PT`",
    chosen: "treated as 0: the time is over in the call in which it begins",
};
pub(super) const CHANGED_PT: Decision = Decision {
    silent_on: "a `PT` that changes while the time runs",
    chosen: "read in every call, and acts at once; a time that is over stays over, and `ET` then shows the new `PT`",
};

/// Whether a time that began in the cycle `start` is over, and its `ET`.
#[inline]
pub(super) fn elapsed(start: u64, was_over: bool, pt: i32, cycle: &Cycle<'_>) -> (bool, i32) {
    let pt = pt.max(0);
    let elapsed_ns = cycle.index().saturating_sub(start).saturating_mul(cycle.period_ns());
    if was_over || elapsed_ns >= u64::from(pt.unsigned_abs()) * NS_PER_MS {
        (true, pt)
    } else {
        // Less than `PT`, so it fits.
        (false, (elapsed_ns / NS_PER_MS) as i32)
    }
}
