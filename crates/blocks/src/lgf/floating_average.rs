//! FloatingAverage: the mean of the last values.

use crate::lgf::sum::{MAX_COUNT, Sum};
use crate::{Block, Cycle, Decision, status};

/// Longest window.
const CAPACITY: usize = 100;
const _: () = assert!(CAPACITY <= MAX_COUNT as usize);
/// Beyond it, the sum of a window could overflow.
const LARGEST: f64 = f64::MAX / 128.0;

crate::block! {
    /// Computes the moving average of the last values, read in every cycle or at a trigger.
    pub FloatingAverage {
        follows { "LGF_FloatingAverage, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Read `value` in every call; `trigger` is not used.
            "cyclicExecution" => cyclic_execution: bool = false,
            /// Read `value` at a rising edge.
            "trigger" => trigger: bool = false,
            /// Signal to average.
            "value" => value: f64 = 0.0,
            /// Number of values to average, 1 to 100.
            "windowSize" => window_size: i16 = 100,
            /// Forget all values.
            "reset" => reset: bool = false,
        }
        outputs {
            /// Mean of the values in the window.
            "average" => average: f64,
            /// As many values were read as the window holds.
            "windowSizeReached" => window_size_reached: bool,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state {
            /// Sum of the values in the window.
            sum: Sum,
            /// Sum of the values since the window last began anew.
            fresh: Sum,
            average: f64,
            window: i16,
            count: u16,
            /// Where the next value goes.
            place: u16,
            last_trigger: bool,
        }
        buffer { CAPACITY }
        computes {
            "`average` is the sum of the last `windowSize` values, or of those that there are, divided by their number.",
            "The sum keeps what rounding cuts off, and is formed anew once in a window. So nothing accumulates, an average of equal values is that value, and a value leaves no trace for longer than a window after it.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::RANGE => "ERR_WRONG_WINDOW_SIZE": "windowSize is not from 1 to 100; average holds",
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "value is NaN, infinite or beyond 1.4e306, so that a sum could be; it is not read, and average holds",
        }
        decisions {
            Decision {
                silent_on: "`average` before the first value and during `reset`",
                chosen: "0.0, with a wrong `windowSize` too; no value is read during `reset`",
            },
            Decision {
                silent_on: "a change of `windowSize`",
                chosen: "all values are forgotten; `average` holds until the next one is read",
            },
            Decision {
                silent_on: "the order of the operations",
                chosen: "each value is added and the one that leaves subtracted, in a sum of two LREALs \
                         (Knuth's TwoSum), whose second one takes what both round away; when the window \
                         has been filled once more, the sum of just its values, \
                         in the order in which they came, takes the place of that sum",
            },
            Decision {
                silent_on: "a wrong `windowSize`",
                chosen: "no value is read, `average` holds and `windowSizeReached` is FALSE; the values are kept",
            },
            Decision {
                silent_on: "NaN and infinity",
                chosen: "16#8F00 in a call that would read a `value` that is not finite or is beyond 1.4e306",
            },
            Decision {
                silent_on: "`trigger` that is TRUE in the first call",
                chosen: "a rising edge",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8200 before 16#8F00",
            },
        }
    }
}

impl Block for FloatingAverage {
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        Self::step_buffered(state, &mut [], inputs, cycle)
    }

    // `step` calls it, too, and the compiler makes a call of what stands in two places: 50 instructions more.
    #[inline(always)]
    fn step_buffered(
        state: &mut State,
        buffer: &mut [u64],
        inputs: &Inputs,
        _: &Cycle<'_>,
    ) -> Outputs {
        let is_edge = inputs.trigger && !state.last_trigger;
        state.last_trigger = inputs.trigger;
        let window = usize::from(inputs.window_size.max(0).unsigned_abs());
        let is_window = (1..=buffer.len()).contains(&window);
        let status = if !is_window {
            status::RANGE
        } else if inputs.reset {
            status::OK
        } else {
            state.resize(inputs.window_size);
            match (inputs.cyclic_execution || is_edge, inputs.value.abs() <= LARGEST) {
                (false, _) => status::OK,
                (true, false) => status::NOT_FINITE,
                (true, true) => {
                    state.read(buffer, window, inputs.value);
                    status::OK
                }
            }
        };
        if inputs.reset {
            *state = State {
                window: state.window,
                last_trigger: state.last_trigger,
                ..State::default()
            };
        }
        let error = status::is_error(status);
        let window_size_reached = !error && usize::from(state.count) == window;
        Outputs { average: state.average, window_size_reached, error, status }
    }

    /// The level of a tank in m, averaged over 20 cycles.
    fn typical() -> Inputs {
        Inputs { cyclic_execution: true, value: 1.234, window_size: 20, ..Inputs::default() }
    }
}

impl State {
    /// Forgets the values if the window is another.
    #[inline]
    fn resize(&mut self, window: i16) {
        if window != self.window {
            let Self { average, last_trigger, .. } = *self;
            *self = Self { window, average, last_trigger, ..Self::default() };
        }
    }

    #[inline]
    fn read(&mut self, buffer: &mut [u64], window: usize, value: f64) {
        let Some(slot) = buffer.get_mut(usize::from(self.place)) else { return };
        let oldest = core::mem::replace(slot, value.to_bits());
        let is_full = usize::from(self.count) == window;
        let leaving = if is_full { f64::from_bits(oldest) } else { 0.0 };
        self.count += u16::from(!is_full);
        self.sum = self.sum.shifted(value, leaving);
        self.fresh = self.fresh.plus(value);
        self.place += 1;
        if usize::from(self.place) >= window {
            (self.place, self.sum, self.fresh) = (0, self.fresh, Sum::default());
        }
        self.average = self.sum.divided_by(self.count);
    }
}
