//! Signals, alarms and forces.

use isochrone_blocks::PinType;
use isochrone_runtime::control::{ActiveAlarm, Role, SignalDescription};
use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Cell, Row, Table};

use super::text::{NONE, cut, plain, value};
use crate::numbers::type_of;
use crate::operate::{limits, role, time};
use crate::top::cursor::Cursor;
use crate::top::input::Focus;
use crate::top::message::wrapped;
use crate::top::model::Model;
use crate::top::palette::Palette;
use crate::top::signals::{Filter, Marks};

/// Room for a value, so that the columns stay where they are while it changes.
const VALUE_WIDTH: u16 = 14;
const UNIT_WIDTH: u16 = 7;
const ROLE_WIDTH: u16 = 9;
const MARKS_WIDTH: u16 = 2;
const NAME_WIDTH_LEAST: u16 = 20;

/// Lines of signals: the filters, the heading and the description of the selected one go off.
pub(super) fn signal_rows(body: Rect) -> usize {
    usize::from(body.height.saturating_sub(3))
}

/// Lines that the selected alarm takes in words.
const ALARM_LINES: u16 = 3;

/// Lines of alarms: the heading and the selected one in words go off.
pub(super) fn alarm_rows(body: Rect) -> usize {
    usize::from(body.height.saturating_sub(1 + ALARM_LINES))
}

/// Lines of forces: the heading goes off.
pub(super) fn force_rows(body: Rect) -> usize {
    usize::from(body.height.saturating_sub(1))
}

pub(super) fn draw_signals(frame: &mut Frame<'_>, body: Rect, model: &Model, palette: Palette) {
    let areas =
        Layout::vertical([Constraint::Length(1), Constraint::Min(0), Constraint::Length(1)]);
    let [filters, list, selected] = areas.areas(body);
    frame.render_widget(filter_line(model, palette), filters);
    let beside = MARKS_WIDTH + ROLE_WIDTH + VALUE_WIDTH + UNIT_WIDTH + 5;
    let free = list.width.saturating_sub(beside);
    let names = (free * 2 / 3).max(NAME_WIDTH_LEAST);
    let traces = free.saturating_sub(names);
    let widths = [MARKS_WIDTH, names, ROLE_WIDTH, VALUE_WIDTH, UNIT_WIDTH, traces];
    let signals = &model.signals;
    let rows = signals.on_screen().map(|(signal, is_selected)| {
        let marks = signals.marks(signal);
        let style = style_of(marks, palette);
        let reading = signals.value(&signal.name);
        let reading = reading.map_or(NONE.into(), |it| value(it, &signal.value_type, VALUE_WIDTH));
        let row = Row::new([
            Cell::from(letters(marks)).style(style),
            Cell::from(cut(&plain(&signal.name), names.into()).into_owned()).style(style),
            Cell::from(role(signal.role)),
            right(reading).style(style),
            Cell::from(plain(unit(signal))),
            Cell::from(signals.trace(signal, traces.into())),
        ]);
        if is_selected { row.style(palette.selected()) } else { row }
    });
    let heading =
        ["".into(), "signal".into(), "role".into(), right("value"), "unit".into(), "trend".into()];
    frame.render_widget(table(heading, rows, widths.map(Constraint::Length), palette), list);
    if let Some(signal) = signals.selected() {
        let flags = signals.flags(&signal.name);
        frame.render_widget(description(signal, signals.marks(signal), &flags, palette), selected);
    }
}

/// The unit of a signal; a time is written with its own.
fn unit(signal: &SignalDescription) -> &str {
    let is_time = type_of(&signal.value_type) == PinType::Time;
    signal.unit.as_deref().filter(|_| !is_time).unwrap_or_default()
}

fn filter_line(model: &Model, palette: Palette) -> Line<'static> {
    let signals = &model.signals;
    let mut spans = Vec::new();
    for filter in Filter::ALL {
        let chosen = if filter == signals.filter() { palette.selected() } else { Style::default() };
        spans.extend([Span::styled(filter.as_str(), chosen), Span::raw("  ")]);
    }
    let is_typed = model.focus() == Focus::Search;
    if is_typed || !signals.search().is_empty() {
        spans.push(Span::styled(format!("/{}", plain(signals.search())), palette.heading()));
        spans.push(Span::styled(" ", if is_typed { palette.selected() } else { Style::default() }));
    }
    spans.push(Span::raw(format!(" {} of {} listed", signals.listed(), signals.total())));
    Line::from(spans)
}

/// The selected signal in words.
fn description(
    signal: &SignalDescription,
    marks: Marks,
    flags: &str,
    palette: Palette,
) -> Line<'static> {
    let mut spans = vec![Span::styled(plain(&signal.name).into_owned(), palette.heading())];
    if marks.forced {
        spans.push(Span::styled("  forced", palette.forced()));
    }
    if marks.bad {
        let word = if signal.role == Role::Input { "  not ok" } else { "  block in error" };
        spans.push(Span::styled(word, palette.bad()));
    }
    if !flags.is_empty() {
        let style = if marks.in_doubt { palette.bad() } else { palette.forced() };
        spans.push(Span::styled(format!("  {}", plain(flags)), style));
    }
    if signal.protected == Some(true) {
        spans.push(Span::styled("  protected", palette.heading()));
    }
    if let Some(range) = signal.limits {
        spans.push(Span::raw(format!("  limits {}", limits(range))));
    }
    let (value_type, task, doc) =
        (plain(&signal.value_type), plain(&signal.task), plain(&signal.doc));
    spans.push(Span::raw(format!("  {value_type}  task {task}  {doc}")));
    Line::from(spans)
}

