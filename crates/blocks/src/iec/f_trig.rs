//! F_TRIG: a falling edge.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Detects a falling edge: `Q` is TRUE for one call.
    pub FTrig as "F_TRIG" {
        follows { "F_TRIG, IEC 61131-3" }
        inputs {
            /// Signal to watch.
            "CLK" => clk: bool = false,
        }
        outputs {
            /// `CLK` is FALSE and was not in the last call.
            "Q" => q: bool,
        }
        state {
            /// `CLK` was FALSE in the last call; not set before the first.
            was_low: bool,
        }
        computes {
            "`Q = NOT CLK AND NOT M`, then `M = NOT CLK`; `M` starts FALSE.",
            "So a `CLK` that is FALSE in the first call gives `Q` TRUE in that call, as the standard notes.",
        }
        decisions {
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "not seen: an edge lies between two calls, and two edges in between are none",
            },
        }
    }
}

impl Block for FTrig {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let q = !inputs.clk && !state.was_low;
        state.was_low = !inputs.clk;
        Outputs { q }
    }

    /// A signal that is TRUE: no edge.
    fn typical() -> Inputs {
        Inputs { clk: true }
    }
}
