//! LimRateOfChangeAdvancedCI: a ramp with four rates, limits and operating modes.

use crate::lim_rate_of_change::toward;
use crate::{Block, Caution, Cycle, Decision, Ob, decisions, status};

crate::block! {
    /// Limits the rate of change of a signal with separate rates for each range and direction, limits
    /// the output, and supports tracking, presetting, manual operation and restarting.
    pub LimRateOfChangeAdvancedCI {
        follows { "LGF_LimRateOfChangeAdvancedCI, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Signal to follow in automatic mode.
            "autoValue" => auto_value: f64 = 0.0,
            /// Output in manual mode.
            "manualValue" => manual_value: f64 = 0.0,
            /// Rate of change, rising in the positive range.
            "setPosUpRateLim" => set_pos_up_rate_lim: f64 ["1/s"] = 0.0,
            /// Rate of change, falling in the positive range.
            "setPosDownRateLim" => set_pos_down_rate_lim: f64 ["1/s"] = 0.0,
            /// Rate of change, falling (magnitude rising) in the negative range.
            "setNegUpRateLim" => set_neg_up_rate_lim: f64 ["1/s"] = 0.0,
            /// Rate of change, rising (magnitude falling) in the negative range.
            "setNegDownRateLim" => set_neg_down_rate_lim: f64 ["1/s"] = 0.0,
            /// High limit of the output.
            "setHighLim" => set_high_lim: f64 = 0.0,
            /// Low limit of the output.
            "setLowLim" => set_low_lim: f64 = 0.0,
            /// Value to preset the output with.
            "defaultOutValue" => default_out_value: f64 = 0.0,
            /// Preset the output with `defaultOutValue`.
            "enDefaultOutValue" => en_default_out_value: bool = false,
            /// Output follows `autoValue` without a ramp.
            "track" => track: bool = false,
            /// Manual mode: output is `manualValue`, without ramp or limits.
            "manOp" => man_op: bool = false,
            /// Restart: output is 0.0, or `defaultOutValue` within the limits if that is enabled.
            "reset" => reset: bool = false,
            /// Cyclic-interrupt OB whose period is the sample time: its number, or its task's name.
            "callOB" => call_ob: Ob = Ob::Caller,
        }
        outputs {
            /// Signal with limited rate of change.
            "outputValue" => output_value: f64,
            /// `setPosUpRateLim` limits the output.
            "posUpRateLim" => pos_up_rate_lim: bool,
            /// `setPosDownRateLim` limits the output.
            "posDownRateLim" => pos_down_rate_lim: bool,
            /// `setNegUpRateLim` limits the output.
            "negUpRateLim" => neg_up_rate_lim: bool,
            /// `setNegDownRateLim` limits the output.
            "negDownRateLim" => neg_down_rate_lim: bool,
            /// `setHighLim` is reached: the value before limiting is at or above it.
            "highLim" => high_lim: bool,
            /// `setLowLim` is reached: the value before limiting is at or below it.
            "lowLim" => low_lim: bool,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
            /// Status of the query of the OB's period.
            #[alias = "subFunctionStatus"]
            "subfunctionStatus" => subfunction_status: u16,
        }
        state {
            y: f64,
            /// Manual mode was left and the range between the limits is not reached yet.
            disarmed: bool,
        }
        computes {
            "The first mode in this list whose condition holds is active:",
            "Restart (`reset`): 0.0, or `defaultOutValue` within the limits if `enDefaultOutValue`; all flags are FALSE.",
            "Manual (`manOp`): `manualValue`, without limits; all flags are FALSE.",
            "Preset (`enDefaultOutValue`): `defaultOutValue`, within the limits while they are on.",
            "Tracking (`track`): `autoValue`, within the limits while they are on.",
            "Disabled (all four rates are 0.0): 0.0; all flags are FALSE.",
            "Automatic: from the last output toward `autoValue` by at most rate times `T`, landing on it exactly, within the limits while they are on. `T` is the period, in seconds, of the task at `callOB`; range (above or below 0.0) and direction select the rate.",
            "A rate flag is TRUE if its rate stopped the output short of the target; a limit flag is TRUE if the value before limiting is at or beyond the limit.",
            "`setHighLim` below `setLowLim` is the error `ERR_NEG_RATE_LIM`: LGF calls it so, although it is not about a rate.",
            "Manual mode switches the limits off. They are switched on again as soon as the output reaches the range between them. Until then automatic mode is not limited, and moves further away if `autoValue` lies there; `reset` switches the limits on at once. As long as the output stays beyond a limit that is off after manual mode, a node has the alarm `limits_off`.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::RANGE => "ERR_NEG_RATE_LIM": "setHighLim is less than setLowLim",
            status::NEGATIVE_RATE => "ERR_NEG_RATE_OF_CHANGE": "a rate of change is negative",
            status::QRY_CINT => "ERR_QRY_CINT": status::QRY_CINT_DOC,
            status::OB_UNAVAILABLE => "ERR_OB_UNAVAILABLE": status::OB_UNAVAILABLE_DOC,
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "a rate or limit is NaN, or the active mode's signal is NaN or infinite",
        }
        decisions {
            Decision {
                silent_on: "several modes at once",
                chosen: "the order of the list above: `reset` precedes manual mode, and \
                         `enDefaultOutValue` precedes `track`; LGF says only that manual mode precedes \
                         `enDefaultOutValue`",
            },
            Decision {
                silent_on: "other modes than automatic while all four rates are 0.0",
                chosen: "restart, manual, preset and tracking need no rate and still act",
            },
            Decision {
                silent_on: "equal limits",
                chosen: "valid: the output stands at that value",
            },
            Decision {
                silent_on: "a limit flag while the limits are off",
                chosen: "TRUE as always where the value before limiting is at or beyond the limit, \
                         though nothing is cut",
            },
            Decision {
                silent_on: "a step that passes 0.0",
                chosen: "it is split: the time to 0.0 uses the first rate, the remaining time the \
                         second, whose flag it sets; with no time left the output is 0.0 in that call",
            },
            Decision {
                silent_on: "which rate applies at exactly 0.0",
                chosen: "upwards `setPosUpRateLim`, downwards `setNegUpRateLim`",
            },
            Decision {
                silent_on: "a limit and a rate in the same call",
                chosen: "the rate flag is FALSE if the limit cuts the output, or if the ramp ends \
                         exactly on the limit and the target lies beyond it",
            },
            Decision {
                silent_on: "when the range is reached after manual mode",
                chosen: "when the last output (including the manual value) or the next lies between \
                         the limits or on one of them, or when the step crosses both",
            },
            Decision {
                silent_on: "limits during a restart and in disabled mode",
                chosen: "`defaultOutValue` is limited if the limits are valid, a plain 0.0 is not; a \
                         restart switches the limits on",
            },
            decisions::FIRST_CALL,
            decisions::SAMPLE_TIME,
            decisions::SKIPPED_CYCLES,
            decisions::OB_NUMBERS,
            decisions::HOLD,
            decisions::NOT_FINITE,
            decisions::SEVERAL_ERRORS,
        }
    }
}

