//! How many lines each band has.

/// Room that a curve gains nothing from.
const MOST: usize = 12;
/// The heights to try, the best first: lines of a curve, of an on-off signal, and between two bands.
const TRIED: [(usize, usize, usize); 6] =
    [(7, 2, 1), (5, 1, 1), (4, 1, 1), (3, 1, 1), (3, 1, 0), (2, 1, 0)];

/// A line of dots, and the name above it.
const FLAT: usize = 2;

/// The kind of a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Curve,
    /// A BOOL.
    OnOff,
    /// A value that stays, or none.
    Flat,
}

/// Lines of all bands.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heights {
    each: Vec<usize>,
    /// Empty lines between two bands.
    pub(super) between: usize,
}

impl Heights {
    /// Divides the lines among bands of these kinds. If there are too few lines, the bands get more.
    pub(super) fn of(kinds: &[Kind], room: usize) -> Self {
        let heights = |(curve, on_off, between)| {
            let height = |kind: &Kind| match kind {
                Kind::Curve => curve,
                Kind::OnOff => on_off,
                Kind::Flat => FLAT,
            };
            Self { each: kinds.iter().map(height).collect(), between }
        };
        let mut tried = TRIED.map(heights).into_iter();
        let fits = tried.clone().find(|heights| heights.total() <= room);
        let mut heights =
            fits.or_else(|| tried.next_back()).unwrap_or(Self { each: Vec::new(), between: 0 });
        // Remaining lines go to the curves, from the top.
        let mut left = room.saturating_sub(heights.total());
        while left > 0 {
            let before = left;
            for (height, kind) in heights.each.iter_mut().zip(kinds) {
                if *kind == Kind::Curve && *height < MOST && left > 0 {
                    *height += 1;
                    left -= 1;
                }
            }
            if left == before {
                break;
            }
        }
        heights
    }

    /// The height of each band.
    pub(super) fn each(&self) -> impl Iterator<Item = usize> {
        self.each.iter().copied()
    }

    /// The lines of all of them.
    pub(super) fn total(&self) -> usize {
        self.each.iter().sum::<usize>() + self.each.len().saturating_sub(1) * self.between
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_share_the_room_and_give_way_when_there_are_many() {
        let of = |curves: usize, others: usize, room: usize| {
            let kinds = [vec![Kind::Curve; curves], vec![Kind::OnOff; others]].concat();
            Heights::of(&kinds, room)
        };
        assert_eq!(of(1, 1, 19), Heights { each: vec![12, 2], between: 1 });
        assert_eq!(of(2, 1, 19), Heights { each: vec![8, 7, 2], between: 1 });
        assert_eq!(of(6, 0, 19), Heights { each: vec![4, 3, 3, 3, 3, 3], between: 0 });
        assert_eq!(of(0, 5, 19), Heights { each: vec![2; 5], between: 1 });
        assert_eq!(of(20, 0, 19), Heights { each: vec![2; 20], between: 0 });
        assert_eq!(of(0, 0, 19).total(), 0);
        let flat = Heights::of(&[Kind::Flat, Kind::Curve], 12);
        assert_eq!(flat, Heights { each: vec![2, 9], between: 1 });
    }
}
