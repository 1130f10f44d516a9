//! A picture of signals over time: a pane for each unit, one of status words, and lanes of BOOLs.

use isochrone_scope::{Column, Decimation, Extremes, Ticks, TrackSignal};
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::canvas::{self, Canvas, Failure};
use super::ink::Ink;
use super::legend::shortened;
use super::screen::{Screen, TEXT_SIZE};
use super::shot::band::{FRAME, GRID, LEFT, LETTERS, RIGHT, SHADE, TRIGGER, WIDTH, plain};
use super::trace::lines;

const TOP: i32 = 66;
const BOTTOM: i32 = 66;
/// Height of a row of the legend above a pane.
const ROW: i32 = 19;
const GAP: i32 = 12;
const LANE: i32 = 20;
const MARGIN: i32 = 5;
const SYMBOL: i32 = 20;
/// Width of a letter of the legend, in pixels, rather too wide.
const LETTER: i32 = 8;
const VALUE_LABEL: i32 = 26;
const TIME_LABEL: i32 = 80;
/// The columns of a curve, one a pixel.
pub(in crate::output) const COLUMNS: i32 = WIDTH - LEFT - RIGHT;

/// Signals over time.
#[derive(Debug)]
pub struct SignalChart {
    /// What they are of.
    pub title: String,
    /// A second line, for what else has to be said.
    pub about: String,
    /// The signals, in the order of the rows of `data`.
    pub signals: Vec<TrackSignal>,
    /// Their values.
    pub data: Decimation,
    /// Time between two rows, in ns.
    pub period_ns: u64,
}

/// What shares an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale<'a> {
    Unit(&'a str),
    Words,
    /// A BOOL alone: the lanes stand one below the other.
    Lane,
}

/// Signals over one axis of values.
struct Pane<'a> {
    scale: Scale<'a>,
    signals: Vec<usize>,
    /// Where the entries of its legend begin, relative to its top.
    legend: Vec<(i32, i32)>,
    columns: Vec<Vec<Column>>,
    extremes: Option<Extremes>,
    top: i32,
    bottom: i32,
}

impl SignalChart {
    /// Time from the first row to the end of the last one, in ns.
    pub(in crate::output) fn length_ns(&self) -> f64 {
        self.data.rows() as f64 * self.period_ns as f64
    }

    fn panes(&self) -> Vec<Pane<'_>> {
        let scale_of = |signal: &'_ TrackSignal| match signal.value_type.as_str() {
            "BOOL" => 2,
            "WORD" => 1,
            _ => 0,
        };
        let mut order: Vec<usize> = (0..self.signals.len()).collect();
        order.sort_by_key(|index| self.signals.get(*index).map(scale_of));
        let mut panes: Vec<Pane<'_>> = Vec::new();
        for index in order {
            let Some(signal) = self.signals.get(index) else { continue };
            let scale = match scale_of(signal) {
                2 => Scale::Lane,
                1 => Scale::Words,
                _ => Scale::Unit(&signal.unit),
            };
            let shared = panes.iter_mut().find(|it| it.scale == scale && scale != Scale::Lane);
            let columns = self.data.columns(index, COLUMNS as usize);
            if let Some(pane) = shared {
                pane.signals.push(index);
                pane.columns.push(columns);
            } else {
                let (signals, columns) = (vec![index], vec![columns]);
                let pane = Pane {
                    scale,
                    signals,
                    columns,
                    legend: vec![],
                    extremes: None,
                    top: 0,
                    bottom: 0,
                };
                panes.push(pane);
            }
        }
        let height = match panes.iter().filter(|pane| pane.scale != Scale::Lane).count() {
            0..=1 => 300,
            2 => 210,
            3..=4 => 150,
            _ => 110,
        };
        let mut y = TOP;
        for pane in &mut panes {
            let (mut x, mut row) = (LEFT, 0);
            for index in &pane.signals {
                let width = SYMBOL + 16 + self.name(*index).chars().count() as i32 * LETTER;
                if x > LEFT && x + width > WIDTH - RIGHT {
                    (x, row) = (LEFT, row + ROW);
                }
                pane.legend.push((x, row));
                x += width;
            }
            pane.top = y + row + ROW;
            let is_lane = pane.scale == Scale::Lane;
            pane.bottom = pane.top + if is_lane { LANE } else { height };
            y = pane.bottom + if is_lane { GAP / 2 } else { GAP };
            pane.extremes = if is_lane {
                Some(Extremes { low: 0.0, high: 1.0 })
            } else {
                Extremes::of(pane.columns.iter().flatten().filter_map(|column| column.values))
            };
        }
        panes
    }

    fn name(&self, index: usize) -> String {
        shortened(self.signals.get(index).map_or("", |it| it.name.as_str()), LETTERS)
    }
}

