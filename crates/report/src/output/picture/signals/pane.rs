//! Signals that share an axis of values.

use isochrone_scope::{Column, Extremes, Ticks};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::canvas::{Canvas, Failure};
use super::super::ink::Ink;
use super::super::legend::shortened;
use super::super::screen::TEXT_SIZE;
use super::super::shot::band::{FRAME, GRID, LEFT, LETTERS, RIGHT, WIDTH, plain};
use super::super::trace::lines;
use super::axis::Axis;

/// The columns of a curve, one a pixel.
pub(in crate::output) const COLUMNS: i32 = WIDTH - LEFT - RIGHT;
/// Height of a row of the legend above a pane.
const ROW: i32 = 19;
const MARGIN: i32 = 5;
/// Height of the bar of what is no number, and its least width.
const BAR: i32 = 4;
/// Long enough for two dashes.
const SYMBOL: i32 = 28;
/// Width of a letter of the legend, in pixels, rather too wide.
const LETTER: i32 = 8;
const VALUE_LABEL: i32 = 26;
/// So many columns in which a curve lies on another make it a dashed one.
const HIDDEN: usize = 12;

/// What shares an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scale<'a> {
    Unit(&'a str),
    Words,
    /// A BOOL alone: the lanes stand one below the other.
    Lane,
}

/// A signal of a pane.
pub(in crate::output) struct Trace {
    /// Its place in the picture.
    pub(in crate::output) index: usize,
    pub(super) name: String,
    pub(super) is_whole: bool,
    pub(super) columns: Vec<Column>,
    pub(in crate::output) ink: Ink,
    /// Where its entry of the legend begins, relative to the top of the first row.
    legend: (i32, i32),
}

impl Trace {
    pub(super) fn new(index: usize, name: &str, is_whole: bool, columns: Vec<Column>) -> Self {
        let name = shortened(name, LETTERS);
        Self { index, name, is_whole, columns, ink: Ink::of(0), legend: (LEFT, 0) }
    }

    pub(super) fn has_odd(&self) -> bool {
        self.columns.iter().any(|column| column.is_odd)
    }

    /// Its entry of the legend.
    fn says(&self) -> String {
        let name = &self.name;
        if self.has_odd() {
            format!("{name} (NaN or infinite under the bar)")
        } else {
            name.clone()
        }
    }
}

/// Signals over one axis of values.
pub(in crate::output) struct Pane<'a> {
    pub(super) scale: Scale<'a>,
    pub(in crate::output) traces: Vec<Trace>,
    pub(in crate::output) axis: Option<Axis>,
    pub(in crate::output) top: i32,
    pub(in crate::output) bottom: i32,
}

impl<'a> Pane<'a> {
    pub(super) fn new(scale: Scale<'a>, trace: Trace) -> Self {
        Self { scale, traces: vec![trace], axis: None, top: 0, bottom: 0 }
    }

    /// Lays itself out below `y`, of this height, and chooses its axis and the inks of its signals.
    pub(super) fn lay_out(&mut self, y: i32, height: i32) {
        let (mut x, mut row) = (LEFT, 0);
        for trace in &mut self.traces {
            let width = SYMBOL + 16 + trace.says().chars().count() as i32 * LETTER;
            if x > LEFT && x + width > WIDTH - RIGHT {
                (x, row) = (LEFT, row + ROW);
            }
            trace.legend = (x, row);
            x += width;
        }
        let columns = self.traces.iter().flat_map(|trace| &trace.columns);
        let values = columns.filter_map(|column| column.values);
        self.axis = match self.scale {
            Scale::Lane => Some(Axis::Linear(Extremes { low: 0.0, high: 1.0 })),
            Scale::Words => Axis::of_words(values, (height / VALUE_LABEL).max(1) as usize),
            Scale::Unit(_) => Extremes::of(values).map(Axis::Linear),
        };
        self.top = y + row + ROW;
        // A few words need no more room than their labels.
        self.bottom = self.top
            + match &self.axis {
                Some(Axis::Levels(levels)) => levels.len().max(2) as i32 * VALUE_LABEL,
                _ => height,
            };
        for place in 0..self.traces.len() {
            let ink = match (self.scale, self.traces.get(place)) {
                // Lanes differ from their neighbours; the legend of a pane is its own, so its colours begin anew.
                (Scale::Lane, Some(trace)) => Ink::of(trace.index).solid(),
                _ => Ink::of(place).above(self.hidden_by(place)),
            };
            if let Some(trace) = self.traces.get_mut(place) {
                trace.ink = ink;
            }
        }
    }

