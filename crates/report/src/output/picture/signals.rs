//! A picture of signals over time: a pane for each unit, one of status words, and lanes of BOOLs.

mod axis;
mod pane;

use isochrone_scope::{Decimation, Span, Ticks, TrackSignal};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub(in crate::output) use self::axis::Axis;
pub(in crate::output) use self::pane::{COLUMNS, Pane};
use self::pane::{Scale, Trace};
use super::canvas::{self, Canvas, Failure};
use super::legend::shortened;
use super::screen::Screen;
use super::shot::band::{FRAME, GRID, LEFT, LETTERS, WIDTH, plain};

const TOP: i32 = 66;
const BOTTOM: i32 = 46;
const GAP: i32 = 12;
const LANE: i32 = 28;
const TIME_LABEL: i32 = 80;

/// Signals over time.
#[derive(Debug)]
pub struct SignalChart {
    /// What they are of.
    pub title: String,
    /// A second line, for what else has to be said.
    pub about: String,
    /// The signals, in the order of the legend.
    pub signals: Vec<ChartSignal>,
    /// The values: of each task those of its own cycles.
    pub tasks: Vec<Decimation>,
    /// The instant that is called 0, in ns as the tasks have theirs.
    pub zero_ns: u64,
    /// The end of the picture, in the same ns.
    pub end_ns: u64,
}

/// A signal of a [`SignalChart`].
#[derive(Debug)]
pub struct ChartSignal {
    /// Its name, unit and type.
    pub signal: TrackSignal,
    /// Its task.
    pub task: usize,
    /// Its place in the rows of the task.
    pub place: usize,
}

impl SignalChart {
    /// What the picture shows.
    pub(in crate::output) fn span(&self) -> Span {
        let with_rows = |it: &&Decimation| it.rows() > 0;
        let begins = self.tasks.iter().filter(with_rows).map(|it| it.due_ns(0));
        let begin_ns = begins.chain([self.zero_ns]).min().unwrap_or_default();
        let columns = COLUMNS as usize;
        Span { begin_ns, end_ns: self.end_ns.max(begin_ns + 1), columns }
    }

    /// An instant in ns as the picture counts: from that which is called 0.
    pub(in crate::output) fn time_ns(&self, ns: u64) -> f64 {
        ns as f64 - self.zero_ns as f64
    }