/// Draws signals over time. Each pixel has the least and the greatest value of its time.
pub fn signals_svg(chart: &SignalChart) -> String {
    let panes = chart.panes();
    let bottom = panes.last().map_or(TOP, |pane| pane.bottom);
    let size = (WIDTH as u32, (bottom + BOTTOM) as u32);
    canvas::svg(size, |area| draw(area, chart, &panes, bottom))
}

fn draw(
    area: &Canvas<'_>,
    chart: &SignalChart,
    panes: &[Pane<'_>],
    bottom: i32,
) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let at = |horizontal, vertical| Pos::new(horizontal, vertical);
    let heading = ("sans-serif", Screen::Wide.title_size(), FontStyle::Bold);
    let heading = heading.into_font().color(&BLACK).pos(at(HPos::Left, VPos::Top));
    area.draw(&Text::new(
        shortened(&chart.title, Screen::Wide.title_letters()),
        (16, 12),
        heading,
    ))?;
    let about = shortened(&chart.about, LETTERS + 20);
    area.draw(&Text::new(about, (16, 36), plain().pos(at(HPos::Left, VPos::Top))))?;
    let length_ns = chart.length_ns().max(1.0);
    let ticks = Ticks::of_times(0.0, length_ns, (COLUMNS / TIME_LABEL) as usize);
    for (ns, says) in &ticks.labels {
        let x = LEFT + (ns / length_ns * f64::from(COLUMNS)).round() as i32;
        for pane in panes {
            area.draw(&PathElement::new([(x, pane.top), (x, pane.bottom)], GRID))?;
        }
        area.draw(&PathElement::new([(x, bottom), (x, bottom + 4)], FRAME))?;
        let style = plain().pos(at(HPos::Center, VPos::Top));
        area.draw(&Text::new(says.as_str(), (x, bottom + 7), style))?;
    }
    for pane in panes {
        pane.draw(area, chart)?;
    }
    let style = plain().pos(at(HPos::Center, VPos::Top));
    let says = format!("time in {}", ticks.unit);
    area.draw(&Text::new(says, (LEFT + COLUMNS / 2, bottom + 24), style))?;
    if panes.iter().flat_map(|pane| &pane.columns).flatten().any(|column| column.is_odd) {
        let swatch = [(LEFT, bottom + 44), (LEFT + 14, bottom + 56)];
        area.draw(&Rectangle::new(swatch, SHADE.filled()))?;
        let tick = [(LEFT + 7, bottom + 44), (LEFT + 7, bottom + 49)];
        area.draw(&PathElement::new(tick, TRIGGER))?;
        let style = plain().pos(at(HPos::Left, VPos::Center));
        let says = "NaN or infinite: no curve, and a red tick above";
        area.draw(&Text::new(says, (LEFT + 20, bottom + 50), style))?;
    }
    area.present()
}

