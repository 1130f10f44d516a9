//! Signals, alarms and forces.

use isochrone_blocks::PinType;
use isochrone_control::{ActiveAlarm, AlarmMoment, Force, ProcessAlarm, Role, SignalDescription};
use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Cell, Row, Table};

use super::text::{NONE, cut, cut_line, cut_name, plain, value};
use crate::base::numbers::type_of;
use crate::base::session::Marks;
use crate::operate::{limits, moment, role, state, time};
use crate::top::cursor::Cursor;
use crate::top::input::Focus;
use crate::top::message::wrapped;
use crate::top::model::Model;
use crate::top::palette::Palette;
use crate::top::signals::Filter;

/// Room for a value, so that the columns stay where they are while it changes.
const VALUE_WIDTH: u16 = 14;
const UNIT_WIDTH: u16 = 7;
const ROLE_WIDTH: u16 = 9;
const MARKS_WIDTH: u16 = 2;
const NAME_WIDTH_LEAST: u16 = 20;
const TRACE_WIDTH_LEAST: u16 = 8;
/// Of a month, a day and a time to the second.
const SINCE_WIDTH: u16 = 14;
const TASK_WIDTH: u16 = 10;

/// Lines of signals: the filters, the heading and the description of the selected one go off.
pub(super) fn signal_rows(body: Rect) -> usize {
    usize::from(body.height.saturating_sub(3))
}

/// The selected alarm in words, on at most half of the page.
fn selected_alarm(body: Rect, model: &Model) -> Vec<String> {
    let selected = model.alarm_cursor.selected();
    let process = model.process.get(selected).map(process_in_words);
    let of_node = || model.alarms.get(selected.checked_sub(model.process.len())?).map(in_words);
    let selected = process.or_else(of_node);
    let (width, most) = (usize::from(body.width), usize::from(body.height / 2).max(1));
    let mut lines = selected.map_or_else(Vec::new, |words| wrapped(&words, width));
    if lines.len() > most {
        let rest = lines.split_off(most - 1).join(" ");
        lines.push(cut(&rest, width).into_owned());
    }
    lines
}

/// Lines of alarms: the heading and the selected one in words go off.
pub(super) fn alarm_rows(body: Rect, model: &Model) -> usize {
    usize::from(body.height).saturating_sub(1 + selected_alarm(body, model).len())
}

const LEFT_WIDTH: u16 = 9;
const CLIENT_WIDTH: u16 = 14;

/// Lines of forces: the heading and the selected one in words go off.
pub(super) fn force_rows(body: Rect) -> usize {
    usize::from(body.height.saturating_sub(2))
}

