//! TOF: an off-delay.

use super::timer::Time;
use crate::{Block, Cycle};

crate::block! {
    /// Switches off after a time: `Q` follows a FALSE `IN` after `PT`.
    pub Tof as "TOF" {
        follows { "TOF, IEC 61131-3" }
        inputs {
            /// Signal to delay.
            "IN" => in_: bool = false,
            /// Preset time.
            "PT" => pt: i32 ["ms"] = 0,
        }
        outputs {
            /// `IN` is TRUE, or was within `PT`.
            "Q" => q: bool,
            /// Elapsed time, at most `PT`.
            "ET" => et: i32 ["ms"],
        }
        state {
            time: Time,
            /// The time has begun.
            is_running: bool,
            /// `IN` has been TRUE.
            was_on: bool,
        }
        computes {
            "`IN` TRUE: `Q` is TRUE and `ET` 0.",
            "`IN` that falls starts the time; `ET` is 0 in that call.",
            "`Q` is FALSE as soon as `PT` has elapsed, and `ET` then stays at `PT`.",
            "Before `IN` was TRUE for the first time, `Q` is FALSE and `ET` 0.",
        }
        decisions {
            super::timer::TIME_BASE,
            super::timer::SKIPPED_CYCLES,
            super::timer::NEGATIVE_PT,
            super::timer::CHANGED_PT,
        }
    }
}

impl Block for Tof {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        if inputs.in_ || !state.was_on {
            *state = State { was_on: inputs.in_, ..State::default() };
            return Outputs { q: inputs.in_, et: 0 };
        }
        if !state.is_running {
            (state.time, state.is_running) = (Time::from(cycle), true);
        }
        let (is_over, et) = state.time.pass(inputs.pt, cycle);
        Outputs { q: !is_over, et }
    }

    /// A signal that is TRUE.
    fn typical() -> Inputs {
        Inputs { in_: true, pt: 2_000 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs(state: &mut State, in_: bool, pt: i32, index: u64) -> (bool, i32) {
        let outputs = Tof::step(state, &Inputs { in_, pt }, &Cycle::new(index, 10_000_000, &[]));
        (outputs.q, outputs.et)
    }

    #[test]
    fn a_signal_that_never_was_on_is_not_delayed() {
        assert_eq!(outputs(&mut State::default(), false, 2_000, 0), (false, 0));
    }

    #[test]
    fn a_longer_time_does_not_switch_on_again() {
        let mut state = State::default();
        assert_eq!(outputs(&mut state, true, 100, 0), (true, 0));
        assert_eq!(outputs(&mut state, false, 100, 1), (true, 0));
        assert_eq!(outputs(&mut state, false, 100, 11), (false, 100));
        assert_eq!(outputs(&mut state, false, 900, 12), (false, 900));
    }
}