    /// How many of the signals before this one it would hide.
    fn hidden_by(&self, place: usize) -> usize {
        let (Some(axis), Some(above)) = (&self.axis, self.traces.get(place)) else { return 0 };
        let pixels =
            |column: &Column| column.values.map(|it| (self.y(axis, it.low), self.y(axis, it.high)));
        let is_hidden = |below: &&Trace| {
            let both = below.columns.iter().zip(&above.columns);
            both.filter(|(a, b)| pixels(a).is_some() && pixels(a) == pixels(b)).count() >= HIDDEN
        };
        self.traces.iter().take(place).filter(is_hidden).count()
    }

    /// The least and the greatest `y` of the curves.
    pub(in crate::output) fn inside(&self) -> (i32, i32) {
        let bars = self.traces.iter().filter(|trace| trace.has_odd()).count() as i32;
        (self.top + MARGIN + bars * BAR, self.bottom - MARGIN)
    }

    fn y(&self, axis: &Axis, value: f64) -> i32 {
        let (top, bottom) = self.inside();
        bottom - (axis.part(value) * f64::from(bottom - top)).round() as i32
    }

    /// The `y` of each label.
    pub(in crate::output) fn grid(&self) -> Vec<i32> {
        let labels = self
            .axis
            .iter()
            .flat_map(|axis| self.labels(axis).into_iter().map(move |it| (axis, it)));
        labels.map(|(axis, (value, _))| self.y(axis, value)).collect()
    }

    pub(super) fn draw(&self, area: &Canvas<'_>) -> Result<(), Failure> {
        let (left, right) = (LEFT, LEFT + COLUMNS);
        if let Some(axis) = &self.axis {
            for (value, says) in self.labels(axis) {
                let y = self.y(axis, value);
                area.draw(&PathElement::new([(left, y), (right, y)], GRID))?;
                let style = plain().pos(Pos::new(HPos::Right, VPos::Center));
                area.draw(&Text::new(says, (left - 7, y), style))?;
            }
        }
        let rows = self.traces.last().map_or(0, |trace| trace.legend.1 + ROW);
        let top = self.top - rows;
        if let Scale::Unit(unit) = self.scale
            && !unit.is_empty()
        {
            let bold = ("sans-serif", TEXT_SIZE, FontStyle::Bold).into_font().color(&BLACK);
            let bold = bold.pos(Pos::new(HPos::Right, VPos::Center));
            area.draw(&Text::new(shortened(unit, 9), (left - 7, top + ROW / 2), bold))?;
        }
        let mut bar = self.top;
        for trace in &self.traces {
            let Trace { columns, ink, legend: (x, row), .. } = trace;
            let style = ShapeStyle { stroke_width: 2, ..ink.colour.into() };
            let y = top + row + ROW / 2;
            stroke(area, vec![(*x, y), (x + SYMBOL, y)], *ink, style)?;
            let text = plain().pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(trace.says(), (x + SYMBOL + 5, y), text))?;
            if let Some(axis) = &self.axis {
                for line in lines(columns, left, |value| self.y(axis, value)) {
                    stroke(area, line, *ink, style)?;
                }
            }
            for run in columns.chunk_by(|a, b| a.is_odd == b.is_odd).scan(left, |x, run| {
                *x += run.len() as i32;
                Some((*x - run.len() as i32, run))
            }) {
                if let (x, [Column { is_odd: true, .. }, ..]) = run {
                    let end = x + (run.1.len() as i32).max(BAR);
                    let corners = [(x, bar), (end.min(right), bar + BAR)];
                    area.draw(&Rectangle::new(corners, ink.colour.filled()))?;
                }
            }
            bar += if trace.has_odd() { BAR } else { 0 };
        }
        let frame = [(left, self.top), (left, self.bottom), (right, self.bottom)];
        area.draw(&PathElement::new(frame, FRAME))
    }

    pub(super) fn labels(&self, axis: &Axis) -> Vec<(f64, String)> {
        let most = ((self.bottom - self.top) / VALUE_LABEL).max(1) as usize;
        let word = |value: &f64| (*value, format!("16#{:04X}", *value as u64));
        match (self.scale, axis) {
            (Scale::Lane, _) => vec![(0.0, "FALSE".into()), (1.0, "TRUE".into())],
            (_, Axis::Levels(levels)) => levels.iter().map(word).collect(),
            (Scale::Words, Axis::Linear(Extremes { low, high })) => {
                [*low, *high].iter().map(word).collect()
            }
            (Scale::Unit(_), Axis::Linear(extremes)) => {
                let is_whole = self.traces.iter().all(|trace| trace.is_whole);
                let ticks = if is_whole { Ticks::of_whole_values } else { Ticks::of_values };
                ticks(*extremes, most).labels
            }
        }
    }
}

fn stroke(
    area: &Canvas<'_>,
    line: Vec<(i32, i32)>,
    ink: Ink,
    style: ShapeStyle,
) -> Result<(), Failure> {
    match ink.dash {
        None => area.draw(&PathElement::new(line, style)),
        Some((dash, gap)) => area.draw(&DashedPathElement::new(line, dash, gap, style)),
    }
}
