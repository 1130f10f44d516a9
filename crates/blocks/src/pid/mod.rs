//! PID: a controller with two degrees of freedom, after Åström and Hägglund. docs/pid.md derives its formulas.

mod law;
mod limits;
mod parts;
mod step;

use crate::{Decision, status};
use parts::{Parts, Tuning};

crate::block! {
    /// PID controller with two degrees of freedom, limits of its output, anti-windup, and bumpless changes of mode
    /// and parameters.
    pub PID {
        follows { "PID control, Åström and Hägglund: Advanced PID Control (2006)" }
        inputs {
            /// Set-point `r`.
            "setPoint" => set_point: f64 = 0.0,
            /// Measured value `y`. NaN or infinity, a failed sensor: the output holds.
            "processValue" => process_value: f64,
            /// Manual mode; precedes `track`.
            "manual" => manual: bool = false,
            /// Output in manual mode.
            "manualValue" => manual_value: f64 = 0.0,
            /// Tracking mode: the output follows `trackValue`.
            "track" => track: bool = false,
            /// Output in tracking mode.
            "trackValue" => track_value: f64 = 0.0,
            /// In automatic mode, start again: integral and derivative are 0.
            "reset" => reset: bool = false,
            /// Direct action: the output rises when `processValue` does. FALSE: it falls.
            "direct" => direct: bool = false,
            /// Parallel form: `gain`, `integralGain`, `derivativeGain`. FALSE: ISA form: `gain`, `integralTime`, `derivativeTime`.
            "parallel" => parallel: bool = false,
            /// Gain `K`; a negative one reverses the action.
            "gain" => gain: f64 = 1.0,
            /// ISA form: integral time `Ti`; 0 or `inf`: no integral action.
            "integralTime" => integral_time: f64 ["s"] = 0.0,
            /// ISA form: derivative time `Td`; 0: no derivative action.
            "derivativeTime" => derivative_time: f64 ["s"] = 0.0,
            /// Parallel form: integral gain `ki`; 0: no integral action.
            "integralGain" => integral_gain: f64 ["1/s"] = 0.0,
            /// Parallel form: derivative gain `kd`; 0: no derivative action.
            "derivativeGain" => derivative_gain: f64 ["s"] = 0.0,
            /// Largest gain of the derivative as a multiple of `gain`: it is filtered with `Td / N`; `inf`: no filter.
            "N" => n: f64 = 10.0,
            /// Weight of the set-point in the proportional part.
            "b" => b: f64 = 1.0,
            /// Weight of the set-point in the derivative.
            "c" => c: f64 = 0.0,
            /// Tracking time `Tt` of the anti-windup; 0: `sqrt(Ti * Td)`, or `Ti` without derivative; `inf`: no anti-windup.
            "trackingTime" => tracking_time: f64 ["s"] = 0.0,
            /// Low limit of the output.
            "outputMin" => output_min: f64 = 0.0,
            /// High limit of the output.
            "outputMax" => output_max: f64 = 100.0,
            /// Rate at which the output may rise; `inf`: no limit.
            "upRate" => up_rate: f64 ["1/s"] = f64::INFINITY,
            /// Rate at which the output may fall; `inf`: no limit.
            "downRate" => down_rate: f64 ["1/s"] = f64::INFINITY,
        }
        outputs {
            /// Manipulated value `u`.
            "output" => output: f64,
            /// Proportional part `P`.
            "proportionalPart" => proportional_part: f64,
            /// Integral part `I`.
            "integralPart" => integral_part: f64,
            /// Derivative part `D`.
            "derivativePart" => derivative_part: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state {
            /// The last output, and the parts of the control law in the last cycle that computed it.
            output: f64,
            parts: Parts,
            tuning: Tuning,
            /// Change of the integral per second, from the deviation.
            slope: f64,
            /// What limits and rates added to the output.
            excess: f64,
            set_point: f64,
            process_value: f64,
            /// While it is held in manual mode: the value from which `manualValue` must change.
            manual_value: f64,
            holds_manual: bool,
            /// The mode that was asked for in the last call.
            manual: bool,
            track: bool,
            has_run: bool,
            /// The last call computed the control law: the parts can go on from there.
            is_aligned: bool,
            cycle: u64,
        }
        computes {
            "Control law: `P = K*(b*r - y)`; `D` is `K*Td*d(c*r - y)/dt`, filtered with `Td/N`; `I` is the integral of `K/Ti*(r - y) + (u - v)/Tt`; `v = P + I + D`. With `direct`, `K`, `ki` and `kd` change their sign.",
            "`I` moves by `h*K/Ti*(r - y) + min(h/Tt, 1)*(u - v)` with the values of the last call; `D = (Tf*D + K*Td*change of (c*r - y)) / (Tf + h)` with `Tf = Td/N` (backward difference); `h` is the time since the last call.",
            "Automatic: `u` is `v`; manual: `manualValue`; tracking: `trackValue`. In every mode `u` then moves by at most `upRate*h` or `downRate*h`, and stays from `outputMin` to `outputMax`.",
            "In manual and tracking mode, and when a parameter changes, `I` is set so that `v` is what the output is.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error, no limit",
            status::LIMITED_LOW => "WARN_LIMITED_LOW": "output is limited to outputMin",
            status::LIMITED_HIGH => "WARN_LIMITED_HIGH": "output is limited to outputMax",
            status::LIMITED_RATE => "WARN_LIMITED_RATE": "output is limited by upRate or downRate",
            status::RANGE => "ERR_LOW_LIM_OVER_UP_LIM": "outputMin is above outputMax",
            status::NEGATIVE_RATE => "ERR_NEG_RATE": "upRate or downRate is negative",
            status::TIME => "ERR_TIME": "a time is negative, or N is not above 0",
            status::SENSOR => "ERR_PROCESS_VALUE": "processValue is NaN or infinite: the sensor failed",
            status::NOT_FINITE => "ERR_NOT_FINITE":
                "a limit, rate, parameter, setPoint or the active mode's value, or what follows from them, is NaN or must not be infinite",
        }
        decisions {
            Decision {
                silent_on: "the first call",
                chosen: "the mode counts at once; `I` and `D` are 0 in automatic mode; rates count from an output of 0.0",
            },
            Decision {
                silent_on: "a change of mode",
                chosen: "acts from the next cycle on: in its own cycle, the output is that of the mode before",
            },
            Decision {
                silent_on: "from another mode to manual",
                chosen: "the output holds until `manualValue` is another than in the last cycle before `manual`",
            },
            Decision {
                silent_on: "a change of parameters or of the form",
                chosen: "the output of its cycle is that of the parameters before; `I` takes the difference, and keeps it without \
                         integral action, until `reset`. Limits and rates act at once",
            },
            Decision {
                silent_on: "a rate of 0",
                chosen: "the output does not move that way in any mode, with 16#6004 while it would; only a limit moves it",
            },
            Decision {
                silent_on: "`reset` in manual and tracking mode",
                chosen: "no effect: `I` follows the output there, and automatic mode goes on from it",
            },
            Decision {
                silent_on: "a limit beyond which the rates do not let the output come in time",
                chosen: "the limit counts: the output is within valid limits in every cycle and every mode",
            },
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "counted as elapsed time, by integral, derivative and rates",
            },
            Decision {
                silent_on: "the output during an error",
                chosen: "all inputs are checked in every call, those of the form that is not chosen and the values of other modes \
                         aside. The output holds where the active mode needs what is invalid: in every mode limits and rates, \
                         its own value, and in automatic mode parameters, `setPoint` and `processValue`. While it holds, it \
                         still keeps within valid limits",
            },
            Decision {
                silent_on: "the end of an error",
                chosen: "automatic mode goes on from the output that was held: `I` is set so, `D` is 0. Without integral action, `I` is \
                         what it was before the error, and the output moves to `v` as fast as the rates let it",
            },
            Decision {
                silent_on: "windup without integral action",
                chosen: "there is none: `I` does not change",
            },
            Decision {
                silent_on: "the parallel form",
                chosen: "`Ti = K/ki` and `Td = kd/K`, by their magnitudes; with `gain` 0 there is no derivative, as its largest gain is `N*K`",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows the first of 16#8200, 16#8202, 16#8203, 16#8F01, 16#8F00; of limitations, that which acts last: limits act after rates",
            },
        }
    }
}