/// `F`: forced; `!`: not ok; `?`: computed from what is not.
fn letters(marks: Marks) -> String {
    let forced = if marks.forced { 'F' } else { ' ' };
    let quality = match marks {
        Marks { bad: true, .. } => '!',
        Marks { in_doubt: true, .. } => '?',
        Marks { .. } => ' ',
    };
    [forced, quality].iter().collect()
}

fn style_of(marks: Marks, palette: Palette) -> Style {
    match marks {
        Marks { bad: true, .. } | Marks { in_doubt: true, .. } => palette.bad(),
        Marks { forced: true, .. } => palette.forced(),
        Marks { .. } => Style::default(),
    }
}

pub(super) fn draw_alarms(frame: &mut Frame<'_>, body: Rect, model: &Model, palette: Palette) {
    if model.alarms.is_empty() {
        let text = match model.node {
            Some(_) if model.lost.is_none() => "no block reports an error, and every input is ok",
            _ => "",
        };
        frame.render_widget(Line::raw(text), body);
        return;
    }
    let [list, selected] =
        Layout::vertical([Constraint::Min(0), Constraint::Length(ALARM_LINES)]).areas(body);
    let rows = lines(&model.alarms, model.alarm_cursor, palette, |alarm| {
        let status = alarm.status.map_or(NONE.into(), |status| format!("16#{status:04X}"));
        Row::new([
            Cell::from(plain(&alarm.name)).style(palette.bad()),
            Cell::from(status),
            right(alarm.since_cycle.to_string()),
            right(alarm.count.to_string()),
            Cell::from(plain(&alarm.meaning)),
        ])
    });
    let widths = [
        Constraint::Length(NAME_WIDTH_LEAST),
        Constraint::Length(7),
        Constraint::Length(12),
        Constraint::Length(6),
        Constraint::Fill(1),
    ];
    let heading = [
        "block or input".into(),
        "status".into(),
        right("since cycle"),
        right("times"),
        "meaning".into(),
    ];
    frame.render_widget(table(heading, rows, widths, palette), list);
    if let Some(alarm) = model.alarms.get(model.alarm_cursor.selected()) {
        let text = wrapped(&in_words(alarm), selected.width.into());
        frame.render_widget(Text::from_iter(text), selected);
    }
}

/// The selected alarm, whole.
fn in_words(alarm: &ActiveAlarm) -> String {
    let ActiveAlarm { name, task, since_cycle, meaning, .. } = alarm;
    let since = alarm.since_unix_ns.map_or_else(String::new, |ns| format!(", {}", time(ns)));
    let text = format!("{name}  task {task}, since cycle {since_cycle}{since}: {meaning}");
    plain(&text).into_owned()
}

pub(super) fn draw_forces(frame: &mut Frame<'_>, body: Rect, model: &Model, palette: Palette) {
    if model.forces.is_empty() {
        let text = match model.node {
            Some(_) if model.lost.is_none() => "nothing is forced",
            _ => "",
        };
        frame.render_widget(Line::raw(text), body);
        return;
    }
    let rows = lines(&model.forces, model.force_cursor, palette, |force| {
        let signal = model.signals.find(&force.name);
        let value_type = signal.map_or("LREAL", |signal| signal.value_type.as_str());
        let until = force.until_cycle.map_or("released".into(), |cycle| cycle.to_string());
        Row::new([
            Cell::from(plain(&force.name)).style(palette.forced()),
            right(value(force.value, value_type, VALUE_WIDTH)).style(palette.forced()),
            right(force.since_cycle.to_string()),
            right(until),
            Cell::from(plain(force.client.as_deref().unwrap_or(NONE))),
        ])
    });
    let widths = [
        Constraint::Fill(1),
        Constraint::Length(VALUE_WIDTH),
        Constraint::Length(12),
        Constraint::Length(12),
        Constraint::Length(16),
    ];
    let heading = [
        "signal".into(),
        right("forced to"),
        right("since cycle"),
        right("until cycle"),
        "by".into(),
    ];
    frame.render_widget(table(heading, rows, widths, palette), body);
}

/// The lines of a list that are on the screen.
fn lines<'a, T>(
    items: &'a [T],
    cursor: Cursor,
    palette: Palette,
    row: impl Fn(&'a T) -> Row<'a>,
) -> impl Iterator<Item = Row<'a>> {
    let window = cursor.window();
    let shown = items.get(window.clone()).unwrap_or_default();
    window.zip(shown).map(move |(line, item)| {
        let row = row(item);
        if line == cursor.selected() { row.style(palette.selected()) } else { row }
    })
}

/// A table with a heading.
pub(super) fn table<'a, const N: usize>(
    heading: [Cell<'a>; N],
    rows: impl Iterator<Item = Row<'a>>,
    widths: [Constraint; N],
    palette: Palette,
) -> Table<'a> {
    let heading = Row::new(heading).style(palette.heading());
    Table::new(rows, widths).header(heading).column_spacing(1)
}

/// A number in its column.
pub(super) fn right<'a>(text: impl Into<Text<'a>>) -> Cell<'a> {
    Cell::from(text.into().alignment(Alignment::Right))
}
