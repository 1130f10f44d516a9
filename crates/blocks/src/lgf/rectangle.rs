//! RectangleCI: a rectangle.

use crate::lgf::generator::{self, Clock, Place, Settings, generate};
use crate::{Block, Cycle, Decision, Ob, decisions, status};

crate::block! {
    /// Generates a rectangle.
    pub RectangleCI {
        follows { "the name of LGF_RectangleCI and the pins of LGF_SinusCI, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Distance of the crest from `offset`.
            "amplitude" => amplitude: f64 = 1.0,
            /// Axis of the signal.
            "offset" => offset: f64 = 0.0,
            /// Duration of a period.
            "periode" => period: i32 ["ms"] = 1000,
            /// How far the signal is ahead.
            "phaseShift" => phase_shift: f64 ["deg"] = 0.0,
            /// Share of the period at `offset + amplitude`, 0.0 to 100.0.
            "dutyCycle" => duty_cycle: f64 ["%"] = 50.0,
            /// Cyclic-interrupt OB whose period is the time between two calls: its number, or its task's name.
            "callOB" => call_ob: Ob = Ob::Caller,
            /// Start again; `value` is 0.0 meanwhile.
            "reset" => reset: bool = false,
        }
        outputs {
            /// Current value of the signal.
            "value" => value: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
            /// Status of the query of the OB's period.
            #[alias = "subFunctionStatus"]
            "subfunctionStatus" => subfunction_status: u16,
        }
        state {
            clock: Clock,
            value: f64,
        }
        computes {
            "A period begins with `offset + amplitude`, for `dutyCycle` percent of it; the rest is `offset - amplitude`.",
            "The place in the period is a whole number of nanoseconds, so edges do not drift.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::TIME => "ERR_PERIOD" (ours): "periode is 0 or less, or dutyCycle is not from 0 to 100; value holds",
            status::QRY_CINT => "ERR_QRY_CINT": status::QRY_CINT_DOC,
            status::OB_UNAVAILABLE => "ERR_OB_UNAVAILABLE": status::OB_UNAVAILABLE_DOC,
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours): generator::NOT_FINITE_DOC,
        }
        decisions {
            Decision {
                silent_on: "the pins",
                chosen: "those of SinusCI and `dutyCycle`. Siemens' page of this block is not public text; the block follows the page of LGF_SinusCI",
            },
            generator::TIME,
            generator::PERIOD,
            generator::SHIFT,
            generator::RESET,
            generator::ERRORS,
            generator::NOT_FINITE,
            decisions::OB_NUMBERS,
            decisions::SEVERAL_ERRORS_WITH_TIME,
        }
    }
}

impl Block for RectangleCI {
    #[inline(always)]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let settings = Settings {
            amplitude: inputs.amplitude,
            offset: inputs.offset,
            period_ms: inputs.period,
            shift_deg: inputs.phase_shift,
            reset: inputs.reset,
            call_ob: inputs.call_ob,
            duty_cycle: inputs.duty_cycle,
        };
        let is_high = |place: Place| place.share(place.phase_ns) < inputs.duty_cycle / 100.0;
        let shape = |place| if is_high(place) { 1.0 } else { -1.0 };
        let status = generate(&mut state.clock, &mut state.value, &settings, cycle, shape);
        Outputs {
            value: state.value,
            error: status::is_error(status),
            status,
            subfunction_status: status::subfunction(status),
        }
    }

    /// A set point in m that steps every 250 ms.
    fn typical() -> Inputs {
        Inputs { amplitude: 0.25, offset: 1.0, period: 500, ..Inputs::default() }
    }
}
