//! The time of the timers, and what they decide alike.

use core::slice::{Iter, IterMut};

use crate::{Cycle, Decision, StateField};

const NS_PER_MS: u64 = 1_000_000;

pub(super) const TIME_BASE: Decision = Decision {
    silent_on: "the time base",
    chosen: "the task's grid, cycles times period in whole nanoseconds, so nothing drifts; `ET` is rounded down to \
             milliseconds. A time that is retained goes on where it stood, also in a task with another period",
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

/// A time that runs. Nanoseconds, as the task may have another period after a restart, which cycles would not survive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Time {
    elapsed_ns: u64,
    /// The last cycle that counted.
    cycle: u64,
    is_over: bool,
}

impl Time {
    /// One that begins in a cycle.
    #[inline]
    pub(super) fn from(cycle: &Cycle<'_>) -> Self {
        Self { elapsed_ns: 0, cycle: cycle.index(), is_over: false }
    }

    /// Lets the time pass that lies between the last call and this one: whether it is over, and its `ET`.
    #[inline]
    pub(super) fn pass(&mut self, pt: i32, cycle: &Cycle<'_>) -> (bool, i32) {
        let pt = pt.max(0);
        let cycles = cycle.index().saturating_sub(self.cycle);
        self.elapsed_ns = self.elapsed_ns.saturating_add(cycles.saturating_mul(cycle.period_ns()));
        self.cycle = cycle.index();
        self.is_over |= self.elapsed_ns >= u64::from(pt.unsigned_abs()) * NS_PER_MS;
        // Less than `PT`, so it fits.
        (self.is_over, if self.is_over { pt } else { (self.elapsed_ns / NS_PER_MS) as i32 })
    }
}

impl StateField for Time {
    const WORDS: usize = 3;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        Self { elapsed_ns: u64::take(words), cycle: u64::take(words), is_over: bool::take(words) }
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        self.elapsed_ns.put(words);
        self.cycle.put(words);
        self.is_over.put(words);
    }
}