impl Pane<'_> {
    fn y(&self, extremes: Extremes, value: f64) -> i32 {
        let height = f64::from(self.bottom - self.top - 2 * MARGIN);
        self.bottom - MARGIN - (extremes.part(value) * height).round() as i32
    }

    fn draw(&self, area: &Canvas<'_>, chart: &SignalChart) -> Result<(), Failure> {
        let (left, right) = (LEFT, LEFT + COLUMNS);
        let odd = |column: &Column| column.is_odd;
        for (x, _) in (left..).zip(0..COLUMNS as usize).filter(|(_, x)| {
            let mut here = self.columns.iter().filter_map(|columns| columns.get(*x));
            here.any(|column| odd(column) && column.values.is_none())
        }) {
            let shade = [(x, self.top), (x + 1, self.bottom)];
            area.draw(&Rectangle::new(shade, SHADE.filled()))?;
        }
        if let Some(extremes) = self.extremes {
            for (value, says) in self.labels(extremes) {
                let y = self.y(extremes, value);
                area.draw(&PathElement::new([(left, y), (right, y)], GRID))?;
                let style = plain().pos(Pos::new(HPos::Right, VPos::Center));
                area.draw(&Text::new(says, (left - 7, y), style))?;
            }
        }
        let top = self.legend.last().map_or(self.top, |(_, row)| self.top - row - ROW);
        if let Scale::Unit(unit) = self.scale
            && !unit.is_empty()
        {
            let bold = ("sans-serif", TEXT_SIZE, FontStyle::Bold).into_font().color(&BLACK);
            let bold = bold.pos(Pos::new(HPos::Right, VPos::Center));
            area.draw(&Text::new(shortened(unit, 9), (left - 7, top + ROW / 2), bold))?;
        }
        let signals = self.signals.iter().zip(&self.columns).zip(&self.legend);
        for (place, ((index, columns), (x, row))) in signals.enumerate() {
            // The legend of a pane is its own, so its colours begin anew; lanes differ from their neighbours.
            let ink = match self.scale {
                Scale::Lane => Ink::of(*index).solid(),
                _ => Ink::of(place),
            };
            let style = ShapeStyle { stroke_width: 2, ..ink.colour.into() };
            let y = top + row + ROW / 2;
            stroke(area, vec![(*x, y), (x + SYMBOL, y)], ink, style)?;
            let text = plain().pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(chart.name(*index), (x + SYMBOL + 5, y), text))?;
            let Some(extremes) = self.extremes else { continue };
            for line in lines(columns, left, |value| self.y(extremes, value)) {
                stroke(area, line, ink, style)?;
            }
        }
        for (x, _) in self.columns.iter().flat_map(|it| (left..).zip(it)).filter(|(_, it)| odd(it))
        {
            area.draw(&PathElement::new([(x, self.top), (x, self.top + MARGIN)], TRIGGER))?;
        }
        let frame = [(left, self.top), (left, self.bottom), (right, self.bottom)];
        area.draw(&PathElement::new(frame, FRAME))
    }

    fn labels(&self, extremes: Extremes) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Lane => vec![(0.0, "FALSE".into()), (1.0, "TRUE".into())],
            Scale::Words => {
                let mut values = vec![extremes.low, extremes.high];
                values.dedup();
                values.into_iter().map(|it| (it, format!("16#{:04X}", it as u64))).collect()
            }
            Scale::Unit(_) => {
                let most = ((self.bottom - self.top) / VALUE_LABEL).max(1);
                Ticks::of_values(extremes, most as usize).labels
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

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(signals: &[(&str, &str, &str)], rows: &[&[f64]]) -> SignalChart {
        let mut data = Decimation::new(signals.len());
        rows.iter().for_each(|row| data.push(row));
        let signal = |(name, unit, value_type): &(&str, &str, &str)| TrackSignal {
            name: (*name).into(),
            unit: (*unit).into(),
            value_type: (*value_type).into(),
        };
        let signals = signals.iter().map(signal).collect();
        SignalChart { title: "t".into(), about: "<a>".into(), signals, data, period_ns: 1_000_000 }
    }

    #[test]
    fn a_unit_is_a_pane_and_so_are_status_words_and_each_bool_is_a_lane() {
        let signals = [
            ("pump.on", "", "BOOL"),
            ("a.y", "m", "LREAL"),
            ("a.status", "", "WORD"),
            ("b.y", "m", "LREAL"),
            ("c.y", "m/s", "LREAL"),
            ("valve.open", "", "BOOL"),
        ];
        let rows: [&[f64]; 2] =
            [&[0.0, 1.0, 24_577.0, 2.0, 5.0, 1.0], &[1.0, 1.5, 0.0, 3.0, 5.0, 1.0]];
        let chart = chart(&signals, &rows);
        let panes = chart.panes();
        let panes: Vec<_> = panes.iter().map(|it| (it.scale, it.signals.clone())).collect();
        assert_eq!(
            panes,
            [
                (Scale::Unit("m"), vec![1, 3]),
                (Scale::Unit("m/s"), vec![4]),
                (Scale::Words, vec![2]),
                (Scale::Lane, vec![0]),
                (Scale::Lane, vec![5]),
            ]
        );
        let svg = signals_svg(&chart);
        for says in ["16#6001", "16#0000", "TRUE", "m/s", "pump.on", "time in us", "&lt;a&gt;"] {
            assert!(svg.contains(says), "{says}: {svg}");
        }
        assert!(!svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn what_is_no_number_is_a_gap_that_the_picture_explains() {
        let rows: [&[f64]; 3] = [&[1.0], &[f64::NAN], &[2.0]];
        let svg = signals_svg(&chart(&[("a", "", "LREAL")], &rows));
        assert!(svg.contains("NaN or infinite"), "{svg}");
        assert_eq!(chart(&[("a", "", "LREAL")], &rows).panes()[0].extremes.unwrap().high, 2.0);
    }

    #[test]
    fn a_picture_of_no_rows_or_of_nothing_finite_is_a_frame() {
        assert!(signals_svg(&chart(&[("a", "", "LREAL")], &[])).contains("</svg>"));
        assert!(signals_svg(&chart(&[], &[])).contains("</svg>"));
        assert!(signals_svg(&chart(&[("a", "", "WORD")], &[&[f64::NAN]])).contains("</svg>"));
        let huge: [&[f64]; 2] = [&[-1.7e308], &[1.7e308]];
        assert!(signals_svg(&chart(&[("a", "", "LREAL")], &huge)).contains("</svg>"));
    }
}
