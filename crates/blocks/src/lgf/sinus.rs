//! SinusCI: a sine.

use crate::lgf::generator::{self, Clock, Place, Settings, generate};
use crate::{Block, Cycle, Decision, Ob, decisions, status};

crate::block! {
    /// Generates a sine.
    pub SinusCI {
        follows { "LGF_SinusCI, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Distance of the crest from `offset`.
            "amplitude" => amplitude: f64 = 1.0,
            /// Axis of the signal.
            "offset" => offset: f64 = 0.0,
            /// Duration of a period.
            "periode" => period: i32 ["ms"] = 1000,
            /// How far the signal is ahead.
            "phaseShift" => phase_shift: f64 ["deg"] = 0.0,
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
            "`t` is the time since the first call or the last `reset`, `P` is `periode`.",
            "`value = offset + amplitude * sin(2 pi * (t / P + phaseShift / 360))`.",
            "The place in the period is a whole number of nanoseconds, and the quarter is taken off before the sine, so `value` is as exact after years as in the first period; a crest, a trough and the axis are met exactly.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::TIME => "ERR_PERIOD" (ours): "periode is 0 or less; value holds",
            status::QRY_CINT => "ERR_QRY_CINT": status::QRY_CINT_DOC,
            status::OB_UNAVAILABLE => "ERR_OB_UNAVAILABLE": status::OB_UNAVAILABLE_DOC,
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours): generator::NOT_FINITE_DOC,
        }
        decisions {
            Decision {
                silent_on: "the types of `amplitude`, `offset`, `phaseShift` and `value`",
                chosen: "LREAL (LGF: REAL)",
            },
            Decision {
                silent_on: "the sine",
                chosen: "that of fdlibm, with the same bits on every machine: at most 1 unit in the last place from the exact one",
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

/// Arguments are from 0 to a quarter of pi, where fdlibm reduces nothing.
#[inline]
fn sine(place: Place) -> f64 {
    let Place { climb_ns, period_ns, .. } = place;
    let quarter = |ns: u64| core::f64::consts::FRAC_PI_2 * place.share(ns);
    place.signed(if 2 * climb_ns <= period_ns {
        libm::sin(quarter(climb_ns))
    } else {
        libm::cos(quarter(period_ns - climb_ns))
    })
}

impl Block for SinusCI {
    #[inline(always)]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let settings = Settings {
            amplitude: inputs.amplitude,
            offset: inputs.offset,
            period_ms: inputs.period,
            shift_deg: inputs.phase_shift,
            reset: inputs.reset,
            call_ob: inputs.call_ob,
            duty_cycle: 50.0,
        };
        let status = generate(&mut state.clock, &mut state.value, &settings, cycle, sine);
        Outputs {
            value: state.value,
            error: status::is_error(status),
            status,
            subfunction_status: status::subfunction(status),
        }
    }

    /// A level in m that breathes by a few cm in 10 s.
    fn typical() -> Inputs {
        Inputs {
            amplitude: 0.05,
            offset: 1.2,
            period: 10_000,
            phase_shift: 30.0,
            ..Inputs::default()
        }
    }
}
