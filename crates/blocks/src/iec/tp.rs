//! TP: a pulse.

use super::timer;
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
            /// Cycle in which the time began.
            start: u64,
            /// The time has begun.
            is_running: bool,
            /// The time has run out.
            is_over: bool,
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
        if state.is_running {
            (state.is_over, _) = timer::elapsed(state.start, state.is_over, inputs.pt, cycle);
        }
        if rises && (state.is_over || !state.is_running) {
            *state = State { start: cycle.index(), is_running: true, last: true, ..*state };
            state.is_over = false;
        }
        if !state.is_running || (state.is_over && !inputs.in_) {
            *state = State { last: inputs.in_, ..State::default() };
            return Outputs { q: false, et: 0 };
        }
        let (is_over, et) = timer::elapsed(state.start, state.is_over, inputs.pt, cycle);
        state.is_over = is_over;
        Outputs { q: !is_over, et }
    }

    /// A time that runs for hours.
    fn typical() -> Inputs {
        Inputs { in_: true, pt: i32::MAX }
    }
}
