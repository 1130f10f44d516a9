//! SR: a bistable that a set dominates.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Remembers a set until a reset; set dominates.
    pub Sr as "SR" {
        follows { "SR, IEC 61131-3" }
        inputs {
            /// Set; dominates.
            "S1" => s1: bool = false,
            /// Reset.
            "R" => r: bool = false,
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
            "`Q1 = S1 OR (NOT R AND Q1)`; `Q1` starts FALSE.",
        }
        decisions {
            Decision {
                silent_on: "a set and a reset between two calls",
                chosen: "not seen: the inputs are read in each call",
            },
        }
    }
}

impl Block for Sr {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        state.q1 = inputs.s1 || (!inputs.r && state.q1);
        Outputs { q1: state.q1 }
    }

    /// Set.
    fn typical() -> Inputs {
        Inputs { s1: true, ..Inputs::default() }
    }
}
