//! SawTooth: a staircase that starts again, or goes on for ever.

use crate::{Block, Cycle, Decision};

crate::block! {
    /// Generates a stepped sawtooth: adds `incrementRange` after each `timeRange` and starts again
    /// after `numberSteps` steps.
    pub SawTooth {
        follows { "LGF_SawTooth, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Initial value of the signal.
            #[latched_by = "reset"]
            "startValue" => start_value: i16 = 0,
            /// Time between two increments; 0 or less: every cycle.
            #[latched_by = "reset"]
            "timeRange" => time_range: i32 ["ms"] = 0,
            /// Size of a step.
            #[latched_by = "reset"]
            "incrementRange" => increment_range: i16 = 0,
            /// Number of steps of one sawtooth, which lasts `timeRange * (numberSteps + 1)`.
            #[latched_by = "reset"]
            "numberSteps" => number_steps: i16 = 0,
            /// Never start again; the value wraps from 32767 to -32768.
            #[latched_by = "reset"]
            "endlessSteps" => endless_steps: bool = false,
            /// Start again at `startValue` and latch the other inputs.
            "reset" => reset: bool = false,
        }
        outputs {
            /// Current value of the signal.
            "value" => value: i16,
        }
        state {
            /// Cycle at which the signal's time was 0, modulo 2^64: that at which the inputs were taken over, unless the task
            /// had another period since.
            origin: u64,
            /// Duration of a step in ns; 0: one cycle.
            step_ns: u64,
            start_value: i16,
            increment: i16,
            /// Number of different values of a sawtooth; 0: endless.
            levels: u64,
            /// The present value.
            value: i16,
            /// Cycle from which the value is another; 0: the inputs were never taken over.
            until: u64,
        }
        computes {
            "`k` is the number of whole `timeRange` intervals since the inputs were latched.",
            "`value = startValue + k * incrementRange`; without `endlessSteps`, `k` starts again from 0 after `numberSteps`.",
        }
        decisions {
            Decision {
                silent_on: "when the inputs are latched",
                chosen: "in the first call and in every call with `reset` TRUE, including \
                         `endlessSteps`; the time is then 0, so `value` is `startValue`",
            },
            Decision {
                silent_on: "the time base",
                chosen: "the task's grid, cycles times period in whole nanoseconds, so nothing drifts",
            },
            Decision {
                silent_on: "cycles skipped after an overrun",
                chosen: "counted as elapsed time",
            },
            Decision {
                silent_on: "a retained signal in a task with another period",
                chosen: "it goes on where it stood: the time that passed is kept, in whole periods of the task, and the cycles from there on are those of the new period",
            },
            Decision {
                silent_on: "a `timeRange` shorter than the period",
                chosen: "a call adds one increment for each interval that has ended since the last call",
            },
            Decision {
                silent_on: "a `timeRange` of 0 or less",
                chosen: "one increment in every cycle",
            },
            Decision {
                silent_on: "a negative `numberSteps`",
                chosen: "treated as 0: `value` stays at `startValue`",
            },
            Decision {
                silent_on: "the value behind 32767",
                chosen: "that of INT arithmetic: the excess is kept, so 32760 + 10 is -32766, not -32768",
            },
            Decision {
                silent_on: "a finite sawtooth that leaves the range of INT",
                chosen: "it wraps from 32767 to -32768 and back, like an endless one",
            },
        }
    }
}

const NS_PER_MS: u64 = 1_000_000;

impl Block for SawTooth {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        // Values last for many cycles, and the divisions that find the next one cost more than all
        // the rest. A new state is due at once.
        if cycle.index() >= state.until || inputs.reset {
            if inputs.reset || state.until == 0 {
                state.take_over(inputs, cycle.index());
            }
            state.find_value(cycle);
        }
        Outputs { value: state.value }
    }

    fn change_period(state: &mut State, cycle: u64, [old_ns, new_ns]: [u64; 2]) {
        // Without a duration of a step, the signal is made of cycles.
        if state.step_ns > 0 && state.until > 0 {
            let passed_ns = cycle.wrapping_sub(state.origin).saturating_mul(old_ns);
            state.origin = cycle.wrapping_sub(passed_ns / new_ns.max(1));
            // The next value is due at once.
            state.until = 1;
        }
    }

    /// The range of an analogue input in ten steps of 10 ms.
    fn typical() -> Inputs {
        Inputs { time_range: 10, increment_range: 2_764, number_steps: 10, ..Inputs::default() }
    }
}

impl State {
    fn take_over(&mut self, inputs: &Inputs, cycle: u64) {
        *self = Self {
            origin: cycle,
            step_ns: u64::from(inputs.time_range.max(0).unsigned_abs()) * NS_PER_MS,
            start_value: inputs.start_value,
            increment: inputs.increment_range,
            levels: if inputs.endless_steps {
                0
            } else {
                u64::from(inputs.number_steps.max(0).unsigned_abs()) + 1
            },
            ..Self::default()
        };
    }

    /// Finds the value of a cycle and how long it lasts. Exact integers throughout: time is the
    /// task's grid, so nothing drifts.
    #[inline]
    fn find_value(&mut self, cycle: &Cycle<'_>) {
        let (cycles, period_ns) = (cycle.index().wrapping_sub(self.origin), cycle.period_ns());
        let (level, end) = match (self.step_ns, cycles.checked_mul(period_ns)) {
            (0, _) => (self.level(cycles), cycles.saturating_add(1)),
            (step_ns, Some(elapsed_ns)) => {
                let steps = elapsed_ns / step_ns;
                let end_ns = (steps + 1).saturating_mul(step_ns);
                (self.level(steps), end_ns.div_ceil(period_ns.max(1)))
            }
            (step_ns, None) => {
                // More than 584 years.
                let elapsed_ns = u128::from(cycles) * u128::from(period_ns);
                let steps = elapsed_ns / u128::from(step_ns);
                let level = steps.checked_rem(u128::from(self.levels)).unwrap_or(steps);
                (level as u64, cycles.saturating_add(1))
            }
        };
        // INT wraps: 2^16 divides 2^64, so the low 16 bits are right however far an endless signal
        // has come.
        self.value = self.start_value.wrapping_add((level as i16).wrapping_mul(self.increment));
        self.until = cycle.index().saturating_add(end - cycles);
    }

    /// Increments above the start after `steps` steps.
    #[inline]
    fn level(&self, steps: u64) -> u64 {
        // Most divisions are saved: a signal is endless, or in its first period.
        if steps < self.levels || self.levels == 0 { steps } else { steps % self.levels }
    }
}
