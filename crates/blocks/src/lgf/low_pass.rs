//! LowPassCI: a low-pass filter of the first order (PT1).

use crate::{Block, Cycle, Decision, Ob, decisions, status};

crate::block! {
    /// Smooths a signal with a low-pass filter of the first order (PT1).
    pub LowPassCI {
        inputs {
            /// Signal to smooth.
            "value" => value: f64 = 0.0,
            /// Time after which 63 % of a step have passed; 0.0: no smoothing.
            "timeConstant" => time_constant: f64 ["s"] = 0.0,
            /// Value to preset the output with.
            "defaultOutValue" => default_out_value: f64 = 0.0,
            /// Preset the output with `defaultOutValue`.
            "enDefaultOutValue" => en_default_out_value: bool = false,
            /// Cyclic-interrupt OB whose period is the sample time: its number, or its task's name.
            "callOB" => call_ob: Ob = Ob::Caller,
        }
        outputs {
            /// Smoothed signal.
            "filteredValue" => filtered_value: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
            /// Status of the query of the OB's period.
            #[alias = "subFunctionStatus"]
            "subfunctionStatus" => subfunction_status: u16,
        }
        state {
            y: f64,
            /// What the factor was found for.
            time_constant: f64,
            period_s: f64,
            /// Share of the distance that a call covers.
            factor: f64,
            has_value: bool,
        }
        computes {
            "`T` is the period, in seconds, of the task at `callOB`.",
            "`y = y + (1 - exp(-T / timeConstant)) * (value - y)`: exact for a signal that holds between two calls (zero-order hold), for any `T`, so a step of 1 is at `1 - exp(-k T / timeConstant)` after `k` calls. Where `exp` is below half a unit in the last place of 1, `y = value`.",
            "`1 - exp(...)` is `-expm1(...)`, which keeps its digits where `T` is a small part of `timeConstant`.",
            "The factor is found once and kept until `timeConstant` or `T` changes.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::TIME => "ERR_NEG_TIME_CONSTANT": "timeConstant is negative",
            status::QRY_CINT => "ERR_QRY_CINT": status::QRY_CINT_DOC,
            status::OB_UNAVAILABLE => "ERR_OB_UNAVAILABLE": status::OB_UNAVAILABLE_DOC,
            status::NOT_FINITE => "ERR_NOT_FINITE":
                "timeConstant, or the active mode's signal, is NaN or infinite, or their distance is",
        }
        decisions {
            Decision {
                silent_on: "the first call",
                chosen: "the output starts at `value` or at `defaultOutValue`, so that a filter has no transient of its own",
            },
            Decision {
                silent_on: "`expm1`",
                chosen: "that of fdlibm, with the same bits on every machine",
            },
            Decision {
                silent_on: "a call that follows another task's period",
                chosen: "`callOB` tells the sample time as for LimRateOfChangeCI, never a measured one",
            },
            decisions::SKIPPED_CYCLES,
            decisions::OB_NUMBERS,
            decisions::HOLD,
            Decision {
                silent_on: "NaN and infinity",
                chosen: "16#8F00 for a `timeConstant` that is not finite, in every mode; for a signal that is not, in \
                         the mode that uses it; and where `value` is too far from the output for LREAL",
            },
            decisions::SEVERAL_ERRORS_WITH_TIME,
        }
    }
}

impl Block for LowPassCI {
    #[inline(always)]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let period_s = cycle.sample_time_s(inputs.call_ob);
        let &Inputs { time_constant, en_default_out_value: is_preset, .. } = inputs;
        let used = if is_preset { inputs.default_out_value } else { inputs.value };
        let next = match period_s {
            _ if is_preset => used,
            Ok(period_s) if time_constant.is_finite() && time_constant >= 0.0 => {
                state.filtered(used, time_constant, period_s)
            }
            _ => state.y,
        };
        let is_finite = time_constant.is_finite() && used.is_finite() && next.is_finite();
        let status = status::first(
            period_s,
            [
                (time_constant < 0.0, status::TIME),
                (!is_finite, status::NOT_FINITE),
                (false, status::OK),
            ],
        );
        let is_settled = status == status::OK || is_preset;
        if is_settled && next.is_finite() {
            (state.y, state.has_value) = (next, true);
        }
        Outputs {
            filtered_value: state.y,
            error: status::is_error(status),
            status,
            subfunction_status: status::subfunction(status),
        }
    }

    /// A noisy level in m.
    fn typical() -> Inputs {
        Inputs { value: 1.25, time_constant: 2.0, ..Inputs::default() }
    }
}

impl State {
    /// The output after a period with this value.
    #[inline]
    fn filtered(&mut self, value: f64, time_constant: f64, period_s: f64) -> f64 {
        if !self.has_value {
            return value;
        }
        // A time constant of -0.0 is one of 0.0.
        let time_constant = time_constant.abs();
        if (time_constant, period_s) != (self.time_constant, self.period_s) {
            (self.time_constant, self.period_s) = (time_constant, period_s);
            self.factor = -libm::expm1(-period_s / time_constant);
        }
        // A sum of the output and the whole distance would not be `value` to the last bit.
        if self.factor < 1.0 { self.y + self.factor * (value - self.y) } else { value }
    }
}
