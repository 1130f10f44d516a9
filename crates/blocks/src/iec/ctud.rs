//! CTUD: an up-down counter.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Counts rising edges up and down.
    pub Ctud as "CTUD" {
        follows { "CTUD, IEC 61131-3" }
        inputs {
            /// Count up, at a rising edge.
            "CU" => cu: bool = false,
            /// Count down, at a rising edge.
            "CD" => cd: bool = false,
            /// Reset to 0; dominates.
            "R" => r: bool = false,
            /// Load `PV`.
            "LD" => ld: bool = false,
            /// Preset value.
            "PV" => pv: i16 = 0,
        }
        outputs {
            /// `CV` has reached `PV`.
            "QU" => qu: bool,
            /// `CV` is 0 or less.
            "QD" => qd: bool,
            /// Counter value.
            "CV" => cv: i16,
        }
        state {
            /// Counter value.
            cv: i16,
            /// `CU` in the last call.
            last_cu: bool,
            /// `CD` in the last call.
            last_cd: bool,
        }
        computes {
            "`R`: `CV = 0`; otherwise `LD`: `CV = PV`; otherwise a rising edge of `CU` adds 1 and one of `CD` takes 1, from -32768 to 32767.",
            "Edges of both in one call leave `CV` as it is.",
            "`QU = CV >= PV`, `QD = CV <= 0`.",
        }
        decisions {
            Decision {
                silent_on: "a count input that is TRUE in the first call",
                chosen: "an edge, as of R_TRIG",
            },
            Decision {
                silent_on: "edges in calls with `R` or `LD` TRUE",
                chosen: "not counted, and not later either",
            },
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "not seen: an edge lies between two calls, and two edges in between are none",
            },
        }
    }
}

impl Block for Ctud {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let up = inputs.cu && !state.last_cu;
        let down = inputs.cd && !state.last_cd;
        (state.last_cu, state.last_cd) = (inputs.cu, inputs.cd);
        state.cv = match (up, down) {
            _ if inputs.r => 0,
            _ if inputs.ld => inputs.pv,
            (true, false) => state.cv.saturating_add(1),
            (false, true) => state.cv.saturating_sub(1),
            _ => state.cv,
        };
        Outputs { qu: state.cv >= inputs.pv, qd: state.cv <= 0, cv: state.cv }
    }

    /// Ten pieces to count.
    fn typical() -> Inputs {
        Inputs { cu: true, pv: 10, ..Inputs::default() }
    }
}
