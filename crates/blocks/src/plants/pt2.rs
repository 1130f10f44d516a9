//! PlantPT2: a second-order lag, which may oscillate.

use super::{ERRORS, FIRST_CALL, INPUT, Progress, SKIPPED_CYCLES};
use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Simulates a second-order process (PT2): after a step of `u`, `y` moves to `gain * u`, with oscillations if
    /// `damping` is below 1.
    pub PlantPT2 {
        inputs {
            /// Manipulated value.
            "u" => u: f64 = 0.0,
            /// Static gain `K`.
            "gain" => gain: f64 = 1.0,
            /// Time constant `T`, the reciprocal of the natural frequency in rad/s; 0: `y` is `gain * u` at once.
            "timeConstant" => time_constant: f64 ["s"] = 1.0,
            /// Damping ratio `D`; two lags `T1` and `T2` in series: `T = sqrt(T1 * T2)`, `D = (T1 + T2) / (2 * T)`.
            "damping" => damping: f64 = 1.0,
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
            /// Rate of change of `y` per second.
            rate: f64,
            /// Those for `step_ns`, `time_constant` and `damping`: see `transition`.
            transition: [f64; 4],
            time_constant: f64,
            damping: f64,
            step_ns: u64,
            progress: Progress,
        }
        computes {
            "`T^2*y'' + 2*D*T*y' + y = K*u`.",
            "From call to call, `K*u - y` and `y'` are multiplied by the matrix exponential of the process over the time since the last call.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::TIME => "ERR_TIME": "timeConstant or damping is negative",
            status::NOT_FINITE => "ERR_NOT_FINITE": "an input that is read, or what follows from it, is NaN or infinite",
        }
        decisions {
            INPUT,
            FIRST_CALL,
            SKIPPED_CYCLES,
            ERRORS,
            Decision {
                silent_on: "a `y` or a rate that overflows",
                chosen: "16#8F00; `y` holds and goes on from rest",
            },
            Decision {
                silent_on: "the parameters",
                chosen: "time constant and damping ratio, as only they describe a process that oscillates",
            },
            Decision {
                silent_on: "a damping below 1 and a time since the last call above 1e6 time constants",
                chosen: "`y` is `gain * u` at once",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8203 before 16#8F00",
            },
        }
    }
}

impl Block for PlantPT2 {
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
        Inputs { u: 10.0, time_constant: 3600.0, damping: 0.5, ..Inputs::default() }
    }
}

impl State {
    #[inline]
    fn advance(&mut self, inputs: &Inputs, starts: bool, step_ns: u64) -> u16 {
        let (time_constant, damping) = (inputs.time_constant, inputs.damping);
        if time_constant < 0.0 || damping < 0.0 {
            return status::TIME;
        }
        if !time_constant.is_finite() || !damping.is_finite() {
            return status::NOT_FINITE;
        }
        let (y, rate) = if starts {
            if !inputs.initial_value.is_finite() {
                return status::NOT_FINITE;
            }
            (inputs.initial_value, 0.0)
        } else {
            let is_known = step_ns == self.step_ns
                && time_constant == self.time_constant
                && damping == self.damping;
            if !is_known {
                (self.step_ns, self.time_constant, self.damping) =
                    (step_ns, time_constant, damping);
                self.transition = transition(step_ns, time_constant, damping);
            }
            let [rise, rate_to_y, way_to_rate, rate_stays] = self.transition;
            let way = inputs.gain * inputs.u - self.y;
            if !way.is_finite() {
                return status::NOT_FINITE;
            }
            (
                self.y + (rise * way + rate_to_y * self.rate),
                way_to_rate * way + rate_stays * self.rate,
            )
        };
        if !y.is_finite() || !rate.is_finite() {
            // A rate that is beyond all numbers in the next step would be so for ever.
            self.rate = 0.0;
            return status::NOT_FINITE;
        }
        (self.y, self.rate) = (y, rate);
        status::OK
    }
}

/// How the way to go, `K*u - y`, and the rate act over a step: the way and the rate on `y`, then both on the rate.
///
/// In time constants, `t = h/T`, with `s` the answer of the process at rest to an impulse, after `t`:
/// `[1 - (c + D*s), T*s, s/T, c - D*s]`, where `c` is `exp(-D*t)` times `cos` or `cosh`. docs/pid.md derives it.
#[cold]
fn transition(step_ns: u64, time_constant: f64, damping: f64) -> [f64; 4] {
    const SETTLED: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
    if time_constant == 0.0 {
        return SETTLED;
    }
    let t = step_ns as f64 / 1e9 / time_constant;
    let (rise, s, rate_stays) = if damping < 1.0 {
        if t > 1e6 {
            return SETTLED;
        }
        let frequency = libm::sqrt((1.0 - damping) * (1.0 + damping));
        let fall = libm::expm1(-(damping * t));
        let decay = 1.0 + fall;
        let half = libm::sin(0.5 * (frequency * t));
        let s = decay * libm::sin(frequency * t) / frequency;
        let one_less_cos = 2.0 * (half * half);
        // 1 - decay * cos - D * s, without the difference of numbers near 1.
        let rise = decay * one_less_cos - fall - damping * s;
        (rise, s, decay * (1.0 - one_less_cos) - damping * s)
    } else {
        let spread = libm::sqrt((damping - 1.0) * (damping + 1.0));
        let fast = damping + spread;
        let slow = 1.0 / fast;
        let fall = libm::expm1(-(slow * t));
        let decay = 1.0 + fall;
        if decay == 0.0 {
            return SETTLED;
        }
        let s = if spread == 0.0 {
            decay * t
        } else {
            decay * -libm::expm1(-(2.0 * (spread * t))) / (2.0 * spread)
        };
        (-fall - slow * s, s, decay - fast * s)
    };
    [rise, time_constant * s, s / time_constant, rate_stays]
}
