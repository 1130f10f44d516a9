//! PlantPT1: a first-order lag.

use super::{ERRORS, FIRST_CALL, INPUT, Progress, SKIPPED_CYCLES};
use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Simulates a first-order process (PT1): after a step of `u`, `y` moves to `gain * u` with a time constant.
    pub PlantPT1 {
        inputs {
            /// Manipulated value.
            "u" => u: f64 = 0.0,
            /// Static gain `K`.
            "gain" => gain: f64 = 1.0,
            /// Time constant `T`; 0: `y` is `gain * u` at once.
            "timeConstant" => time_constant: f64 ["s"] = 1.0,
            /// Value of `y` at the start.
            #[latched_by = "reset"]
            "initialValue" => initial_value: f64 = 0.0,
            /// Start again at `initialValue`.
            "reset" => reset: bool = false,
        }
        outputs {
            /// Output of the process.
            "y" => y: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state {
            y: f64,
            /// What `y` covers of its way to `gain * u` in `step_ns` at `time_constant`.
            share: f64,
            time_constant: f64,
            step_ns: u64,
            progress: Progress,
        }
        computes {
            "`T*dy/dt + y = K*u`.",
            "`y` moves by `share * (K*u - y)`, with `share = 1 - exp(-h/T)` and the time `h` since the last call.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::TIME => "ERR_TIME": "timeConstant is negative",
            status::NOT_FINITE => "ERR_NOT_FINITE": "an input that is read, or what follows from it, is NaN or infinite",
        }
        decisions {
            INPUT,
            FIRST_CALL,
            SKIPPED_CYCLES,
            ERRORS,
            Decision {
                silent_on: "numbers",
                chosen: "`share` is `-expm1(-h/T)`, found when `T` or `h` changes",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8203 before 16#8F00",
            },
        }
    }
}

impl Block for PlantPT1 {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let mut progress = state.progress;
        let advance = |starts, step_ns| state.advance(inputs, starts, step_ns);
        let status = progress.step(inputs.reset, cycle, advance);
        state.progress = progress;
        Outputs { y: state.y, error: status::is_error(status), status }
    }

    /// On a way that takes hours.
    fn typical() -> Inputs {
        Inputs { u: 10.0, time_constant: 3600.0, ..Inputs::default() }
    }
}

impl State {
    #[inline]
    fn advance(&mut self, inputs: &Inputs, starts: bool, step_ns: u64) -> u16 {
        let time_constant = inputs.time_constant;
        if time_constant < 0.0 {
            return status::TIME;
        }
        if !time_constant.is_finite() {
            return status::NOT_FINITE;
        }
        let y = if starts {
            inputs.initial_value
        } else {
            if step_ns != self.step_ns || time_constant != self.time_constant {
                (self.step_ns, self.time_constant) = (step_ns, time_constant);
                self.share = share(step_ns, time_constant);
            }
            self.y + self.share * (inputs.gain * inputs.u - self.y)
        };
        if !y.is_finite() {
            return status::NOT_FINITE;
        }
        self.y = y;
        status::OK
    }
}

#[cold]
fn share(step_ns: u64, time_constant: f64) -> f64 {
    if time_constant == 0.0 { 1.0 } else { -libm::expm1(-(step_ns as f64 / 1e9 / time_constant)) }
}
