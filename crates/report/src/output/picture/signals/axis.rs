//! Where a value stands on the axis of a pane.

use isochrone_scope::Extremes;

/// An axis of values.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::output) enum Axis {
    /// In proportion.
    Linear(Extremes),
    /// At equal distances, in ascending order: status words are names, and many differ in the last digit only.
    Levels(Vec<f64>),
}

impl Axis {
    /// Of status words; in proportion if there are more than this many.
    pub(super) fn of_words(values: impl Iterator<Item = Extremes>, most: usize) -> Option<Self> {
        let mut levels: Vec<f64> = Vec::new();
        let mut extremes = None;
        for Extremes { low, high } in values {
            extremes = Some(Extremes::with(Some(Extremes::with(extremes, low)), high));
            for value in [low, high] {
                let place = levels.partition_point(|level| *level < value);
                if levels.len() <= most && levels.get(place) != Some(&value) {
                    levels.insert(place, value);
                }
            }
        }
        extremes
            .map(|it| if levels.len() <= most { Self::Levels(levels) } else { Self::Linear(it) })
    }

    /// Where a value lies: 0 is at the bottom, 1 at the top.
    pub(super) fn part(&self, value: f64) -> f64 {
        match self {
            Self::Linear(extremes) => extremes.part(value),
            Self::Levels(levels) => {
                let last = levels.len().saturating_sub(1) as f64;
                let place = levels.partition_point(|level| *level < value) as f64;
                Extremes { low: 0.0, high: last }.part(place)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(value: f64) -> Extremes {
        Extremes { low: value, high: value }
    }

    #[test]
    fn status_words_stand_at_equal_distances_and_many_in_proportion() {
        let words = [0x6004, 0, 0x6002, 0x6004].map(|word| one(f64::from(word)));
        let axis = Axis::of_words(words.into_iter(), 3).unwrap();
        assert_eq!(axis, Axis::Levels(vec![0.0, 24_578.0, 24_580.0]));
        assert_eq!([0.0, 24_578.0, 24_580.0].map(|word| axis.part(word)), [0.0, 0.5, 1.0]);
        let linear = Axis::of_words(words.into_iter(), 2).unwrap();
        assert_eq!(linear, Axis::Linear(Extremes { low: 0.0, high: 24_580.0 }));
        assert_eq!(Axis::of_words([one(7.0)].into_iter(), 3).unwrap().part(7.0), 0.5);
        assert_eq!(Axis::of_words(std::iter::empty(), 3), None);
    }
}
