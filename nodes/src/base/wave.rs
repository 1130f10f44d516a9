//! Test signals.

use std::f64::consts::TAU;

use clap::ValueEnum;

/// Shape of a wave. All start at their mean or their low level and have the period 1/frequency.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Shape {
    /// Rises from low to high, then drops at once
    Sawtooth,
    /// Sine
    Sine,
    /// Low during the first period, then high
    Step,
    /// High in the first half of each period, low in the second
    Square,
}

/// A wave around `offset`, from `offset - amplitude` to `offset + amplitude`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    pub(crate) shape: Shape,
    pub(crate) amplitude: f64,
    pub(crate) offset: f64,
    pub(crate) frequency_hz: f64,
}

impl Wave {
    /// Its value at a time in seconds.
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        let periods = time_s * self.frequency_hz;
        let phase = periods - periods.floor();
        let unit = match self.shape {
            Shape::Sawtooth => 2.0 * phase - 1.0,
            Shape::Sine => (TAU * phase).sin(),
            Shape::Step => {
                if periods >= 1.0 {
                    1.0
                } else {
                    -1.0
                }
            }
            Shape::Square => {
                if phase < 0.5 {
                    1.0
                } else {
                    -1.0
                }
            }
        };
        self.offset + self.amplitude * unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(shape: Shape, time_s: f64) -> f64 {
        Wave { shape, amplitude: 2.0, offset: 10.0, frequency_hz: 0.5 }.at(time_s)
    }

    #[test]
    fn waves_swing_around_their_offset_by_their_amplitude_once_a_period() {
        assert_eq!([0.0, 1.0, 1.5, 2.0].map(|t| at(Shape::Sawtooth, t)), [8.0, 10.0, 11.0, 8.0]);
        assert_eq!([0.0, 0.5, 2.5].map(|t| at(Shape::Sine, t)), [10.0, 12.0, 12.0]);
        assert_eq!([0.0, 0.9, 1.0, 2.0].map(|t| at(Shape::Square, t)), [12.0, 12.0, 8.0, 12.0]);
        assert_eq!([0.0, 1.9, 2.0, 99.0].map(|t| at(Shape::Step, t)), [8.0, 8.0, 12.0, 12.0]);
    }
}
