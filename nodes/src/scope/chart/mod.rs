//! A shot as lines of text: a band for each signal, over one axis of times.

mod band;
mod grid;
mod heights;
mod plot;

use isochrone_scope::{Shot, Ticks};

use self::band::Band;
pub(super) use self::grid::{Grid, Ink};
use self::heights::{Heights, Kind};
use self::plot::Plot;
use crate::top::cut;

/// The least that a chart is drawn for: columns and lines.
pub(super) const LEAST: (usize, usize) = (40, 10);
/// Heading, and the axis with its labels.
const HEADING: usize = 2;
const AXIS: usize = 2;
/// Columns between two labels of times.
const LABEL: usize = 10;

/// Stands on the axis where a task missed cycles.
pub(super) const MISSED: char = '×';

/// The heading above the bands.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Heading {
    /// What the chart shows, and around which instant.
    pub(super) title: String,
    /// The time of the shot, and remarks.
    pub(super) about: String,
}

/// What becomes of bands that a terminal has no lines for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surplus {
    /// The chart has more lines than the terminal.
    Drawn,
    /// They are left out, which the heading mentions.
    LeftOut,
}

/// Draws a shot for a terminal of this size.
pub(super) fn draw(
    shot: &Shot,
    heading: &Heading,
    (columns, rows): (usize, usize),
    surplus: Surplus,
) -> Grid {
    let (columns, rows) = (columns.max(LEAST.0), rows.max(LEAST.1));
    let mut bands: Vec<Band<'_>> = Vec::new();
    for track in &shot.tracks {
        let places = 0..track.signals.len();
        bands.extend(places.filter_map(|place| Band::of(shot, track, place)));
    }
    let room = rows.saturating_sub(HEADING + AXIS);
    let all = bands.len();
    let mut kinds: Vec<Kind> = bands.iter().map(Band::kind).collect();
    if surplus == Surplus::LeftOut {
        while kinds.len() > 1 && Heights::of(&kinds, room).total() > room {
            kinds.pop();
        }
    }
    bands.truncate(kinds.len());
    let widest = bands.iter().map(Band::label_width).max().unwrap_or(0);
    // Names are cut before the curves have less than half of the terminal.
    let gutter = widest.clamp(6, (columns / 2).saturating_sub(2).max(6));
    let plot = Plot { left: gutter + 2, width: columns.saturating_sub(gutter + 2).max(1) };
    let heights = Heights::of(&kinds, room);
    let height = HEADING + heights.total() + AXIS;
    let mut grid = Grid::new(columns, height);
    grid.text(0, 0, &cut(&heading.title, columns), Ink::Heading);
    let about = match bands.len() {
        shown if shown < all => {
            format!(
                "{shown} of {all} signals: name fewer or enlarge the terminal; {}",
                heading.about
            )
        }
        _ => heading.about.clone(),
    };
    grid.text(0, 1, &cut(&about, columns), Ink::Text);
    let mut top = HEADING;
    for (index, (band, height)) in bands.iter_mut().zip(heights.each()).enumerate() {
        band.draw(&mut grid, shot, plot, (top, height), Ink::Band(index));
        top += height + heights.between;
    }
    axis(&mut grid, shot, plot, height - AXIS);
    grid
}

/// The axis of times, with the trigger at 0, and where tasks missed cycles.
fn axis(grid: &mut Grid, shot: &Shot, plot: Plot, top: usize) {
    let zero_ns = shot.zero_ns() as f64;
    let (begin_ns, end_ns) = (shot.begin_ns as f64 - zero_ns, shot.end_ns as f64 - zero_ns);
    let ticks = Ticks::of_times(begin_ns, end_ns, plot.width / LABEL);
    grid.text(plot.left - 1, top, "└", Ink::Axis);
    grid.text(plot.left, top, &"─".repeat(plot.width), Ink::Axis);
    grid.text_before(plot.left - 2, top + 1, ticks.unit, Ink::Axis);
    let mut free_from = plot.left - 1;
    for (ns, says) in ticks.labels {
        let part = (ns - begin_ns) / (end_ns - begin_ns).max(1.0);
        let column = ((part * plot.width as f64) as usize).min(plot.width - 1) + plot.left;
        grid.text(column, top, "┬", Ink::Axis);
        // Under its tick, but not beyond the end, and not over the label before.
        let width = says.chars().count();
        let end = plot.left + plot.width;
        let at = column.saturating_sub(width.saturating_sub(1) / 2).min(end.saturating_sub(width));
        if at >= free_from {
            grid.text(at, top + 1, &says, Ink::Axis);
            free_from = at + width + 1;
        }
    }
    let missed = shot.tracks.iter().flat_map(|track| shot.missed(track));
    for gap in missed {
        let last = plot.column(shot, gap.end_ns.saturating_sub(1));
        (plot.column(shot, gap.begin_ns)..=last).for_each(|at| grid.put(at, top, MISSED, Ink::Odd));
    }
    if let Some(trigger) = &shot.trigger {
        grid.text(plot.column(shot, trigger.release_ns), top, "▲", Ink::Trigger);
    }
}

