//! A picture of signals around an instant.

pub(super) mod band;

use isochrone_scope::{Shot, Span, Ticks};
use isochrone_timing::units::counted;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use self::band::{
    Band, DASH, FRAME, GAP, GRID, LEFT, LETTERS, RIGHT, SHADE, TOP, TRIGGER, WIDTH, bands, plain,
};
use super::canvas::{self, Canvas, Failure};
use super::ink::Ink;
use super::legend::shortened;
use super::screen::Screen;

/// The pixel at which curves begin.
pub(in crate::output) const FIRST_COLUMN: i32 = LEFT;

/// The axis of times, what it says, and the notes.
const BOTTOM: i32 = 66;
/// Between two labels of times.
const TIME_LABEL: i32 = 80;

/// Draws each signal of a shot in a band of its own, over one axis of times that counts from the trigger.
/// Each pixel has the least and the greatest value of its time; times without values are shaded. Below the
/// title, which should say what the shot is of, stands `about`.
pub fn shot_svg(title: &str, about: &str, shot: &Shot) -> String {
    let (bands, below) = bands(shot);
    let height = below + BOTTOM;
    let size = (WIDTH as u32, height as u32);
    canvas::svg(size, |area| draw(area, (title, about), shot, &bands, height))
}

fn draw(
    area: &Canvas<'_>,
    (title, about): (&str, &str),
    shot: &Shot,
    bands: &[Band<'_>],
    height: i32,
) -> Result<(), Failure> {
    area.fill(&WHITE)?;
    let at = |horizontal, vertical| Pos::new(horizontal, vertical);
    let heading = ("sans-serif", Screen::Wide.title_size(), FontStyle::Bold);
    let heading = heading.into_font().color(&BLACK).pos(at(HPos::Left, VPos::Top));
    area.draw(&Text::new(shortened(title, Screen::Wide.title_letters()), (16, 12), heading))?;
    let about = shortened(about, LETTERS + 20);
    area.draw(&Text::new(about, (16, 36), plain().pos(at(HPos::Left, VPos::Top))))?;

    let (zero_ns, bottom) = (shot.zero_ns(), height - BOTTOM);
    let span = Span::of(shot, (WIDTH - LEFT - RIGHT) as usize);
    let after = |ns: u64| ns as f64 - zero_ns as f64;
    let most = (WIDTH - LEFT - RIGHT) / TIME_LABEL;
    let ticks = Ticks::of_times(after(shot.begin_ns), after(shot.end_ns), most as usize);
    let length_ns = shot.duration_ns().max(1) as f64;
    for (ns, says) in &ticks.labels {
        let part = (ns - after(shot.begin_ns)) / length_ns;
        let x = LEFT + (part * span.columns as f64).round() as i32;
        for band in bands {
            area.draw(&PathElement::new([(x, band.top), (x, band.bottom)], GRID))?;
        }
        area.draw(&PathElement::new([(x, bottom - GAP), (x, bottom - GAP + 4)], FRAME))?;
        let style = plain().pos(at(HPos::Center, VPos::Top));
        area.draw(&Text::new(says.as_str(), (x, bottom), style))?;
    }
    for (index, band) in bands.iter().enumerate() {
        // Colours only: where they begin again, names tell the bands apart.
        band.draw(area, shot, Ink::of(index).solid())?;
    }
    let from = if shot.trigger.is_some() { "the trigger" } else { "the first cycle" };
    let says = format!("time from {from}, in {}", ticks.unit);
    let centre = LEFT + (WIDTH - LEFT - RIGHT) / 2;
    area.draw(&Text::new(says, (centre, bottom + 18), plain().pos(at(HPos::Center, VPos::Top))))?;
    if let Some(trigger) = &shot.trigger {
        let x = LEFT + span.column(trigger.release_ns) as i32;
        let line = [(x, TOP + 2), (x, bottom - GAP)];
        area.draw(&DashedPathElement::new(line, DASH.0, DASH.1, TRIGGER))?;
        area.draw(&Polygon::new([(x - 5, TOP - 5), (x + 5, TOP - 5), (x, TOP + 2)], TRIGGER))?;
    }
    let notes = notes(shot, bands);
    if !notes.is_empty() {
        let swatch = [(LEFT, bottom + 42), (LEFT + 14, bottom + 54)];
        if notes.starts_with(NO_VALUES) {
            area.draw(&Rectangle::new(swatch, SHADE.filled()))?;
        }
        let style = plain().pos(at(HPos::Left, VPos::Center));
        area.draw(&Text::new(notes, (LEFT + 20, bottom + 48), style))?;
    }
    area.present()
}

const NO_VALUES: &str = "no values";

/// What the shades and the red ticks mean, as far as there are some.
fn notes(shot: &Shot, bands: &[Band<'_>]) -> String {
    let columns = || bands.iter().flat_map(|band| &band.columns);
    let mut notes = Vec::new();
    let (lost, missed) = shot.missing();
    if columns().any(|column| column.is_gap) {
        let why =
            if lost > 0 { format!(": {} lost", counted(lost, "cycle")) } else { String::new() };
        notes.push(format!("{NO_VALUES}{why}"));
    }
    if missed > 0 {
        notes.push(format!("red below a curve: {} missed by the task", counted(missed, "cycle")));
    }
    if columns().any(|column| column.is_odd) {
        notes.push("red ticks above a curve: NaN or infinite".to_owned());
    }
    notes.join("; ")
}

#[cfg(test)]
mod tests {
    use isochrone_scope::{Head, Rows, Track, TrackSignal, Triggered};

    use super::*;

    /// Some cycles of a sine with a spike, a gap and a NaN, and of a BOOL.
    fn shot(cycles: u64) -> Shot {
        let mut rows = Rows::new(2);
        for cycle in
            (0..cycles).filter(|cycle| !(600..650).contains(cycle) && !(950..952).contains(cycle))
        {
            let lost = if cycle == 650 { 50 } else { 0 };
            let missed = if cycle == 952 { 2 } else { 0 };
            let head = Head { cycle, release_ns: cycle * 1_000_000, lost, missed };
            let value = match cycle {
                300 => 9.0,
                900 => f64::NAN,
                _ => (cycle as f64 / 50.0).sin(),
            };
            rows.push(head, &[value, f64::from(u8::from(cycle % 200 < 100))]);
        }
        let signal = |name: &str, unit: &str, value_type: &str| TrackSignal {
            name: name.into(),
            unit: unit.into(),
            value_type: value_type.into(),
        };
        let signals = vec![signal("ramp.y<&>", "m", "LREAL"), signal("pump.on", "", "BOOL")];
        let period_ns = Some(1_000_000);
        let track = Track { task: "fast".into(), period_ns, signals, rows, ..Track::default() };
        let trigger = Triggered {
            release_ns: 200_000_000,
            signal: "ramp.y<&>".into(),
            level: Some(0.5),
            ..Triggered::default()
        };
        let end_ns = cycles * 1_000_000;
        let trigger = Some(trigger);
        Shot { node: "n".into(), tracks: vec![track], trigger, begin_ns: 0, end_ns }
    }

    #[test]
    fn a_picture_names_its_signals_and_says_what_is_shaded() {
        let svg = shot_svg("level, 1 ms", "trigger: ramp.y > 0.5", &shot(1_000));
        for says in [
            "level, 1 ms",
            "trigger: ramp.y &gt; 0.5",
            "ramp.y&lt;&amp;&gt; in m",
            "pump.on",
            "TRUE",
            "time from the trigger, in ms",
            "no values: 50 cycles lost",
            "2 cycles missed by the task",
            "NaN or infinite",
        ] {
            assert!(svg.contains(says), "{says}: {svg}");
        }
        let whole = shot_svg("", "", &shot(500));
        assert!(
            !whole.contains("no values") && !whole.contains("NaN") && !whole.contains("missed"),
            "{whole}"
        );
    }

    #[test]
    fn a_picture_is_xml_whatever_a_signal_is_called() {
        let mut odd = shot(10);
        odd.tracks[0].signals[0].name = "a\u{fffe}b\u{ffff}c\u{1}d\u{1f600}".into();
        let svg = shot_svg("", "", &odd);
        assert!(svg.contains("a\u{fffd}b\u{fffd}c\u{fffd}d\u{1f600}"), "{svg}");
    }

    #[test]
    fn a_curve_that_cannot_be_drawn_is_a_word() {
        let mut odd = shot(0);
        odd.end_ns = 3_000_000;
        for cycle in 0..3 {
            let head = Head { cycle, release_ns: cycle * 1_000_000, ..Head::default() };
            odd.tracks[0].rows.push(head, &[f64::NEG_INFINITY, 0.0]);
        }
        assert!(shot_svg("", "", &odd).contains("infinite\n</text>"), "{}", shot_svg("", "", &odd));
    }

    #[test]
    fn a_picture_of_many_cycles_is_no_larger_than_its_pixels_need() {
        let large = shot_svg("", "", &shot(200_000));
        assert!(large.len() < 60_000, "{}", large.len());
        assert!(large.len() < 2 * shot_svg("", "", &shot(2_000)).len());
    }

    #[test]
    fn a_picture_of_nothing_is_an_empty_frame() {
        assert!(shot_svg("", "", &Shot::default()).contains("</svg>"));
        let mut empty = shot(0);
        empty.end_ns = 1_000;
        assert!(shot_svg("", "", &empty).contains("no values"));
        let mut widest = shot(10);
        widest.tracks[0].rows.push(Head::default(), &[1.7e308, 0.0]);
        widest.tracks[0].rows.push(Head::default(), &[-1.7e308, f64::INFINITY]);
        assert!(shot_svg("", "", &widest).contains("</svg>"));
    }
}
