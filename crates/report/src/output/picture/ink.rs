//! The ink of an arm: a colour, and a dash once the colours are used up.

use plotters::prelude::*;

/// Wong's palette, without the yellow that is too bright for white paper: told apart by people who
/// see colours differently.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];
/// Length of a dash and of the gap behind it, in pixels. The first arms have solid lines.
const DASHES: [Option<(i32, i32)>; 3] = [None, Some((8, 4)), Some((2, 4))];
const CORRECTED: (i32, i32) = (5, 3);
/// Of curves that lie on one, two and more others. The second begins twice as often as the first, so each leaves a part of
/// those below in sight.
const ABOVE: [(i32, i32); 3] = [(10, 8), (4, 5), (2, 16)];

/// A colour and a dash.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::output) struct Ink {
    pub(super) colour: RGBAColor,
    pub(in crate::output) dash: Option<(i32, i32)>,
}

impl Ink {
    /// That of an arm: 21 different ones, then the first again.
    pub(super) fn of(arm: usize) -> Self {
        let colour = COLOURS.get(arm % COLOURS.len()).copied().unwrap_or(BLACK);
        let dash = DASHES.get(arm / COLOURS.len() % DASHES.len()).copied().flatten();
        Self { colour: colour.into(), dash }
    }

    /// Its colour, as style sheets write it.
    pub(in crate::output) fn css_colour(self) -> String {
        let RGBAColor(red, green, blue, _) = self.colour;
        format!("rgb({red} {green} {blue})")
    }

    /// That of what belongs to no arm.
    pub(super) fn grey() -> Self {
        Self { colour: RGBColor(90, 90, 90).into(), dash: None }
    }

    /// That of the arm's corrected times: the same colour, dashed.
    pub(super) fn corrected(self) -> Self {
        Self { dash: Some(CORRECTED), ..self }
    }

    /// That of a curve that lies on so many others: a dash that leaves them in sight.
    pub(super) fn above(self, others: usize) -> Self {
        let dash = others.checked_sub(1).and_then(|it| ABOVE.get(it).or(ABOVE.last()).copied());
        Self { dash: dash.or(self.dash), ..self }
    }

    /// The same without a dash.
    pub(super) fn solid(self) -> Self {
        Self { dash: None, ..self }
    }

    /// The same, less visible.
    pub(super) fn faint(self) -> Self {
        Self { colour: self.colour.mix(0.45), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twenty_one_arms_are_told_apart_by_colour_or_dash() {
        let inks: Vec<Ink> = (0..21).map(Ink::of).collect();
        for (index, ink) in inks.iter().enumerate() {
            assert!(!inks[..index].contains(ink), "{index}: {ink:?}");
        }
        assert_eq!(Ink::of(21), Ink::of(0));
    }

    #[test]
    fn corrected_times_have_the_colour_of_their_arm_and_a_dash_that_no_arm_has() {
        let inks: Vec<Ink> = (0..21).map(Ink::of).collect();
        for ink in &inks {
            assert_eq!(ink.corrected().colour, ink.colour);
            assert!(!inks.contains(&ink.corrected()), "{ink:?}");
        }
    }
}
