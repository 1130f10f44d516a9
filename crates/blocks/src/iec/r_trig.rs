//! R_TRIG: a rising edge.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Detects a rising edge: `Q` is TRUE for one call.
    pub RTrig as "R_TRIG" {
        follows { "R_TRIG, IEC 61131-3" }
        inputs {
            /// Signal to watch.
            "CLK" => clk: bool = false,
        }
        outputs {
            /// `CLK` was FALSE in the last call and is TRUE in this one.
            "Q" => q: bool,
        }
        state {
            /// `CLK` in the last call.
            last: bool,
        }
        computes {
            "`Q = CLK AND NOT M`, then `M = CLK`; `M` starts FALSE.",
            "So a `CLK` that is TRUE in the first call gives `Q` TRUE in that call.",
        }
        decisions {
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "not seen: an edge lies between two calls, and two edges in between are none",
            },
        }
    }
}

impl Block for RTrig {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let q = inputs.clk && !state.last;
        state.last = inputs.clk;
        Outputs { q }
    }

    /// A signal that is TRUE: after the first call, no edge.
    fn typical() -> Inputs {
        Inputs { clk: true }
    }
}
