//! Hysteresis: a comparator with two thresholds.

use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Compares a signal with two thresholds: on at the high one, off at the low one, and as before in between.
    pub Hysteresis {
        inputs {
            /// Signal to compare.
            "value" => value: f64 = 0.0,
            /// From here on up, `output` is TRUE.
            "setHighLim" => set_high_lim: f64 = 0.0,
            /// From here on down, `output` is FALSE.
            "setLowLim" => set_low_lim: f64 = 0.0,
        }
        outputs {
            /// Whether the signal was last at the high threshold.
            "output" => output: bool,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state { output: bool }
        computes {
            "`output` becomes TRUE at `value >= setHighLim` and FALSE at `value <= setLowLim`; in between, it stays.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::RANGE => "ERR_LOW_LIM_OVER_UP_LIM": "setLowLim is greater than setHighLim; output holds",
            status::NOT_FINITE => "ERR_NOT_FINITE":
                "value is NaN or infinite, a threshold is NaN, setHighLim -inf or setLowLim +inf; output holds",
        }
        decisions {
            Decision { silent_on: "the first call between the thresholds", chosen: "FALSE" },
            Decision {
                silent_on: "equal thresholds",
                chosen: "`value >= setHighLim`, without hysteresis",
            },
            Decision {
                silent_on: "infinite thresholds",
                chosen: "`inf` at `setHighLim` and `-inf` at `setLowLim` are valid and are never reached",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8200 before 16#8F00",
            },
        }
    }
}

impl Block for Hysteresis {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let &Inputs { value, set_high_lim: high, set_low_lim: low } = inputs;
        let is_valid = value.is_finite() && high > f64::NEG_INFINITY && low < f64::INFINITY;
        let status = if low > high {
            status::RANGE
        } else if is_valid {
            status::OK
        } else {
            status::NOT_FINITE
        };
        if status == status::OK {
            state.output = value >= high || (state.output && value > low);
        }
        Outputs { output: state.output, error: status::is_error(status), status }
    }

    /// A level in m between the thresholds of a pump.
    fn typical() -> Inputs {
        Inputs { value: 1.2, set_high_lim: 1.6, set_low_lim: 0.8 }
    }
}
