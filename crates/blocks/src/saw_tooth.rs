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
            /// Cycle at which the signal's time was `before_ns`: that at which the inputs were taken over, or the last one
            /// in which the task had another period.
            origin: u64,
            before_ns: u64,
            /// The task's period in ns.
            period_ns: u64,
            /// Duration of a step in ns; 0: one cycle.
            step_ns: u64,
            /// A `Staircase` in one word, as it is only read when the value changes.
            staircase: u64,
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
                chosen: "it goes on where it stood: the time that passed is kept, and the cycles from there on are those of the new period",
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
        let is_same = cycle.period_ns() == state.period_ns;
        if cycle.index() >= state.until || inputs.reset || !is_same {
            if inputs.reset || state.until == 0 {
                state.take_over(inputs, cycle.index());
            } else if !is_same {
                state.keep_time(cycle.index().saturating_sub(1));
            }
            state.period_ns = cycle.period_ns();
            state.find_value(cycle);
        }
        Outputs { value: state.value }
    }

    /// The range of an analogue input in ten steps of 10 ms.
    fn typical() -> Inputs {
        Inputs { time_range: 10, increment_range: 2_764, number_steps: 10, ..Inputs::default() }
    }
}

/// The values of a sawtooth.
struct Staircase {
    start_value: i16,
    increment: i16,
    /// Number of different values; 0: endless.
    levels: u16,
}

impl Staircase {
    fn of(inputs: &Inputs) -> Self {
        let levels = inputs.number_steps.max(0).unsigned_abs() + 1;
        Self {
            start_value: inputs.start_value,
            increment: inputs.increment_range,
            levels: if inputs.endless_steps { 0 } else { levels },
        }
    }

    #[inline]
    fn from_word(word: u64) -> Self {
        let [start_value, increment] = [word as i16, (word >> 16) as i16];
        Self { start_value, increment, levels: (word >> 32) as u16 }
    }

    fn into_word(self) -> u64 {
        let Self { start_value, increment, levels } = self;
        u64::from(start_value as u16) | u64::from(increment as u16) << 16 | u64::from(levels) << 32
    }

    /// The value after so many steps.
    #[inline]
    fn value(&self, steps: u64) -> i16 {
        let levels = u64::from(self.levels);
        // Most divisions are saved: a signal is endless, or in its first period.
        let level = if steps < levels || levels == 0 { steps } else { steps % levels };
        // INT wraps: 2^16 divides 2^64, so the low 16 bits are right however far an endless signal
        // has come.
        self.start_value.wrapping_add((level as i16).wrapping_mul(self.increment))
    }
}

impl State {
    fn take_over(&mut self, inputs: &Inputs, cycle: u64) {
        *self = Self {
            origin: cycle,
            step_ns: u64::from(inputs.time_range.max(0).unsigned_abs()) * NS_PER_MS,
            staircase: Staircase::of(inputs).into_word(),
            ..Self::default()
        };
    }

    /// Takes over the time that had passed in a cycle, the last one of another period, up to 584 years.
    #[cold]
    fn keep_time(&mut self, cycle: u64) {
        let cycles = cycle.saturating_sub(self.origin);
        // Without a duration of a step, the signal is made of cycles.
        if self.step_ns > 0 {
            let passed_ns = cycles.saturating_mul(self.period_ns);
            (self.origin, self.before_ns) = (cycle, self.before_ns.saturating_add(passed_ns));
        }
    }

    /// Finds the value of a cycle and how long it lasts. Exact integers throughout: time is the
    /// task's grid, so nothing drifts.
    #[inline]
    fn find_value(&mut self, cycle: &Cycle<'_>) {
        let (cycles, period_ns) = (cycle.index().wrapping_sub(self.origin), cycle.period_ns());
        let staircase = Staircase::from_word(self.staircase);
        let elapsed_ns =
            cycles.checked_mul(period_ns).and_then(|ns| ns.checked_add(self.before_ns));
        let end;
        (self.value, end) = match (self.step_ns, elapsed_ns) {
            (0, _) => (staircase.value(cycles), cycles.saturating_add(1)),
            (step_ns, Some(elapsed_ns)) => {
                let steps = elapsed_ns / step_ns;
                let end_ns = (steps + 1).saturating_mul(step_ns) - self.before_ns;
                (staircase.value(steps), end_ns.div_ceil(period_ns.max(1)))
            }
            (step_ns, None) => {
                // More than 584 years.
                let elapsed_ns =
                    u128::from(cycles) * u128::from(period_ns) + u128::from(self.before_ns);
                let steps = elapsed_ns / u128::from(step_ns);
                let levels = u128::from(staircase.levels);
                let steps = steps.checked_rem(levels).unwrap_or(steps) as u64;
                (staircase.value(steps), cycles.saturating_add(1))
            }
        };
        self.until = self.origin.saturating_add(end);
    }
}
