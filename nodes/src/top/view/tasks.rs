//! Tasks and the timing of their cycles.

use isochrone_control::{Followed, LastSecond, TaskDescription};
use isochrone_timing::units::{duration, period, three_digits};
use isochrone_timing::{CycleStartCounts, Summary};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Text};
use ratatui::widgets::{Cell, Row};

use super::lists::{right, table};
use super::text::{NONE, cut_name, plain};
use crate::base::session::{FollowWindow, Window};
use crate::base::twins::twins;
use crate::top::model::Model;
use crate::top::palette::Palette;

const NAME_WIDTH: u16 = 13;
/// Of a count of cycles and of how many they are.
const SHOWN_WIDTH: u16 = 12;
/// Of a time with three digits and its unit.
const TIME_WIDTH: u16 = 8;
/// Of a count of cycles that began in one way.
const COUNT_WIDTH: u16 = 9;
/// Of a median with its heading.
const MEDIAN_WIDTH: u16 = 11;
/// The page's lines besides those of tasks and of a redundant node: two headings, two blank ones, one above the columns
/// of the jitter, and two of explanation.
const OTHER_LINES: u16 = 7;

/// Lines above the tasks that follow: a blank one and two headings.
const FOLLOW_LINES: u16 = 3;

/// The cycles that the timing covers, and those that it does not.
const EXPLANATION: [&str; 2] = [
    "CPU and the jitter of the last second are of all cycles, that of the minute of those",
    "which telemetry shows, at most 50 a second. \"-\": too few cycles, or none so far.",
];

/// Lines of tasks on their page, which has each task twice.
pub(super) fn rows(body: Rect, model: &Model) -> usize {
    usize::from(body.height.saturating_sub(other_lines(model)) / 2).max(1)
}

fn other_lines(model: &Model) -> u16 {
    OTHER_LINES + height(&twin_lines(model))
}

/// The processes of a redundant node, and a blank line.
fn twin_lines(model: &Model) -> Vec<String> {
    let redundancy = model.node.as_ref().and_then(|node| node.redundancy.as_deref());
    let lines = redundancy.map(twins).unwrap_or_default();
    lines.into_iter().chain(redundancy.map(|_| String::new())).collect()
}

fn height(lines: &[String]) -> u16 {
    u16::try_from(lines.len()).unwrap_or(u16::MAX)
}

/// How many lines there are for the tasks that follow a service: as many as they take where all others have
/// their place on the page, and else none.
fn follow_lines(body: Rect, model: &Model) -> u16 {
    let tasks = model.node.as_ref().map_or(&[][..], |node| &node.tasks);
    let following = following(tasks).count();
    let lines = following + usize::from(FOLLOW_LINES);
    let taken = 2 * tasks.len() + usize::from(other_lines(model));
    let has_room = following > 0 && taken + lines <= body.height.into();
    u16::try_from(lines).ok().filter(|_| has_room).unwrap_or_default()
}

/// The tasks that follow a service, and what they follow.
fn following(tasks: &[TaskDescription]) -> impl Iterator<Item = (&TaskDescription, &Followed)> {
    tasks.iter().filter_map(|task| Some((task, task.placement.as_ref()?.follow.as_ref()?)))
}

/// Height of the tasks below the signals.
pub(super) fn height_below(model: &Model, height: u16) -> u16 {
    let tasks = model.node.as_ref().map_or(0, |node| node.tasks.len());
    let wanted = u16::try_from(tasks).unwrap_or(u16::MAX).saturating_add(3);
    if tasks == 0 { 0 } else { wanted.min(height / 4) }
}

pub(super) fn draw(frame: &mut Frame<'_>, body: Rect, model: &Model, palette: Palette) {
    let shown = u16::try_from(shown(model).len()).unwrap_or(u16::MAX);
    let follow_lines = follow_lines(body, model);
    let twin_lines = twin_lines(model);
    let areas = Layout::vertical([
        Constraint::Length(height(&twin_lines)),
        Constraint::Length(shown + 2),
        Constraint::Length(shown + 3),
        Constraint::Length(follow_lines),
        Constraint::Length(2),
    ]);
    let [twins, counts, jitter, follow, explanation] = areas.areas(body);
    frame.render_widget(Text::from_iter(twin_lines), twins);
    draw_counts(frame, counts, model, palette);
    draw_jitter(frame, jitter, model, palette);
    if follow_lines > 0 {
        draw_follow(frame, follow, model, palette);
    }
    frame.render_widget(Text::from_iter(EXPLANATION), explanation);
}

fn shown(model: &Model) -> &[TaskDescription] {
    let tasks = model.node.as_ref().map_or(&[][..], |node| &node.tasks);
    tasks.get(model.task_cursor.window()).unwrap_or(tasks)
}

