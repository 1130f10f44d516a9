//! A step of the controller.

use super::limits::{Limits, held};
use super::parts::{Parts, Tuning};
use super::{Inputs, Outputs, PID, State};
use crate::{Block, Cycle, status};

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Automatic,
    Manual,
    Tracking,
}

impl Mode {
    #[inline]
    fn of(manual: bool, track: bool) -> Self {
        if manual {
            Self::Manual
        } else if track {
            Self::Tracking
        } else {
            Self::Automatic
        }
    }
}

impl Block for PID {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let h = cycle.elapsed_ns(state.has_run.then_some(state.cycle)) as f64 / 1e9;
        let asked = Mode::of(inputs.manual, inputs.track);
        let mode = if state.has_run { Mode::of(state.manual, state.track) } else { asked };
        let limits = Limits::of(inputs, h);
        let tuning = Tuning::of(inputs);
        if inputs.manual_value.is_finite() && inputs.manual_value != state.manual_value {
            state.holds_manual = false;
        }

        // What an error keeps from being computed is `None`.
        let is_measured = inputs.set_point.is_finite() && inputs.process_value.is_finite();
        let law = tuning.as_ref().ok().filter(|_| is_measured && limits.is_ok());
        let wanted = match mode {
            Mode::Automatic => law.map(|tuning| state.automatic(tuning, inputs, h)),
            Mode::Manual if state.holds_manual => Some((state.output, state.parts)),
            Mode::Manual => Some((inputs.manual_value, state.parts)),
            Mode::Tracking => Some((inputs.track_value, state.parts)),
        };
        let wanted = wanted.filter(|(v, parts)| v.is_finite() && parts.are_finite());
        let (output, limited) = match &limits {
            Ok(limits) => limits.limit(state.output, wanted.map_or(state.output, |(v, _)| v)),
            Err(_) => (held(state.output, inputs), status::OK),
        };
        let next = law.zip(wanted).and_then(|(tuning, (v, parts))| {
            let (v, parts) = match mode {
                Mode::Automatic => (v, parts),
                _ => (output, state.followed(output, tuning, inputs, h)),
            };
            let slope = tuning.integral_gain * (inputs.set_point - inputs.process_value);
            let excess = output - v;
            let is_finite = slope.is_finite() && excess.is_finite() && parts.are_finite();
            is_finite.then_some((*tuning, parts, slope, excess))
        });

        let is_mode_valid = match mode {
            Mode::Automatic => true,
            Mode::Manual => inputs.manual_value.is_finite(),
            Mode::Tracking => inputs.track_value.is_finite(),
        };
        let of_limits = limits.err().unwrap_or(status::OK);
        let of_tuning = tuning.err().unwrap_or(status::OK);
        let status = if of_limits == status::RANGE || of_limits == status::NEGATIVE_RATE {
            of_limits
        } else if of_tuning == status::TIME {
            of_tuning
        } else if !inputs.process_value.is_finite() {
            status::SENSOR
        } else if next.is_none() || !is_mode_valid {
            status::NOT_FINITE
        } else {
            limited
        };

        state.output = output;
        state.is_aligned = next.is_some();
        if let Some((tuning, parts, slope, excess)) = next {
            (state.tuning, state.parts, state.slope, state.excess) = (tuning, parts, slope, excess);
            (state.set_point, state.process_value) = (inputs.set_point, inputs.process_value);
        }
        (state.manual, state.track) = (inputs.manual, inputs.track);
        if asked != Mode::Manual {
            // The next change to manual mode holds until the value is another than this one.
            (state.manual_value, state.holds_manual) = (inputs.manual_value, true);
        }
        (state.has_run, state.cycle) = (true, cycle.index());
        Outputs {
            output,
            proportional_part: state.parts.proportional,
            integral_part: state.parts.integral,
            derivative_part: state.parts.derivative,
            error: status::is_error(status),
            status,
        }
    }

    /// A small deviation that a slow integral takes years to remove.
    fn typical() -> Inputs {
        Inputs {
            set_point: 1.5,
            process_value: 1.0,
            gain: 40.0,
            integral_time: 1e6,
            derivative_time: 1.0,
            ..Inputs::default()
        }
    }
}

impl State {
    /// The sum and the parts of the control law in automatic mode.
    #[inline]
    fn automatic(&self, tuning: &Tuning, inputs: &Inputs, h: f64) -> (f64, Parts) {
        if inputs.reset || !self.has_run {
            let proportional = tuning.proportional(inputs);
            return (proportional, Parts { proportional, integral: 0.0, derivative: 0.0 });
        }
        if !self.is_aligned {
            return self.resumed(tuning, inputs);
        }
        let before = &self.tuning;
        let back = self.excess * (h / before.tracking_s).min(1.0);
        let parts = Parts {
            proportional: before.proportional(inputs),
            integral: self.parts.integral + (self.slope * h + back),
            derivative: before.derivative(self, inputs, h),
        };
        let v = parts.proportional + parts.integral + parts.derivative;
        if tuning == before {
            return (v, parts);
        }
        (v, self.followed(v, tuning, inputs, h))
    }

    /// The sum and the parts in the first cycle after an error.
    #[inline]
    fn resumed(&self, tuning: &Tuning, inputs: &Inputs) -> (f64, Parts) {
        let proportional = tuning.proportional(inputs);
        // Without integral action the tracking time is infinite, so this is before there was any law.
        let is_first = self.tuning.integral_gain == 0.0 && self.tuning.tracking_s == 0.0;
        let before = if is_first { tuning } else { &self.tuning };
        if before.integral_gain != 0.0 {
            return (self.output, Parts::aligned(self.output, proportional, 0.0));
        }
        // What the integral took from the held output now, nothing would ever take away.
        let integral = self.parts.integral;
        let v = before.proportional(inputs) + integral;
        if tuning == before {
            return (v, Parts { proportional, integral, derivative: 0.0 });
        }
        (v, Parts::aligned(v, proportional, 0.0))
    }

    /// The parts with which automatic mode goes on from an output that it did not make.
    #[inline]
    fn followed(&self, output: f64, tuning: &Tuning, inputs: &Inputs, h: f64) -> Parts {
        let derivative = if self.is_aligned { tuning.derivative(self, inputs, h) } else { 0.0 };
        Parts::aligned(output, tuning.proportional(inputs), derivative)
    }
}
