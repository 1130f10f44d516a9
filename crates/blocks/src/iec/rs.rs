//! RS: a bistable that a reset dominates.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Remembers a set until a reset; reset dominates.
    pub Rs as "RS" {
        follows { "RS, IEC 61131-3" }
        inputs {
            /// Sets `Q1`.
            "S" => s: bool = false,
            /// Reset; dominates.
            "R1" => r1: bool = false,
        }
        outputs {
            /// Set and not reset since.
            "Q1" => q1: bool,
        }
        state {
            /// The output of the last call.
            q1: bool,
        }
        computes {
            "`Q1 = NOT R1 AND (S OR Q1)`; `Q1` starts FALSE.",
        }
        decisions {
            Decision {
                silent_on: "a set and a reset between two calls",
                chosen: "not seen: the inputs are read in each call",
            },
        }
    }
}

impl Block for Rs {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        state.q1 = !inputs.r1 && (inputs.s || state.q1);
        Outputs { q1: state.q1 }
    }

    /// Sets `Q1`.
    fn typical() -> Inputs {
        Inputs { s: true, ..Inputs::default() }
    }
}