    pub(in crate::output) fn panes(&self) -> Vec<Pane<'_>> {
        let rank = |signal: &'_ TrackSignal| match signal.value_type.as_str() {
            "BOOL" => 2,
            "WORD" => 1,
            _ => 0,
        };
        let mut order: Vec<_> = self.signals.iter().enumerate().collect();
        order.sort_by_key(|(_, it)| rank(&it.signal));
        let mut panes: Vec<Pane<'_>> = Vec::new();
        for (index, ChartSignal { signal, task, place }) in order {
            let scale = match rank(signal) {
                2 => Scale::Lane,
                1 => Scale::Words,
                _ => Scale::Unit(&signal.unit),
            };
            let columns = self.tasks.get(*task).map(|it| it.columns(*place, self.span()));
            let is_whole = matches!(signal.value_type.as_str(), "INT" | "TIME");
            let trace = Trace::new(index, &signal.name, is_whole, columns.unwrap_or_default());
            match panes.iter_mut().find(|it| it.scale == scale && scale != Scale::Lane) {
                Some(pane) => pane.traces.push(trace),
                None => panes.push(Pane::new(scale, trace)),
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
            let is_lane = pane.scale == Scale::Lane;
            pane.lay_out(y, if is_lane { LANE } else { height });
            y = pane.bottom + if is_lane { GAP / 2 } else { GAP };
        }
        panes
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
    let Span { begin_ns, end_ns, .. } = chart.span();
    let (begin_ns, end_ns) = (chart.time_ns(begin_ns), chart.time_ns(end_ns));
    let ticks = Ticks::of_times(begin_ns, end_ns, (COLUMNS / TIME_LABEL) as usize);
    for (ns, says) in &ticks.labels {
        let part = (ns - begin_ns) / (end_ns - begin_ns);
        let x = LEFT + (part * f64::from(COLUMNS)).round() as i32;
        for pane in panes {
            area.draw(&PathElement::new([(x, pane.top), (x, pane.bottom)], GRID))?;
        }
        area.draw(&PathElement::new([(x, bottom), (x, bottom + 4)], FRAME))?;
        let style = plain().pos(at(HPos::Center, VPos::Top));
        area.draw(&Text::new(says.as_str(), (x, bottom + 7), style))?;
    }
    for pane in panes {
        pane.draw(area)?;
    }
    let style = plain().pos(at(HPos::Center, VPos::Top));
    let says = format!("time in {}", ticks.unit);
    area.draw(&Text::new(says, (LEFT + COLUMNS / 2, bottom + 24), style))?;
    area.present()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(signals: &[(&str, &str, &str)], rows: &[&[f64]]) -> SignalChart {
        let mut data = Decimation::new(signals.len(), 500, 1_000_000);
        rows.iter().for_each(|row| data.push(row));
        let signal = |(place, (name, unit, value_type)): (usize, &(&str, &str, &str))| {
            let (name, unit, value_type) = ((*name).into(), (*unit).into(), (*value_type).into());
            ChartSignal { signal: TrackSignal { name, unit, value_type }, task: 0, place }
        };
        let signals = signals.iter().enumerate().map(signal).collect();
        let (zero_ns, end_ns) = (500, data.due_ns(data.rows()));
        let (title, about) = ("t".into(), "<a>".into());
        SignalChart { title, about, signals, tasks: vec![data], zero_ns, end_ns }
    }

    fn labels(chart: &SignalChart) -> Vec<String> {
        let pane = chart.panes().remove(0);
        let labels = pane.labels(pane.axis.as_ref().unwrap());
        labels.into_iter().map(|(_, says)| says).collect()
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
        let of = |pane: &Pane<'_>| pane.traces.iter().map(|trace| trace.index).collect();
        let panes: Vec<(_, Vec<_>)> = chart.panes().iter().map(|it| (it.scale, of(it))).collect();
        let expected = [
            (Scale::Unit("m"), vec![1, 3]),
            (Scale::Unit("m/s"), vec![4]),
            (Scale::Words, vec![2]),
            (Scale::Lane, vec![0]),
            (Scale::Lane, vec![5]),
        ];
        assert_eq!(format!("{panes:?}"), format!("{expected:?}"));
        let svg = signals_svg(&chart);
        for says in ["16#6001", "16#0000", "TRUE", "m/s", "pump.on", "time in us", "&lt;a&gt;"] {
            assert!(svg.contains(says), "{says}: {svg}");
        }
        assert!(!svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn what_is_no_number_has_a_bar_over_its_time_alone_and_the_legend_says_of_which_signal() {
        let rows: [&[f64]; 4] = [&[1.0, 3.0], &[f64::NAN, 3.0], &[2.0, 3.0], &[2.0, 3.0]];
        let chart = chart(&[("a", "", "LREAL"), ("b", "", "LREAL")], &rows);
        let svg = signals_svg(&chart);
        assert!(svg.contains("a (NaN or infinite under the bar)"), "{svg}");
        assert!(!svg.contains("b (NaN"), "{svg}");
        let pane = &chart.panes()[0];
        assert_eq!(
            pane.axis,
            Some(Axis::Linear(isochrone_scope::Extremes { low: 1.0, high: 3.0 }))
        );
        let (x, width) = (LEFT + COLUMNS / 4, COLUMNS / 4);
        let bar = format!("<rect x=\"{x}\" y=\"{}\" width=\"{width}\" height=\"4\"", pane.top);
        assert_eq!(svg.matches(&bar).count(), 1, "{bar}: {svg}");
    }

    #[test]
    fn a_curve_that_lies_on_another_is_dashed_and_one_that_crosses_it_is_not() {
        let rows: Vec<[f64; 4]> = (0..100).map(|i| [1.0, 1.0, f64::from(i), 1.0]).collect();
        let rows: Vec<&[f64]> = rows.iter().map(|row| row.as_slice()).collect();
        let names = ["sp", "y", "ramp", "also"].map(|name| (name, "m", "LREAL"));
        let chart = chart(&names, &rows);
        let dashes: Vec<_> = chart.panes()[0].traces.iter().map(|it| it.ink.dash).collect();
        assert!(dashes[0].is_none() && dashes[2].is_none(), "{dashes:?}");
        assert!(dashes[1].is_some() && dashes[3].is_some(), "{dashes:?}");
        assert_ne!(dashes[1], dashes[3], "all three are in sight");
    }

    #[test]
    fn whole_numbers_are_labelled_at_whole_numbers_and_every_status_word_is() {
        let int = chart(&[("n", "", "INT")], &[&[0.0], &[1.0]]);
        assert_eq!(labels(&int), ["0", "1"]);
        let mixed = chart(&[("n", "", "INT"), ("y", "", "LREAL")], &[&[0.0, 0.0], &[1.0, 0.25]]);
        assert!(labels(&mixed).contains(&"0.5".to_owned()), "{:?}", labels(&mixed));
        let words: [&[f64]; 4] = [&[24_578.0], &[0.0], &[24_580.0], &[36_608.0]];
        let words = chart(&[("s", "", "WORD")], &words);
        assert_eq!(labels(&words), ["16#0000", "16#6002", "16#6004", "16#8F00"]);
    }

    #[test]
    fn tasks_of_other_periods_and_phases_share_the_axis_of_time() {
        let mut chart = chart(&[("slow", "m", "LREAL")], &[&[1.0], &[2.0]]);
        let mut fast = Decimation::new(1, 0, 100_000);
        (0..15).for_each(|row| fast.push(&[f64::from(u8::from(row == 7))]));
        chart.tasks.push(fast);
        let (name, unit, value_type) = ("fast".into(), "m".into(), "LREAL".into());
        let signal = TrackSignal { name, unit, value_type };
        chart.signals.push(ChartSignal { signal, task: 1, place: 0 });
        assert_eq!((chart.span().begin_ns, chart.span().end_ns), (0, 2_000_500));
        let spike = &chart.panes()[0].traces[1].columns;
        let high =
            |column: &isochrone_scope::Column| column.values.is_some_and(|it| it.high == 1.0);
        let at = spike.iter().position(high).unwrap();
        assert_eq!(at, 700_000 * COLUMNS as usize / 2_000_500);
        assert!(signals_svg(&chart).contains("fast"));
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
