//! The curve of one signal, in dots of braille: two columns and four lines of them in each letter.

use isochrone_blocks::PinType;
use isochrone_scope::{Column, Extremes, Shot, Span, Track, TrackSignal, Undrawable, columns};

use super::heights::Kind;
use super::plot::Plot;
use super::{Grid, Ink};
use crate::numbers::{Digits, shown, type_of};
use crate::top::cut_name;

/// A letter without dots; each dot is a bit above it.
const BRAILLE: u32 = 0x2800;
/// The bits of the dots of both columns, from above.
const DOTS: [[u32; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
const DOT_COLUMNS: usize = 2;
const DOT_ROWS: usize = 4;

pub(super) struct Band<'a> {
    track: &'a Track,
    place: usize,
    signal: &'a TrackSignal,
    extremes: Option<Extremes>,
    undrawable: Option<Undrawable>,
}

impl<'a> Band<'a> {
    pub(super) fn of(shot: &Shot, track: &'a Track, place: usize) -> Option<Self> {
        let signal = track.signals.get(place)?;
        let all = columns(shot, track, place, Span::of(shot, 1));
        let extremes = if signal.is_digital() {
            Some(Extremes { low: 0.0, high: 1.0 })
        } else {
            Extremes::of(all.iter().filter_map(|column| column.values))
        };
        let undrawable = track.undrawable(place);
        Some(Self { track, place, signal, extremes, undrawable })
    }

    fn is_digital(&self) -> bool {
        self.signal.is_digital()
    }

    pub(super) fn kind(&self) -> Kind {
        match self.extremes {
            _ if self.is_digital() => Kind::OnOff,
            Some(Extremes { low, high }) if low < high => Kind::Curve,
            _ => Kind::Flat,
        }
    }

    /// Columns of the longest label beside the curve.
    pub(super) fn label_width(&self) -> usize {
        let name = self.signal.name.chars().count();
        let labels = [2, 3].into_iter().flat_map(|height| self.labels(height, usize::MAX));
        labels.map(|(_, label)| label.chars().count()).fold(name, usize::max)
    }

    /// The labels beside the curve: the line of each, and what it says.
    fn labels(&self, height: usize, width: usize) -> Vec<(usize, String)> {
        let name = cut_name(&self.signal.name, width).into_owned();
        let Some(Extremes { low, high }) = self.extremes.filter(|_| !self.is_digital()) else {
            let none = self.undrawable.filter(|_| height > 1 && !self.is_digital());
            let none = none.map(|why| (1, why.as_str().to_owned()));
            return [(0, name)].into_iter().chain(none).collect();
        };
        let value_type = type_of(&self.signal.value_type);
        let value = |value| shown(value, value_type, Digits::Six);
        // A time is written with its unit.
        let unit = Some(self.signal.unit.as_str());
        let unit = unit.filter(|unit| !unit.is_empty() && value_type != PinType::Time);
        let unit = unit.map_or_else(String::new, |unit| format!(" {unit}"));
        match (height, low == high) {
            (2, false) => vec![(0, name), (1, format!("{} … {}{unit}", value(low), value(high)))],
            (2, true) => vec![(0, name), (1, format!("{}{unit}", value(low)))],
            (_, true) => {
                let middle = (height - 1) / 2;
                vec![(middle, name), (height - 1, format!("{}{unit}", value(low)))]
            }
            (_, false) => vec![
                (0, format!("{}{unit}", value(high))),
                ((height - 1) / 2, name),
                (height - 1, format!("{}{unit}", value(low))),
            ],
        }
    }

    pub(super) fn draw(
        &self,
        grid: &mut Grid,
        shot: &Shot,
        plot: Plot,
        (top, height): (usize, usize),
        ink: Ink,
    ) {
        let beside = plot.left - 1;
        let is_ranged = height > 2 && self.extremes.is_some_and(|it| it.low < it.high);
        for row in 0..height {
            let is_end = is_ranged && !self.is_digital() && (row == 0 || row == height - 1);
            grid.text(beside, top + row, if is_end { "┤" } else { "│" }, Ink::Axis);
        }
        for (row, label) in self.labels(height, beside - 1) {
            let is_name = cut_name(&self.signal.name, beside - 1) == label;
            let label_ink = if is_name { ink } else { Ink::Text };
            grid.text_before(beside - 1, top + row, &label, label_ink);
        }
        let span = Span::of(shot, plot.width * DOT_COLUMNS);
        let columns = columns(shot, self.track, self.place, span);
        for (column, pair) in (plot.left..).zip(columns.chunks(DOT_COLUMNS)) {
            self.draw_column(grid, (column, pair), (top, height), ink);
        }
        self.draw_trigger(grid, shot, plot, (top, height));
    }

    fn draw_column(
        &self,
        grid: &mut Grid,
        (column, pair): (usize, &[Column]),
        (top, height): (usize, usize),
        ink: Ink,
    ) {
        for row in 0..height {
            let dots = pair.iter().zip(DOTS).map(|(column, dots)| {
                let rows = column.values.map(|values| self.dot_rows(values, height));
                let has = |dot: usize| {
                    rows.is_some_and(|(from, to)| (from..=to).contains(&(row * DOT_ROWS + dot)))
                };
                let bits = dots.iter().enumerate().filter(|(dot, _)| has(*dot));
                bits.map(|(_, bit)| bit).sum::<u32>()
            });
            let dots: u32 = dots.sum();
            match char::from_u32(BRAILLE + dots) {
                Some(letter) if dots > 0 => grid.put(column, top + row, letter, ink),
                _ if pair.iter().any(|column| column.is_gap) => {
                    grid.put(column, top + row, '░', Ink::Gap);
                }
                _ => {}
            }
        }
        if pair.iter().any(|column| column.is_odd) {
            grid.put(column, top + height - 1, '?', Ink::Odd);
        }
    }

    /// The lines of dots from the greatest value to the least, counted from above.
    fn dot_rows(&self, values: Extremes, height: usize) -> (usize, usize) {
        let lowest = height * DOT_ROWS - 1;
        let row = |value| {
            let part = self.extremes.map_or(0.5, |extremes| extremes.part(value));
            ((1.0 - part) * lowest as f64).round() as usize
        };
        (row(values.high), row(values.low))
    }

    /// The instant of the trigger, and the level where it is this signal's.
    fn draw_trigger(
        &self,
        grid: &mut Grid,
        shot: &Shot,
        plot: Plot,
        (top, height): (usize, usize),
    ) {
        let Some(trigger) = &shot.trigger else { return };
        let column = plot.column(shot, trigger.release_ns);
        let rows = (top..top + height).filter(|row| grid.is_free(column, *row));
        for row in rows.collect::<Vec<_>>() {
            grid.put(column, row, '┊', Ink::Trigger);
        }
        let is_in =
            |level: &f64| self.extremes.is_some_and(|it| (it.low..=it.high).contains(level));
        if trigger.signal == self.signal.name
            && !self.is_digital()
            && let Some(level) = trigger.level.filter(is_in)
        {
            let row =
                top + self.dot_rows(Extremes { low: level, high: level }, height).0 / DOT_ROWS;
            for column in (plot.left..plot.left + plot.width).filter(|column| column % 2 == 0) {
                if grid.is_free(column, row) {
                    grid.put(column, row, '╌', Ink::Trigger);
                }
            }
        }
    }
}
