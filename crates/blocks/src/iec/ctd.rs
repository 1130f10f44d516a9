//! CTD: a down-counter.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Counts rising edges down.
    pub Ctd as "CTD" {
        follows { "CTD, IEC 61131-3" }
        inputs {
            /// Count down, at a rising edge.
            "CD" => cd: bool = false,
            /// Load `PV`; dominates.
            "LD" => ld: bool = false,
            /// Preset value.
            "PV" => pv: i16 = 0,
        }
        outputs {
            /// `CV` is 0 or less.
            "Q" => q: bool,
            /// Counter value.
            "CV" => cv: i16,
        }
        state {
            /// Counter value.
            cv: i16,
            /// `CD` in the last call.
            last: bool,
        }
        computes {
            "`LD`: `CV = PV`; otherwise a rising edge of `CD` takes 1 from `CV`, down to -32768.",
            "`Q = CV <= 0`, so `Q` is TRUE until a value is loaded.",
        }
        decisions {
            Decision {
                silent_on: "a count input that is TRUE in the first call",
                chosen: "an edge, as of R_TRIG",
            },
            Decision {
                silent_on: "edges in calls with `LD` TRUE",
                chosen: "not counted, and not later either",
            },
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "not seen: an edge lies between two calls, and two edges in between are none",
            },
        }
    }
}

impl Block for Ctd {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let counts = inputs.cd && !state.last;
        state.last = inputs.cd;
        if inputs.ld {
            state.cv = inputs.pv;
        } else if counts {
            state.cv = state.cv.saturating_sub(1);
        }
        Outputs { q: state.cv <= 0, cv: state.cv }
    }

    /// Ten pieces to count.
    fn typical() -> Inputs {
        Inputs { ld: true, pv: 10, ..Inputs::default() }
    }
}
