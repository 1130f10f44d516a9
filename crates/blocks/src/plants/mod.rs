//! Models of processes, so that a control loop is simulated in one configuration.
//!
//! Each is discretised exactly for an input that stands from one cycle to the next (zero-order hold): at the cycles its
//! output is that of the continuous process. A loop is closed with `@prev` at the input of the plant.

pub mod dead_time;
pub mod integrator;
pub mod pt1;
pub mod pt2;

use core::slice::{Iter, IterMut};

use crate::{Cycle, Decision, StateField, status};

const INPUT: Decision = Decision {
    silent_on: "when the input acts",
    chosen: "over the time from the last call to this one; so a loop whose controller feeds the plant by `@prev` is sampled \
             without further delay",
};
const FIRST_CALL: Decision = Decision {
    silent_on: "the first call, and `reset`",
    chosen: "time 0: `y` is `initialValue`, at rest; the input does not act yet. A first call that is an error does \
             not count",
};
const SKIPPED_CYCLES: Decision = Decision {
    silent_on: "cycles skipped after an overrun",
    chosen: "counted as elapsed time, over which the input stood as it does in this call",
};
const ERRORS: Decision = Decision {
    silent_on: "the output during an error",
    chosen: "it holds, also with `reset`, and no time passes for the plant",
};

/// Whether a plant has begun, and when it was called last.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Progress {
    has_begun: bool,
    cycle: u64,
}

impl Progress {
    /// A call: `advance` gets whether the plant starts and the time since the last call, and returns the status word.
    #[inline]
    fn step(
        &mut self,
        reset: bool,
        cycle: &Cycle<'_>,
        advance: impl FnOnce(bool, u64) -> u16,
    ) -> u16 {
        let step_ns = cycle.elapsed_ns(self.has_begun.then_some(self.cycle));
        let status = advance(reset || !self.has_begun, step_ns);
        self.cycle = cycle.index();
        self.has_begun |= !status::is_error(status);
        status
    }
}

impl StateField for Progress {
    const WORDS: usize = 2;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        Self { has_begun: bool::take(words), cycle: u64::take(words) }
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        self.has_begun.put(words);
        self.cycle.put(words);
    }
}
