//! DifferenceQuotientFB: the derivative of a sampled signal.

use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Differentiates a signal sampled at equal distances, as the slope of the parabola that fits the last five values best.
    pub DifferenceQuotientFB {
        follows { "LGF_DifferenceQuotientFB, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Take values; FALSE forgets them.
            "enable" => enable: bool = false,
            /// Take `value` at a rising edge.
            "insert" => insert: bool = false,
            /// Signal to differentiate.
            "value" => value: f64 = 0.0,
            /// Time between two values.
            "deltaT" => delta_t: f64 ["s"] = 0.0,
            /// Take `value` in every call, at the distance of the task's period; `insert` and `deltaT` are not used.
            "cyclicExecution" => cyclic_execution: bool = false,
        }
        outputs {
            /// Derivative in the middle of the last five values.
            "derivatedValue" => derivated_value: f64 ["1/s"],
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state {
            /// The last values, the newest in front.
            values: [f64; 5],
            count: u16,
            derivative: f64,
            last_insert: bool,
            was_enabled: bool,
            /// The task's period in ns.
            period_ns: u64,
        }
        computes {
            "`derivatedValue = (2 (v0 - v4) + (v1 - v3)) / (10 T)` of the last five values, `v0` being the newest: the slope of the parabola of least squares in the middle, which is what the signal's derivative was two values ago.",
            "`T` is `deltaT`, or with `cyclicExecution` the period of the task.",
        }
        status {
            0x7000 => "STATUS_NO_CALL": "enable is FALSE",
            0x7001 => "STATUS_FIRST_CALL": "first call since enable",
            0x7002 => "STATUS_SUBSEQUENT_CALL": "derivatedValue is that of five values",
            0x7010 => "STATUS_NOT_ENOUGH_VALUES": "fewer than five values were taken; derivatedValue is 0.0",
            status::RANGE => "ERR_DELTA_T": "deltaT is 0.0 or less; derivatedValue holds",
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "the value to take, deltaT or the derivative is NaN or infinite; derivatedValue holds",
        }
        decisions {
            Decision {
                silent_on: "the compensating polynomial",
                chosen: "a parabola of least squares (Savitzky-Golay, five points), which damps noise; the operations \
                         in the order written, each rounded to LREAL",
            },
            Decision {
                silent_on: "values of every cycle",
                chosen: "the input `cyclicExecution`, named as in LGF_FloatingAverage; cycles skipped after an overrun \
                         are not counted",
            },
            Decision {
                silent_on: "values of every cycle that are retained in a task with another period",
                chosen: "they are at another distance and are forgotten, as without `enable`",
            },
            Decision {
                silent_on: "`derivatedValue` while `enable` is FALSE",
                chosen: "0.0, and the values are forgotten",
            },
            Decision {
                silent_on: "a negative `deltaT`",
                chosen: "16#8200 as for 0.0; the value is taken all the same",
            },
            Decision {
                silent_on: "NaN and infinity",
                chosen: "16#8F00 in a call that would take a `value` that is not finite, which is not taken, and while \
                         `deltaT`, where it is used, or the derivative is not finite",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8200 before 16#8F00, and an error before 16#7001",
            },
        }
    }
}

const NO_CALL: u16 = 0x7000;
const FIRST_CALL: u16 = 0x7001;
const SUBSEQUENT_CALL: u16 = 0x7002;
const NOT_ENOUGH_VALUES: u16 = 0x7010;

impl Block for DifferenceQuotientFB {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let is_edge = inputs.insert && !state.last_insert;
        state.last_insert = inputs.insert;
        if state.period_ns != cycle.period_ns() {
            state.period_ns = cycle.period_ns();
            if inputs.cyclic_execution {
                (state.count, state.derivative) = (0, 0.0);
            }
        }
        let status = if inputs.enable {
            let distance_s =
                if inputs.cyclic_execution { cycle.period_s() } else { inputs.delta_t };
            state.differentiate(inputs.cyclic_execution || is_edge, inputs.value, distance_s)
        } else {
            let State { last_insert, period_ns, .. } = *state;
            *state = State { last_insert, period_ns, ..State::default() };
            NO_CALL
        };
        Outputs { derivated_value: state.derivative, error: status::is_error(status), status }
    }

    /// A level in m, of which the speed is wanted.
    fn typical() -> Inputs {
        Inputs { enable: true, value: 1.25, cyclic_execution: true, ..Inputs::default() }
    }
}

impl State {
    #[inline]
    fn differentiate(&mut self, takes: bool, value: f64, distance_s: f64) -> u16 {
        let is_first = !self.was_enabled;
        self.was_enabled = true;
        let is_finite = value.is_finite() || !takes;
        if takes && is_finite {
            let [v0, v1, v2, v3, _] = self.values;
            self.values = [value, v0, v1, v2, v3];
            self.count = (self.count + 1).min(5);
        }
        if distance_s <= 0.0 {
            return status::RANGE;
        }
        if !is_finite || !distance_s.is_finite() {
            return status::NOT_FINITE;
        }
        if self.count == 5 {
            let [v0, v1, _, v3, v4] = self.values;
            let derivative = (2.0 * (v0 - v4) + (v1 - v3)) / (10.0 * distance_s);
            if !derivative.is_finite() {
                return status::NOT_FINITE;
            }
            self.derivative = derivative;
        }
        match (is_first, self.count) {
            (true, _) => FIRST_CALL,
            (false, 5) => SUBSEQUENT_CALL,
            (false, _) => NOT_ENOUGH_VALUES,
        }
    }
}
