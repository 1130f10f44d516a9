//! CTU: an up-counter.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Counts rising edges up.
    pub Ctu as "CTU" {
        follows { "CTU, IEC 61131-3" }
        inputs {
            /// Count up, at a rising edge.
            "CU" => cu: bool = false,
            /// Reset to 0; dominates.
            "R" => r: bool = false,
            /// Preset value.
            "PV" => pv: i16 = 0,
        }
        outputs {
            /// `CV` has reached `PV`.
            "Q" => q: bool,
            /// Counter value.
            "CV" => cv: i16,
        }
        state {
            /// Counter value.
            cv: i16,
            /// `CU` in the last call.
            last: bool,
        }
        computes {
            "`R`: `CV = 0`; otherwise a rising edge of `CU` adds 1 to `CV`, up to 32767.",
            "`Q = CV >= PV`, so a `PV` of 0 or less gives `Q` TRUE at once.",
        }
        decisions {
            Decision {
                silent_on: "a count input that is TRUE in the first call",
                chosen: "an edge, as of R_TRIG",
            },
            Decision {
                silent_on: "edges in calls with `R` TRUE",
                chosen: "not counted, and not later either",
            },
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "not seen: an edge lies between two calls, and two edges in between are none",
            },
        }
    }
}

impl Block for Ctu {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let counts = inputs.cu && !state.last;
        state.last = inputs.cu;
        if inputs.r {
            state.cv = 0;
        } else if counts {
            state.cv = state.cv.saturating_add(1);
        }
        Outputs { q: state.cv >= inputs.pv, cv: state.cv }
    }

    /// Ten pieces to count.
    fn typical() -> Inputs {
        Inputs { cu: true, pv: 10, ..Inputs::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stops_at_the_limit_of_int() {
        let (mut state, mut outputs) = (State::default(), Outputs::default());
        for call in 0..70_000 {
            let inputs = Inputs { cu: call % 2 == 0, pv: i16::MAX, ..Inputs::default() };
            outputs = Ctu::step(&mut state, &inputs, &Cycle::new(call, 1_000_000, &[]));
        }
        assert_eq!(outputs, Outputs { q: true, cv: i16::MAX });
    }
}
