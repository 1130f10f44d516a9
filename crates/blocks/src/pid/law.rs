//! The control law: the parameters that both forms and both actions come down to, and what follows from them.

use super::parts::Tuning;
use super::{Inputs, State};
use crate::status;

impl Tuning {
    /// `Err` is the status word.
    #[inline]
    pub(super) fn of(inputs: &Inputs) -> Result<Self, u16> {
        let &Inputs { n, b, c, tracking_time, .. } = inputs;
        let gain = if inputs.direct { -inputs.gain } else { inputs.gain };
        let (integral_time, derivative_time) = if inputs.parallel {
            (0.0, 0.0)
        } else {
            (inputs.integral_time, inputs.derivative_time)
        };
        let are_negative = integral_time < 0.0 || derivative_time < 0.0 || tracking_time < 0.0;
        if are_negative || n <= 0.0 {
            return Err(status::TIME);
        }
        let (integral_gain, derivative_gain, filter_s, automatic_s) = if inputs.parallel {
            let sign = if inputs.direct { -1.0 } else { 1.0 };
            let (ki, kd) = (sign * inputs.integral_gain, sign * inputs.derivative_gain);
            if gain == 0.0 || kd == 0.0 {
                // A sensor's noise is amplified by no more than N * gain: here, by nothing.
                (ki, 0.0 * kd, 0.0, (gain / ki).abs())
            } else {
                (ki, kd, (kd / gain).abs() / n, libm::sqrt((kd / ki).abs()))
            }
        } else {
            let ki = if integral_time == 0.0 { 0.0 } else { gain / integral_time };
            let automatic_s = if derivative_time == 0.0 {
                integral_time
            } else {
                libm::sqrt(integral_time * derivative_time)
            };
            (ki, gain * derivative_time, derivative_time / n, automatic_s)
        };
        let tracking_s = if integral_gain == 0.0 {
            f64::INFINITY
        } else if tracking_time == 0.0 {
            automatic_s
        } else {
            tracking_time
        };
        let finite = [gain, integral_gain, derivative_gain, filter_s, b, c];
        let are_numbers = !(n.is_nan() || tracking_time.is_nan() || tracking_s.is_nan());
        if are_numbers && finite.iter().all(|value| value.is_finite()) {
            Ok(Self { gain, integral_gain, derivative_gain, filter_s, tracking_s, b, c })
        } else {
            Err(status::NOT_FINITE)
        }
    }

    #[inline]
    pub(super) fn proportional(&self, inputs: &Inputs) -> f64 {
        self.gain * (self.b * inputs.set_point - inputs.process_value)
    }

    /// The derivative after `h` seconds in which the signals came from those of `before`.
    #[inline]
    pub(super) fn derivative(&self, before: &State, inputs: &Inputs, h: f64) -> f64 {
        let change = self.c * (inputs.set_point - before.set_point)
            - (inputs.process_value - before.process_value);
        (self.filter_s * before.parts.derivative + self.derivative_gain * change)
            / (self.filter_s + h)
    }
}
