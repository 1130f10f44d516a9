//! PlantIntegrator: an integrating process with limits, such as a tank.

use super::{ERRORS, FIRST_CALL, INPUT, Progress, SKIPPED_CYCLES};
use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Simulates an integrating process with limits, such as the level of a tank that can run empty and overflow.
    pub PlantIntegrator {
        inputs {
            /// What comes in: for a tank, the inflow.
            "u" => u: f64 = 0.0,
            /// What goes out: for a tank, the outflow.
            "load" => load: f64 = 0.0,
            /// Rate of `y` for a difference of 1; for a tank, the reciprocal of its area.
            "gain" => gain: f64 ["1/s"] = 1.0,
            /// Low limit of `y`.
            "yMin" => y_min: f64 = f64::NEG_INFINITY,
            /// High limit of `y`.
            "yMax" => y_max: f64 = f64::INFINITY,
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
            /// What roundings took from `y` so far.
            lost: f64,
            progress: Progress,
        }
        computes {
            "`dy/dt = gain * (u - load)`, as long as `y` is within its limits.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::LIMITED_LOW => "WARN_Y_LIMITED_TO_YMIN": "y is limited to yMin",
            status::LIMITED_HIGH => "WARN_Y_LIMITED_TO_YMAX": "y is limited to yMax",
            status::RANGE => "ERR_LOW_LIM_OVER_UP_LIM": "yMin is above yMax",
            status::NOT_FINITE => "ERR_NOT_FINITE":
                "an input that is read, or what follows from it, is NaN or infinite, infinite limits of no effect aside",
        }
        decisions {
            INPUT,
            FIRST_CALL,
            SKIPPED_CYCLES,
            ERRORS,
            Decision {
                silent_on: "small steps of a large value",
                chosen: "what rounding takes from `y` is kept and added in the next call (Kahan's sum)",
            },
            Decision {
                silent_on: "an `initialValue` beyond a limit",
                chosen: "limited",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8200 before 16#8F00",
            },
        }
    }
}

impl Block for PlantIntegrator {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let mut progress = state.progress;
        let advance = |starts, step_ns| state.advance(inputs, starts, step_ns);
        let status = progress.step(inputs.reset, cycle, advance);
        state.progress = progress;
        Outputs { y: state.y, error: status::is_error(status), status }
    }

    /// A tank that fills for years.
    fn typical() -> Inputs {
        Inputs { u: 2.0, load: 1.0, gain: 1e-9, y_min: 0.0, y_max: 2.0, ..Inputs::default() }
    }
}

impl State {
    #[inline]
    fn advance(&mut self, inputs: &Inputs, starts: bool, step_ns: u64) -> u16 {
        let limits = status::of_limits(inputs.y_min, inputs.y_max);
        if limits != status::OK {
            return limits;
        }
        let (y, lost) = if starts {
            (inputs.initial_value, 0.0)
        } else {
            let rise = inputs.gain * (inputs.u - inputs.load) * (step_ns as f64 / 1e9);
            let rise = rise + self.lost;
            let y = self.y + rise;
            (y, rise - (y - self.y))
        };
        if !y.is_finite() || !lost.is_finite() {
            return status::NOT_FINITE;
        }
        let (y, lost, status) = if y > inputs.y_max {
            (inputs.y_max, 0.0, status::LIMITED_HIGH)
        } else if y < inputs.y_min {
            (inputs.y_min, 0.0, status::LIMITED_LOW)
        } else {
            (y, lost, status::OK)
        };
        (self.y, self.lost) = (y, lost);
        status
    }
}
