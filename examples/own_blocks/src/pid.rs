//! A PI(D) controller. `block!` declares the pins once; from that come the structs `Inputs`, `Outputs`
//! and `State`, the check of a configuration, and the catalogue. What remains to write is `step`.

use isochrone::blocks::{Block, Cycle, status};

isochrone::blocks::block! {
    /// PID controller: `y` drives `x` towards `setpoint`. While `y` is limited, the integral only moves
    /// away from the limit.
    pub(crate) Pid {
        inputs {
            /// Value that is wanted.
            "setpoint" => setpoint: f64 = 0.0,
            /// Value that is measured. Without a default, so it must be connected.
            "x" => x: f64,
            /// Gain; a change moves `y` by the deviation alone, not by the integral.
            "gain" => gain: f64 = 1.0,
            /// Integral time; 0: the integral stays as it is.
            "integralTime" => integral_time: f64 ["s"] = 0.0,
            /// Derivative time.
            "derivativeTime" => derivative_time: f64 ["s"] = 0.0,
            /// Lower limit of `y`.
            "yMin" => y_min: f64 = 0.0,
            /// Upper limit of `y`.
            "yMax" => y_max: f64 = 100.0,
        }
        outputs {
            /// Manipulated value.
            "y" => y: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state { integral: f64, deviation: f64, y: f64, has_run: bool }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::LIMITED_LOW => "STATUS_LIMITED_LOW": "y is limited to yMin",
            status::LIMITED_HIGH => "STATUS_LIMITED_HIGH": "y is limited to yMax",
            status::RANGE => "ERR_RANGE": "yMin is above yMax, or a time is negative; y holds",
            status::NOT_FINITE => "ERR_NOT_FINITE": "setpoint, x, gain or a limit, or what follows from them, is NaN or infinite; y holds",
        }
    }
}

impl Block for Pid {
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let in_range = inputs.y_min <= inputs.y_max
            && inputs.integral_time >= 0.0
            && inputs.derivative_time >= 0.0;
        let status = if in_range {
            state.control(inputs, cycle.period_ns() as f64 / 1e9)
        } else {
            status::RANGE
        };
        Outputs { y: state.y, error: status::is_error(status), status }
    }
}

impl State {
    /// One cycle of the controller, with the configured period, never a measured one.
    fn control(&mut self, inputs: &Inputs, period_s: f64) -> u16 {
        let deviation = inputs.setpoint - inputs.x;
        let before = if self.has_run { self.deviation } else { deviation };
        let derivative = inputs.derivative_time * (deviation - before) / period_s;
        // The integral is kept in the unit of y: a new gain acts on what is integrated from now on.
        let more = match inputs.integral_time {
            0.0 => 0.0,
            time_s => inputs.gain * deviation * period_s / time_s,
        };
        let y = inputs.gain * (deviation + derivative) + self.integral + more;
        if !y.is_finite() {
            return status::NOT_FINITE;
        }
        let (status, drives_further) = if y < inputs.y_min {
            (status::LIMITED_LOW, more < 0.0)
        } else if y > inputs.y_max {
            (status::LIMITED_HIGH, more > 0.0)
        } else {
            (status::OK, false)
        };
        let integral = if drives_further { self.integral } else { self.integral + more };
        let y = y.clamp(inputs.y_min, inputs.y_max);
        // A limit may be infinite, and the integral may overflow though the sum does not.
        if !y.is_finite() || !integral.is_finite() {
            return status::NOT_FINITE;
        }
        (self.has_run, self.deviation, self.integral, self.y) = (true, deviation, integral, y);
        status
    }
}