/// Operating modes; the first whose condition holds is active.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Restart,
    Manual,
    Preset,
    Tracking,
    Disabled,
    Automatic,
}

/// The four ramps.
#[derive(Clone, Copy, PartialEq)]
enum Ramp {
    PosUp,
    PosDown,
    NegUp,
    NegDown,
}

/// Why the output is not what was asked for.
#[derive(Clone, Copy, Default)]
struct Flags {
    ramp: Option<Ramp>,
    high: bool,
    low: bool,
}

impl Block for LimRateOfChangeAdvancedCI {
    #[inline(always)]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let mode = inputs.mode();
        let signal = inputs.signal(mode);
        let sample_time_s = cycle.sample_time_s(inputs.call_ob);
        let limits = inputs.check_limits();
        let rates = inputs.check_rates();
        let status = status::first(
            sample_time_s,
            [
                (limits == status::RANGE, status::RANGE),
                (rates == status::NEGATIVE_RATE, status::NEGATIVE_RATE),
                (
                    limits != status::OK || rates != status::OK || !signal.is_finite(),
                    status::NOT_FINITE,
                ),
            ],
        );
        let needs_met = match mode {
            Mode::Restart | Mode::Manual => true,
            Mode::Preset | Mode::Tracking => limits == status::OK,
            Mode::Disabled | Mode::Automatic => {
                limits == status::OK && rates == status::OK && sample_time_s.is_ok()
            }
        };
        let flags = if needs_met && signal.is_finite() {
            inputs.act(mode, signal, sample_time_s.unwrap_or_default(), state)
        } else {
            Flags::default()
        };
        Outputs {
            output_value: state.y,
            pos_up_rate_lim: flags.ramp == Some(Ramp::PosUp),
            pos_down_rate_lim: flags.ramp == Some(Ramp::PosDown),
            neg_up_rate_lim: flags.ramp == Some(Ramp::NegUp),
            neg_down_rate_lim: flags.ramp == Some(Ramp::NegDown),
            high_lim: flags.high,
            low_lim: flags.low,
            error: status::is_error(status),
            status,
            subfunction_status: status::subfunction(status),
        }
    }

    const CAUTION: Option<&'static Caution> = Some(&Caution {
        code: "limits_off",
        meaning: "its limits are off after manual mode, until the output reaches the range between them",
        over: "its limits are on",
        remedy: "leave manual mode with a manualValue between the limits, or set reset, which restarts it",
    });

    /// The output stands beyond a limit that says so: with the limits on, it would stand on it.
    fn needs_caution(inputs: &Inputs, outputs: &Outputs) -> bool {
        let (y, high, low) = (outputs.output_value, inputs.set_high_lim, inputs.set_low_lim);
        outputs.high_lim && y > high || outputs.low_lim && y < low
    }

    /// In automatic mode, on a way that takes three thousand years.
    fn typical() -> Inputs {
        Inputs {
            auto_value: 1e12,
            set_pos_up_rate_lim: 10.0,
            set_high_lim: f64::INFINITY,
            set_low_lim: f64::NEG_INFINITY,
            ..Inputs::default()
        }
    }
}

