//! What the generators share: the phase of a signal in whole nanoseconds, and its way from there to an output.

use core::slice::{Iter, IterMut};

use crate::{Cycle, Decision, Ob, StateField, status};

const NS_PER_MS: u64 = 1_000_000;

pub(crate) const TIME: Decision = Decision {
    silent_on: "the time base",
    chosen: "the task's grid in whole nanoseconds: cycles, skipped ones included, times the configured period of the \
             task at `callOB`; the first call is time 0, and nothing drifts",
};

pub(crate) const PERIOD: Decision = Decision {
    silent_on: "the type and the range of `periode`",
    chosen: "TIME (LGF: UDINT, in ms); 0 or less is 16#8203. When it changes, the time since the beginning of the \
             period is kept, modulo the new one",
};

pub(crate) const SHIFT: Decision = Decision {
    silent_on: "the unit of `phaseShift`",
    chosen: "degrees, positive for a signal that is ahead; it counts as the nearest whole nanosecond of the period",
};

pub(crate) const RESET: Decision = Decision {
    silent_on: "the call after `reset`",
    chosen: "a call with `reset` TRUE is time 0, so the next one is one period of the task later",
};

pub(crate) const ERRORS: Decision = Decision {
    silent_on: "`value` and the time during an error",
    chosen: "`value` holds its last valid value, initially 0.0; the time goes on unless `periode` or `callOB` is \
             wrong. `reset` needs neither and is obeyed",
};

pub(crate) const NOT_FINITE: Decision = Decision {
    silent_on: "NaN and infinity",
    chosen: "16#8F00 for an input that is not finite, or a sum of `offset` and `amplitude` that is not; not while \
             `reset` is TRUE",
};

pub(crate) const NOT_FINITE_DOC: &str =
    "an input, or the value itself, is NaN or infinite; value holds";

/// The time of a signal, and its shift for the inputs that it was found for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Clock {
    /// The cycle after the last call; 0: never called.
    next: u64,
    /// Time since the beginning of a period.
    elapsed_ns: u64,
    period_ns: u64,
    shift_deg: f64,
    shift_ns: u64,
}

/// What a generator is set to.
pub(crate) struct Settings {
    pub(crate) amplitude: f64,
    pub(crate) offset: f64,
    pub(crate) period_ms: i32,
    pub(crate) shift_deg: f64,
    pub(crate) reset: bool,
    pub(crate) call_ob: Ob,
    /// Share of the period in percent that a shape takes from an input; 50.0 where it takes none.
    pub(crate) duty_cycle: f64,
}

/// A place in a period.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    pub(crate) phase_ns: u64,
    pub(crate) period_ns: u64,
    /// `climb_ns / period_ns` is the way from the axis to the crest or the trough.
    pub(crate) climb_ns: u64,
    pub(crate) is_below: bool,
}

impl Place {
    fn new(phase_ns: u64, period_ns: u64) -> Self {
        let (is_below, of_half) = if 2 * phase_ns >= period_ns {
            (true, 2 * phase_ns - period_ns)
        } else {
            (false, 2 * phase_ns)
        };
        // The second quarter of a half goes back the way of the first.
        let climb_ns =
            if 2 * of_half > period_ns { 2 * (period_ns - of_half) } else { 2 * of_half };
        Self { phase_ns, period_ns, climb_ns, is_below }
    }

    /// A time within the period as a share of it. Both are below 2^63 ns, and of signed numbers the conversion is cheap.
    #[inline]
    pub(crate) fn share(self, time_ns: u64) -> f64 {
        time_ns as i64 as f64 / self.period_ns as i64 as f64
    }

    /// A height from 0 to 1 with the sign of the place.
    #[inline]
    pub(crate) fn signed(self, height: f64) -> f64 {
        if self.is_below { -height } else { height }
    }
}

