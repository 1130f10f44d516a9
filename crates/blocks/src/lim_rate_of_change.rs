//! LimRateOfChangeCI: a step at the input becomes a ramp at the output.

use crate::{Block, Cycle, Ob, decisions, status};

crate::block! {
    /// Limits the rate of change of a signal: a step becomes a ramp.
    pub LimRateOfChangeCI {
        follows { "LGF_LimRateOfChangeCI, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Signal to follow.
            "value" => value: f64 = 0.0,
            /// Rate of change of the ramp, up and down.
            "setChangeRate" => set_change_rate: f64 ["1/s"] = 0.0,
            /// Value to preset the output with.
            "defaultOutValue" => default_out_value: f64 = 0.0,
            /// Preset the output with `defaultOutValue`.
            "enDefaultOutValue" => en_default_out_value: bool = false,
            /// Cyclic-interrupt OB whose period is the sample time: its number, or its task's name.
            "callOB" => call_ob: Ob = Ob::Caller,
        }
        outputs {
            /// Signal with limited rate of change.
            "delayedValue" => delayed_value: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
            /// Status of the query of the OB's period.
            #[alias = "subFunctionStatus"]
            "subfunctionStatus" => subfunction_status: u16,
        }
        state { y: f64 }
        computes {
            "`T` is the period, in seconds, of the task at `callOB`.",
            "With `enDefaultOutValue`: `delayedValue = defaultOutValue`.",
            "Otherwise `delayedValue` moves toward `value` by at most `setChangeRate * T` and lands on it exactly.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::RANGE => "ERR_NEG_RATE_LIM": "setChangeRate is negative",
            status::QRY_CINT => "ERR_QRY_CINT": status::QRY_CINT_DOC,
            status::OB_UNAVAILABLE => "ERR_OB_UNAVAILABLE": status::OB_UNAVAILABLE_DOC,
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "setChangeRate is NaN, or the active mode's signal is NaN or infinite",
        }
        decisions {
            decisions::FIRST_CALL,
            decisions::SAMPLE_TIME,
            decisions::SKIPPED_CYCLES,
            decisions::OB_NUMBERS,
            decisions::HOLD,
            decisions::NOT_FINITE,
            decisions::SEVERAL_ERRORS,
        }
    }
}

impl Block for LimRateOfChangeCI {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let sample_time_s = cycle.sample_time_s(inputs.call_ob);
        let rate = inputs.set_change_rate;
        let preset = inputs.en_default_out_value;
        let signal = if preset { inputs.default_out_value } else { inputs.value };
        let status = status::first(
            sample_time_s,
            [
                (rate < 0.0, status::RANGE),
                (rate.is_nan(), status::NOT_FINITE),
                (!signal.is_finite(), status::NOT_FINITE),
            ],
        );
        if preset {
            if signal.is_finite() {
                state.y = signal;
            }
        } else if let (Ok(sample_time_s), status::OK) = (sample_time_s, status) {
            state.y = toward(state.y, signal, rate * sample_time_s);
        }
        Outputs {
            delayed_value: state.y,
            error: status::is_error(status),
            status,
            subfunction_status: status::subfunction(status),
        }
    }

    /// On a way that takes three thousand years.
    fn typical() -> Inputs {
        Inputs { value: 1e12, set_change_rate: 10.0, ..Inputs::default() }
    }
}

/// `y` moved toward `target` by at most `step`, landing on it exactly.
#[inline]
pub(crate) fn toward(y: f64, target: f64, step: f64) -> f64 {
    let (up, down) = (y + step, y - step);
    if target > y {
        if up < target { up } else { target }
    } else if down > target {
        down
    } else {
        target
    }
}