impl Inputs {
    #[inline]
    fn mode(&self) -> Mode {
        if self.reset {
            Mode::Restart
        } else if self.man_op {
            Mode::Manual
        } else if self.en_default_out_value {
            Mode::Preset
        } else if self.track {
            Mode::Tracking
        } else if self.rates() == [0.0; 4] {
            Mode::Disabled
        } else {
            Mode::Automatic
        }
    }

    /// The signal that the mode uses, or what stands in its place.
    #[inline]
    fn signal(&self, mode: Mode) -> f64 {
        match mode {
            Mode::Restart if !self.en_default_out_value => 0.0,
            Mode::Restart | Mode::Preset => self.default_out_value,
            Mode::Manual => self.manual_value,
            Mode::Disabled => 0.0,
            Mode::Tracking | Mode::Automatic => self.auto_value,
        }
    }

    #[inline]
    fn rates(&self) -> [f64; 4] {
        [
            self.set_pos_up_rate_lim,
            self.set_pos_down_rate_lim,
            self.set_neg_up_rate_lim,
            self.set_neg_down_rate_lim,
        ]
    }

    #[inline]
    fn rate(&self, ramp: Ramp) -> f64 {
        match ramp {
            Ramp::PosUp => self.set_pos_up_rate_lim,
            Ramp::PosDown => self.set_pos_down_rate_lim,
            Ramp::NegUp => self.set_neg_up_rate_lim,
            Ramp::NegDown => self.set_neg_down_rate_lim,
        }
    }

    #[inline]
    fn check_limits(&self) -> u16 {
        let (high, low) = (self.set_high_lim, self.set_low_lim);
        // Limits that only an infinity lies between would make the output infinite.
        if low <= high && high > f64::NEG_INFINITY && low < f64::INFINITY {
            status::OK
        } else if high < low {
            status::RANGE
        } else {
            status::NOT_FINITE
        }
    }

