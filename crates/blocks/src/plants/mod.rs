//! Models of processes, so that a control loop is simulated in one configuration.
//!
//! Each is discretised exactly for an input that stands from one cycle to the next (zero-order hold): at the cycles its
//! output is that of the continuous process. A loop is closed with `@prev` at the input of the plant.

pub mod dead_time;
pub mod integrator;
pub mod pt1;
pub mod pt2;

use crate::Decision;

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
    chosen: "it holds, and no time passes for the plant",
};
