//! The parts of the control law and its parameters, as words of state.

use core::slice::{Iter, IterMut};

use crate::StateField;

/// The parts of the control law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parts {
    pub(super) proportional: f64,
    pub(super) integral: f64,
    pub(super) derivative: f64,
}

impl Parts {
    /// With the integral that makes their sum `v`.
    pub(super) fn aligned(v: f64, proportional: f64, derivative: f64) -> Self {
        Self { proportional, integral: v - (proportional + derivative), derivative }
    }

    pub(super) fn are_finite(&self) -> bool {
        self.proportional.is_finite() && self.integral.is_finite() && self.derivative.is_finite()
    }
}

impl StateField for Parts {
    const WORDS: usize = 3;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        let [proportional, integral, derivative] = StateField::take(words);
        Self { proportional, integral, derivative }
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        [self.proportional, self.integral, self.derivative].put(words);
    }
}

/// The parameters of the control law, the same for both forms and both actions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tuning {
    pub(super) gain: f64,
    pub(super) integral_gain: f64,
    pub(super) derivative_gain: f64,
    /// Time constant of the derivative's filter in seconds.
    pub(super) filter_s: f64,
    /// Infinite: no anti-windup.
    pub(super) tracking_s: f64,
    pub(super) b: f64,
    pub(super) c: f64,
}

impl StateField for Tuning {
    const WORDS: usize = 7;
    #[inline]
    fn take(words: &mut Iter<'_, u64>) -> Self {
        let [gain, integral_gain, derivative_gain, filter_s, tracking_s, b, c] =
            StateField::take(words);
        Self { gain, integral_gain, derivative_gain, filter_s, tracking_s, b, c }
    }
    #[inline]
    fn put(self, words: &mut IterMut<'_, u64>) {
        let Self { gain, integral_gain, derivative_gain, filter_s, tracking_s, b, c } = self;
        [gain, integral_gain, derivative_gain, filter_s, tracking_s, b, c].put(words);
    }
}
