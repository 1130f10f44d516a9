//! TON: an on-delay.

use super::timer::Time;
use crate::{Block, Cycle};

crate::block! {
    /// Switches on after a time: `Q` follows a TRUE `IN` after `PT`.
    pub Ton as "TON" {
        follows { "TON, IEC 61131-3" }
        inputs {
            /// Signal to delay.
            "IN" => in_: bool = false,
            /// Preset time.
            "PT" => pt: i32 ["ms"] = 0,
        }
        outputs {
            /// `IN` has been TRUE for `PT`.
            "Q" => q: bool,
            /// Elapsed time, at most `PT`.
            "ET" => et: i32 ["ms"],
        }
        state {
            time: Time,
            /// The time has begun.
            is_running: bool,
        }
        computes {
            "`IN` TRUE starts the time, in the first call too; `ET` is 0 in that call.",
            "`Q` is TRUE as soon as `PT` has elapsed, and `ET` then stays at `PT`.",
            "`IN` FALSE: `Q` is FALSE and `ET` 0.",
        }
        decisions {
            super::timer::TIME_BASE,
            super::timer::SKIPPED_CYCLES,
            super::timer::NEGATIVE_PT,
            super::timer::CHANGED_PT,
        }
    }
}

impl Block for Ton {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        if !inputs.in_ {
            *state = State::default();
            return Outputs { q: false, et: 0 };
        }
        if !state.is_running {
            *state = State { time: Time::from(cycle), is_running: true };
        }
        let (is_over, et) = state.time.pass(inputs.pt, cycle);
        Outputs { q: is_over, et }
    }

    /// A time that runs for hours.
    fn typical() -> Inputs {
        Inputs { in_: true, pt: i32::MAX }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs(state: &mut State, in_: bool, pt: i32, index: u64) -> (bool, i32) {
        let outputs = Ton::step(state, &Inputs { in_, pt }, &Cycle::new(index, 10_000_000, &[]));
        (outputs.q, outputs.et)
    }

    #[test]
    fn it_is_exact_after_a_trillion_cycles() {
        let (mut state, start) = (State::default(), 1_000_000_000_000);
        assert_eq!(outputs(&mut state, true, 2_000, start), (false, 0));
        assert_eq!(outputs(&mut state, true, 2_000, start + 199), (false, 1_990));
        assert_eq!(outputs(&mut state, true, 2_000, start + 200), (true, 2_000));
    }

    #[test]
    fn a_longer_time_does_not_take_back_an_output_and_a_shorter_one_acts_at_once() {
        let mut state = State::default();
        assert_eq!(outputs(&mut state, true, 1_000, 0), (false, 0));
        assert_eq!(outputs(&mut state, true, 500, 60), (true, 500));
        assert_eq!(outputs(&mut state, true, 5_000, 61), (true, 5_000));
    }

    #[test]
    fn a_negative_time_is_over_at_once() {
        assert_eq!(outputs(&mut State::default(), true, i32::MIN, 0), (true, 0));
    }
}