/// One call: the value, which was `held`, and the status word. `shape` has results from -1 to 1.
#[inline(always)]
pub(crate) fn generate(
    clock: &mut Clock,
    held: &mut f64,
    settings: &Settings,
    cycle: &Cycle<'_>,
    shape: impl FnOnce(Place) -> f64,
) -> u16 {
    let &Settings { amplitude, offset, period_ms, shift_deg, reset, call_ob, duty_cycle } =
        settings;
    let task_ns = cycle.period_ns_of(call_ob);
    clock.advance(cycle.index(), task_ns, period_ms, reset);
    if reset {
        *held = 0.0;
    }
    let has_duty_cycle = (0.0..=100.0).contains(&duty_cycle);
    if !reset && task_ns.is_ok() && period_ms > 0 && has_duty_cycle && shift_deg.is_finite() {
        // Of an amplitude or an offset that is not finite, no value is.
        let value = offset + amplitude * shape(clock.place(shift_deg));
        if !value.is_finite() {
            return status::NOT_FINITE;
        }
        *held = value;
        return status::OK;
    }
    let signals = [amplitude, offset, shift_deg, duty_cycle];
    let is_not_finite = !reset && signals.into_iter().any(|signal| !signal.is_finite());
    let is_out_of_range = period_ms <= 0 || !(reset || has_duty_cycle || is_not_finite);
    match task_ns {
        Err(status) => status,
        Ok(_) if is_out_of_range => status::TIME,
        Ok(_) if is_not_finite => status::NOT_FINITE,
        Ok(_) => status::OK,
    }
}

impl Clock {
    #[inline]
    fn advance(&mut self, cycle: u64, task_ns: Result<u64, u16>, period_ms: i32, reset: bool) {
        let cycles =
            if self.next == 0 { 0 } else { cycle.saturating_add(1).saturating_sub(self.next) };
        self.next = cycle.saturating_add(1);
        if reset {
            self.elapsed_ns = 0;
        }
        let (Ok(task_ns), 1..) = (task_ns, period_ms) else { return };
        let period_ns = u64::from(period_ms.unsigned_abs()) * NS_PER_MS;
        if period_ns != self.period_ns {
            // The shift is another, too.
            (self.period_ns, self.shift_deg) = (period_ns, f64::NAN);
        }
        if reset {
            return;
        }
        self.elapsed_ns =
            match cycles.checked_mul(task_ns).and_then(|ns| ns.checked_add(self.elapsed_ns)) {
                Some(elapsed_ns) if elapsed_ns < period_ns => elapsed_ns,
                Some(elapsed_ns) => elapsed_ns % period_ns,
                None => {
                    let elapsed_ns =
                        u128::from(cycles) * u128::from(task_ns) + u128::from(self.elapsed_ns);
                    (elapsed_ns % u128::from(period_ns)) as u64
                }
            };
    }

    #[inline]
    fn place(&mut self, shift_deg: f64) -> Place {
        let period_ns = self.period_ns;
        if shift_deg != self.shift_deg {
            self.shift_deg = shift_deg;
            let turns = libm::fmod(shift_deg, 360.0) / 360.0;
            let shift_ns = libm::rint(turns * period_ns as f64) as i64;
            self.shift_ns = shift_ns.rem_euclid(period_ns.max(1) as i64) as u64;
        }
        let shifted_ns = self.elapsed_ns + self.shift_ns;
        Place::new(
            if shifted_ns >= period_ns { shifted_ns - period_ns } else { shifted_ns },
            period_ns,
        )
    }
}

impl StateField for Clock {
    const WORDS: usize = 5;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        let mut word = || u64::take(words);
        Self {
            next: word(),
            elapsed_ns: word(),
            period_ns: word(),
            shift_deg: f64::from_bits(word()),
            shift_ns: word(),
        }
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        for word in
            [self.next, self.elapsed_ns, self.period_ns, self.shift_deg.to_bits(), self.shift_ns]
        {
            word.put(words);
        }
    }
}
