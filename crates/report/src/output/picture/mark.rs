//! Marks: small forms that stay told apart where they are many.

use plotters::prelude::*;

use super::canvas::{Canvas, Failure};
use super::ink::Ink;

/// The form of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Dot,
    Ring,
    Triangle,
    Square,
    Diamond,
    Cross,
    /// A triangle on its tip, not filled.
    Wedge,
}

impl Mark {
    /// Draws the mark around a pixel.
    pub(super) fn draw(
        self,
        area: &Canvas<'_>,
        (x, y): (i32, i32),
        ink: Ink,
    ) -> Result<(), Failure> {
        let line = ShapeStyle::from(ink.colour);
        let filled = line.filled();
        let polygon = |corners: &[(i32, i32)]| {
            let corners: Vec<_> =
                corners.iter().map(|(right, down)| (x + right, y + down)).collect();
            area.draw(&Polygon::new(corners, filled))
        };
        match self {
            Self::Dot => area.draw(&Circle::new((x, y), 3, filled)),
            Self::Ring => area.draw(&Circle::new((x, y), 4, line)),
            Self::Triangle => polygon(&[(0, -5), (5, 4), (-5, 4)]),
            Self::Square => polygon(&[(-4, -4), (4, -4), (4, 4), (-4, 4)]),
            Self::Diamond => polygon(&[(0, -6), (5, 0), (0, 6), (-5, 0)]),
            Self::Wedge => {
                let corners = [(0, 5), (5, -4), (-5, -4), (0, 5)];
                let corners: Vec<_> =
                    corners.iter().map(|(right, down)| (x + right, y + down)).collect();
                area.draw(&PathElement::new(corners, line.stroke_width(2)))
            }
            Self::Cross => area.draw(&Cross::new((x, y), 4, line)),
        }
    }
}
