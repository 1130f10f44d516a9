//! One signal of a shot.

use isochrone_scope::{Column, Extremes, Gap, Shot, Span, Ticks, Track, TrackSignal, columns};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::canvas::{Canvas, Failure};
use super::super::ink::Ink;
use super::super::legend::shortened;
use super::super::screen::{Screen, TEXT_SIZE};
use super::super::trace::lines;

pub(in crate::output::picture) const WIDTH: i32 = Screen::Wide.width() as i32;
pub(in crate::output::picture) const LEFT: i32 = 84;
pub(in crate::output::picture) const RIGHT: i32 = 20;
pub(in crate::output::picture) const TOP: i32 = 62;
/// The name above a band.
const NAME: i32 = 19;
pub(in crate::output::picture) const GAP: i32 = 8;
/// What stays free above and below a curve.
const MARGIN: i32 = 4;
const DIGITAL: i32 = 24;
/// Between two labels of values.
const VALUE_LABEL: i32 = 26;
pub(in crate::output::picture) const LETTERS: usize = 110;
pub(in crate::output::picture) const DASH: (i32, i32) = (5, 4);
pub(in crate::output::picture) const GRID: RGBColor = RGBColor(228, 228, 228);
pub(in crate::output::picture) const FRAME: RGBColor = RGBColor(150, 150, 150);
pub(in crate::output::picture) const SHADE: RGBColor = RGBColor(216, 216, 216);
pub(in crate::output::picture) const TRIGGER: RGBColor = RGBColor(190, 30, 45);

/// One signal, from `top` to `bottom`.
pub(super) struct Band<'a> {
    track: &'a Track,
    place: usize,
    signal: &'a TrackSignal,
    pub(super) columns: Vec<Column>,
    extremes: Option<Extremes>,
    pub(super) top: i32,
    pub(super) bottom: i32,
}

/// The bands one below the other, and where the next one would be.
pub(super) fn bands(shot: &Shot) -> (Vec<Band<'_>>, i32) {
    let span = Span::of(shot, (WIDTH - LEFT - RIGHT) as usize);
    let analog = shot.tracks.iter().flat_map(|track| &track.signals);
    let height = match analog.filter(|signal| !signal.is_digital()).count() {
        0..=2 => 150,
        3..=4 => 110,
        5..=8 => 80,
        _ => 56,
    };
    let mut y = TOP;
    let mut bands = Vec::new();
    for track in &shot.tracks {
        for (place, signal) in track.signals.iter().enumerate() {
            let columns = columns(shot, track, place, span);
            let is_digital = signal.is_digital();
            let extremes = if is_digital {
                Some(Extremes { low: 0.0, high: 1.0 })
            } else {
                Extremes::of(columns.iter().filter_map(|column| column.values))
            };
            let top = y + NAME;
            let bottom = top + if is_digital { DIGITAL } else { height };
            bands.push(Band { track, place, signal, columns, extremes, top, bottom });
            y = bottom + GAP;
        }
    }
    (bands, y)
}

impl Band<'_> {
    fn y(&self, extremes: Extremes, value: f64) -> i32 {
        let height = f64::from(self.bottom - self.top - 2 * MARGIN);
        self.bottom - MARGIN - (extremes.part(value) * height).round() as i32
    }

    pub(super) fn draw(&self, area: &Canvas<'_>, shot: &Shot, ink: Ink) -> Result<(), Failure> {
        let Self { track, signal, columns, top, bottom, .. } = self;
        let (left, right) = (LEFT, WIDTH - RIGHT);
        let x = |at_ns| left + Span::of(shot, (right - left) as usize).column(at_ns) as i32;
        for Gap { begin_ns, end_ns } in shot.gaps(track) {
            let corners = [(x(begin_ns), *top), (x(end_ns).max(x(begin_ns) + 1), *bottom)];
            area.draw(&Rectangle::new(corners, SHADE.filled()))?;
        }
        let unit = if signal.unit.is_empty() { "" } else { " in " };
        let name = shortened(&format!("{}{unit}{}", signal.name, signal.unit), LETTERS);
        area.draw(&Text::new(
            name,
            (left, top - 3),
            bold().pos(Pos::new(HPos::Left, VPos::Bottom)),
        ))?;
        if let Some(extremes) = self.extremes {
            for (value, says) in self.labels(extremes) {
                let y = self.y(extremes, value);
                area.draw(&PathElement::new([(left, y), (right, y)], GRID))?;
                let style = plain().pos(Pos::new(HPos::Right, VPos::Center));
                area.draw(&Text::new(says, (left - 7, y), style))?;
            }
            let style = ShapeStyle { stroke_width: 2, ..ink.colour.into() };
            for line in lines(columns, left, |value| self.y(extremes, value)) {
                area.draw(&PathElement::new(line, style))?;
            }
            if let Some(trigger) = &shot.trigger
                && let Some(level) = trigger.level.filter(|_| trigger.signal == signal.name)
                && (extremes.low..=extremes.high).contains(&level)
                && !signal.is_digital()
            {
                let y = self.y(extremes, level);
                let line = [(left, y), (right, y)];
                area.draw(&DashedPathElement::new(line, DASH.0, DASH.1, TRIGGER.mix(0.6)))?;
            }
        }
        if let Some(why) = self.track.undrawable(self.place).filter(|_| !signal.is_digital()) {
            let style = plain().pos(Pos::new(HPos::Center, VPos::Center));
            area.draw(&Text::new(why.as_str(), ((left + right) / 2, (top + bottom) / 2), style))?;
        }
        for (x, _) in (left..).zip(columns).filter(|(_, column)| column.is_odd) {
            area.draw(&PathElement::new([(x, *top), (x, top + MARGIN)], TRIGGER))?;
        }
        area.draw(&PathElement::new([(left, *top), (left, *bottom), (right, *bottom)], FRAME))?;
        for Gap { begin_ns, end_ns } in shot.missed(track) {
            let corners = [(x(begin_ns), bottom - 1), (x(end_ns).max(x(begin_ns) + 1), bottom + 2)];
            area.draw(&Rectangle::new(corners, TRIGGER.filled()))?;
        }
        Ok(())
    }

    fn labels(&self, extremes: Extremes) -> Vec<(f64, String)> {
        if self.signal.is_digital() {
            return vec![(0.0, "FALSE".into()), (1.0, "TRUE".into())];
        }
        let most = ((self.bottom - self.top) / VALUE_LABEL).max(1);
        Ticks::of_values(extremes, most as usize).labels
    }
}

pub(in crate::output::picture) fn plain() -> TextStyle<'static> {
    ("sans-serif", TEXT_SIZE).into_font().color(&RGBColor(60, 60, 60))
}

fn bold() -> TextStyle<'static> {
    ("sans-serif", TEXT_SIZE, FontStyle::Bold).into_font().color(&BLACK)
}
