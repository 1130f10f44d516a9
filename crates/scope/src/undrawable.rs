//! Signals without a curve.

use crate::Track;

/// Why no value of a signal can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Undrawable {
    /// There is none.
    Absent,
    /// Each is NaN.
    NotANumber,
    /// Each is infinite.
    Infinite,
    /// Some are NaN, and the others infinite.
    Both,
}

impl Undrawable {
    /// The text in place of the curve.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Absent => "no values",
            Self::NotANumber => "NaN",
            Self::Infinite => "infinite",
            Self::Both => "NaN or infinite",
        }
    }
}

impl Track {
    /// Why a signal has no curve; `None` if it has a finite value.
    pub fn undrawable(&self, place: usize) -> Option<Undrawable> {
        let (mut has_nan, mut has_infinite) = (false, false);
        for (_, value) in self.rows.signal(place) {
            match value {
                value if value.is_finite() => return None,
                value if value.is_nan() => has_nan = true,
                _ => has_infinite = true,
            }
        }
        Some(match (has_nan, has_infinite) {
            (false, false) => Undrawable::Absent,
            (true, false) => Undrawable::NotANumber,
            (false, true) => Undrawable::Infinite,
            (true, true) => Undrawable::Both,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Head, Rows};

    #[test]
    fn a_signal_without_a_finite_value_has_no_curve_for_one_of_four_reasons() {
        let why = |values: &[f64]| {
            let mut rows = Rows::new(1);
            values.iter().for_each(|value| rows.push(Head::default(), &[*value]));
            Track { rows, ..Track::default() }.undrawable(0)
        };
        let (nan, infinity) = (f64::NAN, f64::INFINITY);
        assert_eq!(why(&[]), Some(Undrawable::Absent));
        assert_eq!(why(&[nan, nan]), Some(Undrawable::NotANumber));
        assert_eq!(why(&[infinity, -infinity]), Some(Undrawable::Infinite));
        assert_eq!(why(&[infinity, nan]), Some(Undrawable::Both));
        assert_eq!(why(&[infinity, nan, 0.0]), None);
    }
}
