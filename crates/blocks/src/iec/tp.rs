//! TP: a pulse.

use super::timer::Time;
use crate::{Block, Cycle, Decision};

crate::block! {
    /// Makes a pulse of a fixed length from a rising edge.
    pub Tp as "TP" {
        follows { "TP, IEC 61131-3" }
        inputs {
            /// Signal whose rising edge starts the pulse.
            "IN" => in_: bool = false,
            /// Preset time.
            "PT" => pt: i32 ["ms"] = 0,
        }
        outputs {
            /// The pulse.
            "Q" => q: bool,
            /// Elapsed time, at most `PT`.
            "ET" => et: i32 ["ms"],
        }
        state {
            time: Time,
            /// The time has begun.
            is_running: bool,
            /// `IN` in the last call.
            last: bool,
        }
        computes {
            "`IN` that rises, in the first call too, starts a pulse; `ET` is 0 in that call.",
            "`Q` is TRUE until `PT` has elapsed, whatever `IN` does meanwhile.",
            "After the pulse, `ET` stays at `PT` while `IN` is TRUE, and is 0 afterwards.",
        }
        decisions {
            super::timer::TIME_BASE,
            super::timer::SKIPPED_CYCLES,
            super::timer::NEGATIVE_PT,
            super::timer::CHANGED_PT,
            Decision {
                silent_on: "an edge in the call in which a pulse ends",
                chosen: "starts the next pulse, so `Q` stays TRUE",
            },
        }
    }
}

impl Block for Tp {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let rises = inputs.in_ && !state.last;
        state.last = inputs.in_;
        let is_over = state.is_running && state.time.pass(inputs.pt, cycle).0;
        if rises && (is_over || !state.is_running) {
            *state = State { time: Time::from(cycle), is_running: true, last: true };
        } else if !state.is_running || (is_over && !inputs.in_) {
            *state = State { last: inputs.in_, ..State::default() };
            return Outputs { q: false, et: 0 };
        }
        let (is_over, et) = state.time.pass(inputs.pt, cycle);
        Outputs { q: !is_over, et }
    }

    /// A time that runs for hours.
    fn typical() -> Inputs {
        Inputs { in_: true, pt: i32::MAX }
    }
}
