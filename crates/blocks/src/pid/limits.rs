//! The range of the output and the rates at which it may move.

use super::Inputs;
use crate::status;

/// The least and the greatest output, and how far it may move in this cycle.
pub(super) struct Limits {
    min: f64,
    max: f64,
    up: f64,
    down: f64,
}

impl Limits {
    /// `Err` is the status word.
    #[inline]
    pub(super) fn of(inputs: &Inputs, h: f64) -> Result<Self, u16> {
        let (min, max) = (inputs.output_min, inputs.output_max);
        match status::of_limits(min, max) {
            status::RANGE => Err(status::RANGE),
            _ if inputs.up_rate < 0.0 || inputs.down_rate < 0.0 => Err(status::NEGATIVE_RATE),
            status::OK if !inputs.up_rate.is_nan() && !inputs.down_rate.is_nan() => {
                Ok(Self { min, max, up: inputs.up_rate * h, down: inputs.down_rate * h })
            }
            _ => Err(status::NOT_FINITE),
        }
    }

    /// Where the output comes from `last` on its way to `target`, and what limited it.
    #[inline]
    pub(super) fn limit(&self, last: f64, target: f64) -> (f64, u16) {
        let (low, high) = (last - self.down, last + self.up);
        let (moved, limited) = if target > high {
            (high, status::LIMITED_RATE)
        } else if target < low {
            (low, status::LIMITED_RATE)
        } else {
            (target, status::OK)
        };
        if moved > self.max {
            (self.max, status::LIMITED_HIGH)
        } else if moved < self.min {
            (self.min, status::LIMITED_LOW)
        } else {
            (moved, limited)
        }
    }
}

/// The output while a rate is invalid: it holds, but within limits that are valid.
pub(super) fn held(last: f64, inputs: &Inputs) -> f64 {
    let (min, max) = (inputs.output_min, inputs.output_max);
    match status::of_limits(min, max) {
        status::OK if last > max => max,
        status::OK if last < min => min,
        _ => last,
    }
}