#[cfg(test)]
mod tests {
    use isochrone_scope::{Head, Rows, Track, TrackSignal, Triggered};

    use super::*;

    const MS: u64 = 1_000_000;

    /// So many signals: a ramp with a spike, and every other one a BOOL.
    fn shot(signals: usize, name: &str) -> Shot {
        let signal = |place: usize| TrackSignal {
            name: format!("{name}{place}"),
            unit: "m".into(),
            value_type: if place % 2 == 1 { "BOOL".into() } else { "LREAL".into() },
        };
        let mut rows = Rows::new(signals);
        for cycle in (0..1_200)
            .filter(|cycle| !(700..800).contains(cycle) && !(1_080..1_100).contains(cycle))
        {
            let lost = if cycle == 800 { 100 } else { 0 };
            let missed = if cycle == 1_100 { 20 } else { 0 };
            let head = Head { cycle, release_ns: cycle * MS, lost, missed };
            let value = |place: usize| match (place % 2, cycle) {
                (1, _) => f64::from(u8::from(cycle % 300 < 150)),
                (_, 500) => 3.0,
                (_, 1_000) => f64::NAN,
                _ => cycle as f64 / 1_200.0,
            };
            rows.push(head, &(0..signals).map(value).collect::<Vec<_>>());
        }
        let period_ns = Some(MS);
        let signals = (0..signals).map(signal).collect();
        let trigger = Triggered {
            release_ns: 200 * MS,
            signal: format!("{name}0"),
            level: Some(2.0),
            ..Triggered::default()
        };
        let tracks =
            vec![Track { task: "fast".into(), period_ns, signals, rows, ..Track::default() }];
        let (begin_ns, end_ns) = (0, 1_200 * MS);
        Shot { node: "n".into(), tracks, trigger: Some(trigger), begin_ns, end_ns }
    }

    fn drawn(shot: &Shot, size: (usize, usize)) -> String {
        let heading = Heading { title: "level".into(), about: "cycle 5".into() };
        draw(shot, &heading, size, Surplus::Drawn).plain()
    }

    #[test]
    fn a_chart_is_as_wide_and_as_high_as_its_terminal_and_higher_only_for_more_signals() {
        let long = "cooling_water_return_temperature_limiter.";
        for (name, signals) in [("y", 1), ("y", 4), (long, 6)] {
            for (columns, rows) in [(80, 23), (120, 39), (40, 10), (200, 60)] {
                let text = drawn(&shot(signals, name), (columns, rows));
                let widths = text.lines().map(|line| line.chars().count());
                assert!(widths.max() <= Some(columns), "{text}");
                let fits = text.lines().count() <= rows;
                assert!(fits || rows < 12, "{signals} signals on {rows} lines:\n{text}");
            }
        }
        let text = drawn(&shot(64, "y"), (80, 23));
        assert!((0..64).all(|place| text.contains(&format!("y{place}"))), "{text}");
    }

    #[test]
    fn what_a_screen_has_no_lines_for_is_left_out_and_counted() {
        let on_screen = |signals| {
            let heading = Heading { title: "level".into(), about: "cycle 5".into() };
            draw(&shot(signals, "y"), &heading, (80, 23), Surplus::LeftOut).plain()
        };
        let text = on_screen(64);
        assert_eq!(text.lines().count(), 23, "{text}");
        let shown = (0..64).filter(|place| text.contains(&format!("y{place} "))).count();
        let says = format!("{shown} of 64 signals: name fewer or enlarge the terminal; cycle 5");
        assert!(shown > 8 && text.contains(&says) && text.contains("ms"), "{shown}\n{text}");
        assert!(!on_screen(6).contains("of 6 signals"), "{}", on_screen(6));
    }

    #[test]
    fn a_chart_shows_a_spike_the_trigger_a_gap_missed_cycles_and_what_is_no_number() {
        let text = drawn(&shot(2, "y"), (80, 23));
        for sign in ["▲", "┊", "░", "?", "×", "3 m", "0 m", "y0", "y1", "ms", "-200", "1000"]
        {
            assert!(text.contains(sign), "{sign}\n{text}");
        }
        let spike = text.lines().find(|line| line.contains("3 m")).unwrap();
        assert!(spike.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "{text}");
    }

    #[test]
    fn a_chart_of_nothing_is_an_axis() {
        assert!(drawn(&Shot::default(), (80, 23)).contains('└'));
        let mut empty = shot(1, "y");
        empty.tracks[0].rows = Rows::new(1);
        assert!(drawn(&empty, (80, 23)).contains("no values"));
    }
}