pub(super) fn draw_signals(frame: &mut Frame<'_>, body: Rect, model: &Model, palette: Palette) {
    let areas =
        Layout::vertical([Constraint::Length(1), Constraint::Min(0), Constraint::Length(1)]);
    let [filters, list, selected] = areas.areas(body);
    frame.render_widget(filter_line(model, palette), filters);
    let beside = MARKS_WIDTH + ROLE_WIDTH + VALUE_WIDTH + UNIT_WIDTH + 5;
    let free = list.width.saturating_sub(beside);
    let longest = u16::try_from(model.signals.longest_name()).unwrap_or(u16::MAX);
    // Long names take of the trend what they need; the trend takes what short ones leave.
    let names = longest.min(free.saturating_sub(TRACE_WIDTH_LEAST)).max(NAME_WIDTH_LEAST);
    let traces = free.saturating_sub(names);
    let widths = [MARKS_WIDTH, names, ROLE_WIDTH, VALUE_WIDTH, UNIT_WIDTH, traces];
    let signals = &model.signals;
    let rows = signals.on_screen().map(|(signal, is_selected)| {
        let marks = signals.marks(signal);
        let style = style_of(marks, palette);
        let reading = signals.value(&signal.name);
        let reading = reading.map_or(NONE.into(), |it| value(it, &signal.value_type, VALUE_WIDTH));
        let row = Row::new([
            Cell::from(String::from_iter(marks.letters())).style(style),
            Cell::from(cut_name(&plain(&signal.name), names.into()).into_owned()).style(style),
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
        let text = description(signal, signals.marks(signal), &flags, palette);
        frame.render_widget(cut_line(text, selected.width.into()), selected);
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
) -> Vec<Span<'static>> {
    let mut spans = vec![Span::styled(plain(&signal.name).into_owned(), palette.heading())];
    if marks.forced {
        spans.push(Span::styled("  forced", palette.forced()));
    }
    if marks.bad {
        let is_of_input = matches!(signal.role, Role::Input | Role::Ok);
        let word = if is_of_input { "  not ok" } else { "  block in error" };
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
    let purpose = signal.purpose();
    let (value_type, task, purpose) =
        (plain(&signal.value_type), plain(&signal.task), plain(&purpose));
    spans.push(Span::raw(format!("  {value_type}  task {task}  {purpose}")));
    spans
}

fn style_of(marks: Marks, palette: Palette) -> Style {
    match marks {
        Marks { bad: true, .. } | Marks { in_doubt: true, .. } => palette.bad(),
        Marks { forced: true, .. } | Marks { from_forced: true, .. } => palette.forced(),
        Marks { .. } => Style::default(),
    }
}

pub(super) fn draw_alarms(frame: &mut Frame<'_>, body: Rect, model: &Model, palette: Palette) {
    if model.count_alarms() == 0 {
        let text = match model.node {
            Some(_) if model.lost.is_none() => "nothing is wrong",
            _ => "",
        };
        frame.render_widget(Line::raw(text), body);
        return;
    }
    let words = selected_alarm(body, model);
    let height = u16::try_from(words.len()).unwrap_or(u16::MAX);
    let [list, selected] =
        Layout::vertical([Constraint::Min(0), Constraint::Length(height)]).areas(body);
    let meanings = list.width.saturating_sub(NAME_WIDTH_LEAST + 7 + SINCE_WIDTH + 6 + 4);
    let process = model.process.iter().map(AlarmLine::of_process);
    let all: Vec<_> = process.chain(model.alarms.iter().map(AlarmLine::of_node)).collect();
    let rows = lines(&all, model.alarm_cursor, palette, |alarm| {
        Row::new([
            Cell::from(cut_name(&plain(alarm.name), NAME_WIDTH_LEAST.into()).into_owned())
                .style(palette.bad()),
            Cell::from(alarm.status.as_str()),
            Cell::from(alarm.since_unix_ns.map_or(NONE.into(), day_and_time)),
            right(alarm.count.to_string()),
            Cell::from(cut(&plain(&alarm.meaning), meanings.into()).into_owned()),
        ])
    });
    let widths = [
        Constraint::Length(NAME_WIDTH_LEAST),
        Constraint::Length(7),
        Constraint::Length(SINCE_WIDTH),
        Constraint::Length(6),
        Constraint::Fill(1),
    ];
    let heading =
        ["name".into(), "status".into(), "since (UTC)".into(), right("times"), "meaning".into()];
    frame.render_widget(table(heading, rows, widths, palette), list);
    frame.render_widget(Text::from_iter(words), selected);
}

fn day_and_time(unix_ns: u64) -> String {
    let time = time(unix_ns);
    time.get(5..19).map_or(time.clone(), |part| part.replace('T', " "))
}

/// An alarm of either kind, as its line has it.
struct AlarmLine<'a> {
    name: &'a str,
    /// Of a process alarm, the number of its newest occurrence.
    status: String,
    since_unix_ns: Option<u64>,
    count: u64,
    meaning: String,
}

impl<'a> AlarmLine<'a> {
    fn of_node(alarm: &'a ActiveAlarm) -> Self {
        Self {
            name: &alarm.name,
            status: alarm.status.map_or(NONE.into(), |status| format!("16#{status:04X}")),
            since_unix_ns: alarm.since_unix_ns,
            count: alarm.count,
            meaning: alarm.meaning.clone(),
        }
    }

    fn of_process(alarm: &'a ProcessAlarm) -> Self {
        Self {
            name: &alarm.name,
            status: format!("no. {}", alarm.occurrence),
            since_unix_ns: alarm.first.map(|at| at.unix_ns),
            count: alarm.unacknowledged.max(1),
            meaning: format!("{}, {}: {}", alarm.severity, state(alarm), alarm.text),
        }
    }
}

/// The selected process alarm, whole.
fn process_in_words(alarm: &ProcessAlarm) -> String {
    let ProcessAlarm { name, task, severity, text, when, .. } = alarm;
    let at = |word: &str, at: &Option<AlarmMoment>| {
        at.as_ref().map_or_else(String::new, |at| format!(", {word} {}", moment(alarm, at)))
    };
    let (first, last) = (at("first", &alarm.first), at("last", &alarm.last));
    let state = state(alarm);
    let text = format!("{name} ({severity}, task {task}): {text} [{when}]; {state}{first}{last}");
    plain(&text).into_owned()
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
    let [list, selected] =
        Layout::vertical([Constraint::Min(0), Constraint::Length(1)]).areas(body);
    let others = [VALUE_WIDTH, LEFT_WIDTH, TASK_WIDTH, CLIENT_WIDTH];
    let names = list.width.saturating_sub(others.iter().sum::<u16>() + 4);
    let rows = lines(&model.forces, model.force_cursor, palette, |force| {
        let signal = model.signals.find(&force.name);
        let value_type = signal.map_or("LREAL", |signal| signal.value_type.as_str());
        let task = signal.map_or(NONE, |signal| signal.task.as_str());
        let client = force.client.as_deref().unwrap_or(NONE);
        Row::new([
            Cell::from(cut_name(&plain(&force.name), names.into()).into_owned())
                .style(palette.forced()),
            right(value(force.value, value_type, VALUE_WIDTH)).style(palette.forced()),
            right(left(model, force)),
            Cell::from(cut(&plain(task), TASK_WIDTH.into()).into_owned()),
            Cell::from(cut(&plain(client), CLIENT_WIDTH.into()).into_owned()),
        ])
    });
    let widths = [names, others[0], others[1], others[2], others[3]].map(Constraint::Length);
    let heading =
        ["signal".into(), right("forced to"), right("time left"), "task".into(), "by".into()];
    frame.render_widget(table(heading, rows, widths, palette), list);
    if let Some(force) = model.forces.get(model.force_cursor.selected()) {
        let until = force.until_cycle.map_or("it is released".into(), |it| format!("cycle {it}"));
        let task = model.signals.find(&force.name).map_or(NONE, |signal| &signal.task);
        let cycles = format!("since cycle {} of task {task}, until {until}", force.since_cycle);
        let text = format!("{}  {cycles}", force.name);
        let text = Span::raw(plain(&text).into_owned());
        frame.render_widget(cut_line(vec![text], selected.width.into()), selected);
    }
}

/// How much longer a force holds, by the cycle that is due.
fn left(model: &Model, force: &Force) -> String {
    let Some(until) = force.until_cycle else { return "held".into() };
    let task = model.signals.find(&force.name).map(|signal| signal.task.as_str());
    let tasks = model.node.as_ref().map_or(&[][..], |node| &node.tasks);
    let task = tasks.iter().find(|it| Some(it.name.as_str()) == task);
    let left_ns =
        task.map(|task| u128::from(until.saturating_sub(task.cycle)) * u128::from(task.period_ns));
    left_ns.map_or(NONE.into(), |ns| match ns.div_ceil(1_000_000_000) {
        seconds @ 0..600 => format!("{seconds} s"),
        seconds => format!("{} min", seconds.div_ceil(60)),
    })
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