fn draw_counts(frame: &mut Frame<'_>, area: Rect, model: &Model, palette: Palette) {
    let rows = shown(model).iter().map(|task| {
        let second = task.last_second.as_ref();
        let count = |count: u64| {
            let cell = right(count.to_string());
            if count > 0 { cell.style(palette.bad()) } else { cell }
        };
        let last = task.last_cycle.unwrap_or(task.cycle).to_string();
        let stands =
            |ns: u64| right(format!("stands {} s", ns / 1_000_000_000)).style(palette.bad());
        let cycle = task.stands_ns.map_or_else(|| right(last), stands);
        Row::new([
            Cell::from(plain(&task.name)),
            right(period(task.period_ns)),
            cycle,
            count(task.missed),
            count(task.overruns),
            right(task.forces.to_string()),
            right(cpu(second, task.period_ns)),
            right(second.map_or(NONE.into(), |second| second.cycles.to_string())),
        ])
    });
    let heading = [
        "task".into(),
        right("period"),
        right("cycle"),
        right("missed"),
        right("overruns"),
        right("forces"),
        right("CPU"),
        right("cycles, 1 s"),
    ];
    let widths = [NAME_WIDTH, TIME_WIDTH, 12, 7, 8, 6, 6, SHOWN_WIDTH].map(Constraint::Length);
    frame.render_widget(table(heading, rows, widths, palette), area);
}

/// The jitter of each task's releases.
pub(super) fn draw_jitter(frame: &mut Frame<'_>, area: Rect, model: &Model, palette: Palette) {
    let [title, list] = Layout::vertical([Constraint::Length(1), Constraint::Min(0)]).areas(area);
    let columns = usize::from(TIME_WIDTH) * 3 + 2;
    let (second, minute) = ("1 s of all cycles", "1 min of shown cycles");
    let text = format!(
        "{:<width$} {second:^columns$} {minute:^columns$}",
        "jitter",
        width = NAME_WIDTH.into()
    );
    frame.render_widget(Line::styled(text, palette.heading()), title);
    let rows = shown(model).iter().map(|task| {
        let minute = model.windows(&task.name).minute;
        let second = task.last_second.as_ref().map(|second| second.release_jitter_ns);
        let times = |jitter: Summary| {
            [jitter.p50, jitter.p99, jitter.max]
                .map(|ns| right(ns.map_or(NONE.into(), |ns| duration(ns as f64))))
        };
        let name = Cell::from(plain(&task.name));
        let cells = [name].into_iter().chain(times(second.unwrap_or_default()));
        let cells = cells.chain(times(minute.jitter));
        Row::new(cells.chain([right(shown_of(&minute))]))
    });
    let heading = [
        "task".into(),
        right("p50"),
        right("p99"),
        right("max"),
        right("p50"),
        right("p99"),
        right("max"),
        right("shown, 1 min"),
    ];
    let [second, minute] = [[TIME_WIDTH; 3]; 2];
    let widths = [[NAME_WIDTH].as_slice(), &second, &minute, &[SHOWN_WIDTH]].concat();
    let widths: [u16; 8] = widths.try_into().unwrap_or_default();
    frame.render_widget(table(heading, rows, widths.map(Constraint::Length), palette), list);
}

/// How the cycles of tasks that follow a service began within the last second.
fn draw_follow(frame: &mut Frame<'_>, area: Rect, model: &Model, palette: Palette) {
    let [title, list] = Layout::vertical([Constraint::Length(1), Constraint::Min(0)]).areas(area);
    let columns = usize::from(COUNT_WIDTH) * 3 + 2;
    let times = usize::from(MEDIAN_WIDTH) * 2 + 1;
    let (all, shown_ones) = ("1 s of all cycles", "1 s of shown cycles");
    let text = format!(
        "{:<width$} {all:^columns$} {shown_ones:^times$}",
        "follow",
        width = NAME_WIDTH.into()
    );
    frame.render_widget(Line::styled(text.clone(), palette.heading()), title);
    let service = usize::from(area.width).saturating_sub(text.chars().count() + 1);
    let rows = following(shown(model)).map(|(task, followed)| {
        let second = model.windows(&task.name).second;
        let count = |count: fn(CycleStartCounts) -> u64| {
            right(second.map_or(NONE.into(), |second| count(second.begun).to_string()))
        };
        let median = |ns: fn(FollowWindow) -> Option<u64>| {
            right(second.and_then(ns).map_or(NONE.into(), |ns| duration(ns as f64)))
        };
        Row::new([
            Cell::from(plain(&task.name)),
            count(|begun| begun.followed),
            count(|begun| begun.found_ready),
            count(|begun| begun.timed_out),
            median(|second| second.wait_ns),
            median(|second| second.latency_ns),
            Cell::from(cut_name(&plain(&followed.service), service).into_owned()),
        ])
    });
    let heading = [
        "task".into(),
        right("followed"),
        right("ready"),
        right("timed out"),
        right("wait p50"),
        right("latency p50"),
        "service".into(),
    ];
    let [name, count, median] = [NAME_WIDTH, COUNT_WIDTH, MEDIAN_WIDTH].map(Constraint::Length);
    let widths = [name, count, count, count, median, median, Constraint::Min(0)];
    frame.render_widget(table(heading, rows, widths, palette), list);
}

/// The part of its period that a task's cycles take.
fn cpu(second: Option<&LastSecond>, period_ns: u64) -> String {
    let second = second.filter(|_| period_ns > 0);
    let part = second.map(|second| second.execution_ns / period_ns as f64);
    part.map_or(NONE.into(), |part| format!("{}%", three_digits(part * 100.0)))
}

/// How many cycles the figures rest on, of how many there were.
fn shown_of(window: &Window) -> String {
    if window.shown == 0 { NONE.into() } else { format!("{}/{}", window.shown, window.cycles) }
}