    #[inline]
    fn check_rates(&self) -> u16 {
        if self.rates().iter().all(|rate| *rate >= 0.0) {
            status::OK
        } else if self.rates().iter().any(|rate| *rate < 0.0) {
            status::NEGATIVE_RATE
        } else {
            status::NOT_FINITE
        }
    }

    /// Moves the output; everything that the mode needs is valid.
    #[inline]
    fn act(&self, mode: Mode, signal: f64, sample_time_s: f64, state: &mut State) -> Flags {
        match mode {
            Mode::Restart => {
                // Only manual mode is exempt from the limits, but a restart needs none.
                let limited = self.en_default_out_value && self.check_limits() == status::OK;
                let y = if limited { self.clamp(signal) } else { signal };
                *state = State { y, disarmed: false };
            }
            Mode::Manual => *state = State { y: signal, disarmed: true },
            Mode::Disabled => state.y = signal,
            Mode::Preset | Mode::Tracking => return self.limit(signal, None, state),
            Mode::Automatic => {
                let (candidate, ramp) = self.ramp(state.y, signal, sample_time_s);
                return self.limit(candidate, ramp, state);
            }
        }
        Flags::default()
    }

    /// One step from `y` toward `target`, and the ramp that stopped it short.
    #[inline]
    fn ramp(&self, y: f64, target: f64, sample_time_s: f64) -> (f64, Option<Ramp>) {
        let rising = target > y;
        let (first, second) = match (rising, y < 0.0, y > 0.0) {
            (true, true, _) => (Ramp::NegDown, Ramp::PosUp),
            (true, false, _) => (Ramp::PosUp, Ramp::PosUp),
            (false, _, true) => (Ramp::PosDown, Ramp::NegUp),
            (false, _, false) => (Ramp::NegUp, Ramp::NegUp),
        };
        // Only a target on the other side of zero makes the step cross it.
        let crosses = first != second && target != 0.0 && (target > 0.0) == rising;
        let goal = if crosses { 0.0 } else { target };
        let next = toward(y, goal, self.rate(first) * sample_time_s);
        if !crosses || next != 0.0 {
            return (next, (next != target).then_some(first));
        }
        // Zero is split exactly: the time that remains is spent at the second rate.
        let rest_s = sample_time_s - y.abs() / self.rate(first);
        if rest_s > 0.0 {
            let next = toward(0.0, target, self.rate(second) * rest_s);
            (next, (next != target).then_some(second))
        } else {
            (0.0, Some(first))
        }
    }

    /// The limit stage: what of a candidate for the output passes, and what it tells.
    #[inline]
    fn limit(&self, candidate: f64, ramp: Option<Ramp>, state: &mut State) -> Flags {
        let (high, low) = (self.set_high_lim, self.set_low_lim);
        // Nearly every cycle: nothing to cut, nothing to tell.
        if low < candidate && candidate < high {
            *state = State { y: candidate, disarmed: false };
            return Flags { ramp, ..Flags::default() };
        }
        // The range is reached unless the output stays beyond the same limit.
        state.disarmed &=
            (state.y > high && candidate > high) || (state.y < low && candidate < low);
        let y = if state.disarmed { candidate } else { self.clamp(candidate) };
        // A ramp that ends exactly on a limit is stopped by the limit if its target lies beyond.
        let stopped = match ramp {
            Some(Ramp::PosUp | Ramp::NegDown) => candidate == high,
            Some(Ramp::PosDown | Ramp::NegUp) => candidate == low,
            None => false,
        };
        let ramp = if stopped || y != candidate { None } else { ramp };
        state.y = y;
        Flags { ramp, high: candidate >= high, low: candidate <= low }
    }

    /// A value within the limits, which are valid.
    #[inline]
    fn clamp(&self, value: f64) -> f64 {
        if value > self.set_high_lim {
            self.set_high_lim
        } else if value < self.set_low_lim {
            self.set_low_lim
        } else {
            value
        }
    }
}
