//! Integration: the area under a signal.

use crate::lgf::sum::Sum;
use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Integrates a signal over time by trapezoids.
    pub Integration {
        follows { "LGF_Integration, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Integrate; FALSE: `integral` holds.
            "enable" => enable: bool = false,
            /// Signal to integrate, per second.
            "value" => value: f64 = 0.0,
            /// Set `integral` to 0.0.
            "reset" => reset: bool = false,
        }
        outputs {
            /// Area under the signal.
            "integral" => integral: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
            /// Status of the system's clock in LGF; always 0.
            "subfunctionStatus" => subfunction_status: u16,
        }
        state {
            sum: Sum,
            /// Value at the end of the area so far.
            last: f64,
            /// The cycle after that of `last`; 0: there is none.
            next: u64,
        }
        computes {
            "`integral` grows by `(last / 2 + value / 2) * T`, where `last` is the value of the call before and `T` the time since then in seconds.",
            "The sum keeps what rounding cuts off, so that small areas add up for years.",
        }
        status {
            status::OK => "STATUS_EXECUTION_FINISHED_NO_ERROR": "no error",
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "value, or the area, is NaN or infinite; integral holds",
        }
        decisions {
            Decision {
                silent_on: "the unit of time",
                chosen: "seconds, as in LGF from V5.2 on (before: milliseconds)",
            },
            Decision {
                silent_on: "the time between two calls",
                chosen: "that on the task's grid, in whole nanoseconds, skipped cycles included; there is no clock to \
                         read, so 16#8600 (ERR_READ_SYS_TIME) never comes",
            },
            Decision {
                silent_on: "the first call, and the first one with `enable` again",
                chosen: "adds nothing: the area begins with its `value`, and none is added for the time without `enable`",
            },
            Decision {
                silent_on: "a call with `reset`",
                chosen: "`integral` is 0.0, and with `enable` the area begins with its `value`",
            },
            Decision {
                silent_on: "NaN and infinity",
                chosen: "16#8F00 with `enable` and a `value` or a new area that is not finite; the area goes on with \
                         the next finite `value`, as after `enable`",
            },
        }
    }
}

impl Block for Integration {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        if inputs.reset {
            *state = State::default();
        }
        let status = if inputs.enable {
            state.integrate(inputs.value, cycle)
        } else {
            state.next = 0;
            status::OK
        };
        let integral = state.sum.high;
        Outputs { integral, error: status::is_error(status), status, subfunction_status: 0 }
    }

    /// A flow in m3/s.
    fn typical() -> Inputs {
        Inputs { enable: true, value: 0.02, ..Inputs::default() }
    }
}

impl State {
    #[inline]
    fn integrate(&mut self, value: f64, cycle: &Cycle<'_>) -> u16 {
        let began = core::mem::replace(&mut self.next, 0);
        if !value.is_finite() {
            return status::NOT_FINITE;
        }
        if began != 0 {
            let cycles = cycle.index().saturating_add(1).saturating_sub(began);
            // The period of a call that follows the last one is known in seconds.
            let time_s = if cycles == 1 {
                cycle.period_s()
            } else {
                (u128::from(cycles) * u128::from(cycle.period_ns())) as f64 / 1e9
            };
            let sum = self.sum.plus((0.5 * self.last + 0.5 * value) * time_s);
            if !(sum.high.is_finite() && sum.low.is_finite()) {
                return status::NOT_FINITE;
            }
            self.sum = sum;
        }
        (self.last, self.next) = (value, cycle.index().saturating_add(1));
        status::OK
    }
}
