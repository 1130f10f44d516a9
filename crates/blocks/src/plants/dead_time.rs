//! DeadTime: a signal, later.

use crate::{Block, Cycle, Decision, status};

/// Samples that are kept, that of this cycle included. A power of two, so that a cycle's place follows from its index.
const CAPACITY: usize = 1024;
/// The longest dead time in periods.
const LONGEST: u64 = CAPACITY as u64 - 1;

crate::block! {
    /// Delays a signal by a dead time of up to 1023 periods of the task.
    pub DeadTime {
        inputs {
            /// Signal to delay.
            "u" => u: f64 = 0.0,
            /// Dead time.
            "deadTime" => dead_time: f64 ["s"] = 0.0,
        }
        outputs {
            /// Delayed signal.
            "y" => y: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state {
            /// The cycle after the last call; 0: never called.
            next: u64,
            /// Samples that are kept.
            kept: u64,
            /// The last valid sample.
            last: f64,
            /// The sample of the first call, which stands for all before it.
            first: f64,
            y: f64,
        }
        buffer { CAPACITY }
        computes {
            "`y` is `u` of `n` cycles ago, where `n` is `deadTime` in periods of the task. Cycles are counted on the task's grid: one that was skipped has the `u` of the cycle before it.",
            "Until `n` cycles have passed since the first call, `y` is the `u` of the first call.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::LIMITED_HIGH => "WARN_DEAD_TIME_LIMITED":
                "deadTime is longer than 1023 periods, which is what the delay is",
            status::ROUNDED => "WARN_DEAD_TIME_ROUNDED":
                "deadTime is no whole number of periods; the delay is the nearest one",
            status::TIME => "ERR_NEG_DEAD_TIME": "deadTime is negative; y holds",
            status::NOT_FINITE => "ERR_NOT_FINITE":
                "deadTime is NaN or infinite, and y holds; or u is, and its last valid value is delayed in its place",
        }
        decisions {
            Decision {
                silent_on: "a `deadTime` that is no whole number of periods",
                chosen: "it is rounded to whole nanoseconds and then to the nearest whole number of periods, up from a \
                         half, with a warning; nothing is interpolated",
            },
            Decision {
                silent_on: "a change of `deadTime`",
                chosen: "it acts at once: `y` is the sample of that many cycles ago, which may repeat or leave out samples",
            },
            Decision {
                silent_on: "NaN and infinity at `u`",
                chosen: "16#8F00 in that cycle, while `y` goes on; the last valid value, initially 0.0, is kept as its sample",
            },
            Decision {
                silent_on: "samples during an error of `deadTime`",
                chosen: "they are kept, so `y` is right as soon as `deadTime` is",
            },
            Decision {
                silent_on: "samples that are retained in a task with another period",
                chosen: "they are at other distances and are forgotten: `y` holds until `n` cycles have passed",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8203 before 16#8F00, and an error before a warning",
            },
        }
    }
}

impl Block for DeadTime {
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        Self::step_buffered(state, &mut [], inputs, cycle)
    }

    #[inline]
    fn step_buffered(
        state: &mut State,
        buffer: &mut [u64],
        inputs: &Inputs,
        cycle: &Cycle<'_>,
    ) -> Outputs {
        let is_finite = inputs.u.is_finite();
        state.keep(buffer, cycle.index(), if is_finite { inputs.u } else { state.last });
        let status = match periods(inputs.dead_time, cycle.period_ns()) {
            Ok((delay, status)) => {
                state.y = state.sample(buffer, cycle.index(), delay);
                if is_finite { status } else { status::NOT_FINITE }
            }
            Err(status) => status,
        };
        Outputs { y: state.y, error: status::is_error(status), status }
    }

    /// Begins anew from `y`, as the samples have another distance than the cycles from now on.
    fn change_period(state: &mut State, cycle: u64, _: [u64; 2]) {
        if state.next > 0 {
            (state.first, state.kept, state.next) = (state.y, 0, cycle.saturating_add(1));
        }
    }

    /// A conveyor of 100 ms.
    fn typical() -> Inputs {
        Inputs { u: 1.0, dead_time: 0.1 }
    }
}

/// A dead time in periods, and whether that is limited or rounded.
#[inline]
fn periods(dead_time_s: f64, period_ns: u64) -> Result<(u64, u16), u16> {
    if dead_time_s < 0.0 {
        return Err(status::TIME);
    }
    if !dead_time_s.is_finite() {
        return Err(status::NOT_FINITE);
    }
    // A time beyond the range of u64 becomes its greatest value, which is longer than any delay.
    let dead_time_ns = libm::rint(dead_time_s * 1e9) as u64;
    let period_ns = period_ns.max(1);
    let (whole, rest) = (dead_time_ns / period_ns, dead_time_ns % period_ns);
    let delay = whole + u64::from(rest >= period_ns - rest);
    Ok(if delay > LONGEST || (whole == LONGEST && rest > 0) {
        (LONGEST, status::LIMITED_HIGH)
    } else if rest > 0 {
        (delay, status::ROUNDED)
    } else {
        (delay, status::OK)
    })
}

impl State {
    /// Keeps the sample of a cycle, and the last one for the cycles that were skipped before.
    #[inline]
    fn keep(&mut self, buffer: &mut [u64], cycle: u64, u: f64) {
        if self.next == 0 {
            (self.first, self.next) = (u, cycle);
        }
        let skipped = cycle.saturating_sub(self.next).min(LONGEST);
        for skipped_cycle in cycle - skipped..cycle {
            put(buffer, skipped_cycle, self.last);
        }
        put(buffer, cycle, u);
        self.kept = (self.kept + skipped + 1).min(CAPACITY as u64);
        (self.last, self.next) = (u, cycle.saturating_add(1));
    }

    #[inline]
    fn sample(&self, buffer: &[u64], cycle: u64, delay: u64) -> f64 {
        if delay >= self.kept {
            return self.first;
        }
        let sample = buffer.get((cycle - delay) as usize % CAPACITY);
        sample.map_or(self.last, |sample| f64::from_bits(*sample))
    }
}

#[inline]
fn put(buffer: &mut [u64], cycle: u64, u: f64) {
    if let Some(sample) = buffer.get_mut(cycle as usize % CAPACITY) {
        *sample = u.to_bits();
    }
}
