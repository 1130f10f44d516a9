//! The screen as it looks.

mod dialogs;
mod lists;
mod tasks;
mod text;

use isochrone_control::Access;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::text::{Line, Span, Text};

pub(crate) use self::text::{cut, cut_name};
use self::text::{cut_line, plain};
use super::input::{Focus, Page};
use super::message::wrapped;
use super::model::{Model, Rows};
use super::palette::Palette;
use crate::base::session::Absence;

/// On less than this, columns and dialogs would be cut.
const LEAST: (u16, u16) = (80, 12);

/// From this height on, tasks stand below the signals as well.
const TALL: u16 = 34;

/// The parts of the screen.
struct Regions {
    header: Rect,
    pages: Rect,
    body: Rect,
    /// The tasks below the signals; empty where there is no room.
    tasks: Rect,
    note: Rect,
    keys: Rect,
}

fn regions(area: Rect, model: &Model) -> Regions {
    let has_tasks = area.height >= TALL && model.page == Page::Signals;
    let tasks = if has_tasks { tasks::height_below(model, area.height) } else { 0 };
    let [header, pages, body, tasks, note, keys] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Min(0),
        Constraint::Length(tasks),
        Constraint::Length(1),
        Constraint::Length(1),
    ])
    .areas(area);
    Regions { header, pages, body, tasks, note, keys }
}

/// How many lines the lists have on a screen of this size.
pub(super) fn rows(area: Rect, model: &Model) -> Rows {
    let body = regions(area, model).body;
    Rows {
        signals: lists::signal_rows(body),
        tasks: tasks::rows(body, model),
        alarms: lists::alarm_rows(body, model),
        forces: lists::force_rows(body),
        message: dialogs::message_space(area),
    }
}

/// Whether a screen of this size has room for everything.
pub(super) fn fits(area: Rect) -> bool {
    area.width >= LEAST.0 && area.height >= LEAST.1
}

/// Draws everything, or that there is no room for it: half a value is a wrong value.
pub(super) fn draw(frame: &mut Frame<'_>, model: &Model, palette: Palette) {
    let area = frame.area();
    if !fits(area) {
        let (width, height) = LEAST;
        let text = format!(
            "top needs {width}x{height} characters, and this terminal has {}x{}.\nq quits.",
            area.width, area.height
        );
        let text = wrapped(&text, area.width.into());
        frame.render_widget(Text::from_iter(text), area);
        return;
    }
    let regions = regions(area, model);
    frame.render_widget(header(model, area.width, palette), regions.header);
    frame.render_widget(pages(model, palette), regions.pages);
    match model.page {
        Page::Signals => lists::draw_signals(frame, regions.body, model, palette),
        Page::Tasks => tasks::draw(frame, regions.body, model, palette),
        Page::Alarms => lists::draw_alarms(frame, regions.body, model, palette),
        Page::Forces => lists::draw_forces(frame, regions.body, model, palette),
    }
    if regions.tasks.height > 0 {
        tasks::draw_jitter(frame, regions.tasks, model, palette);
    }
    frame.render_widget(note(model, area.width, palette), regions.note);
    frame.render_widget(keys(model), regions.keys);
    if let Some(dialog) = &model.dialog {
        dialogs::draw(frame, area, dialog, model, palette);
    }
}

fn header(model: &Model, width: u16, palette: Palette) -> Line<'static> {
    let Some(node) = &model.node else { return Line::default() };
    let changed = if node.configuration.changed { " (changed since the start)" } else { "" };
    let access = match node.control {
        Access::Off | Access::Read => "read only (control = \"read\")",
        Access::Set => "set (control = \"set\": no forces)",
        Access::Force => "set and force",
    };
    let state = match &model.lost {
        None => Span::raw(format!("{changed}  {access}")),
        Some((Absence::Ended, _)) => Span::styled("  has ended", palette.bad()),
        Some((Absence::Silent, _)) => Span::styled("  does not answer", palette.bad()),
    };
    let spans = vec![
        Span::styled(plain(&node.node).into_owned(), palette.heading()),
        Span::raw(format!("  {}", plain(&node.configuration.file))),
        state,
    ];
    cut_line(spans, width.into())
}

fn pages(model: &Model, palette: Palette) -> Line<'static> {
    let alarms = if model.count_alarms() == 0 { palette.heading() } else { palette.bad() };
    let forces = if model.forces.is_empty() { palette.heading() } else { palette.forced() };
    let count = |count: usize| if count == 0 { String::new() } else { format!(" ({count})") };
    let page = |page: Page| match page {
        Page::Signals => ("1 Signals".to_owned(), palette.heading()),
        Page::Tasks => ("2 Tasks".to_owned(), palette.heading()),
        Page::Alarms => (format!("3 Alarms{}", count(model.count_alarms())), alarms),
        Page::Forces => (format!("4 Forces{}", count(model.forces.len())), forces),
    };
    let spans = Page::ALL.into_iter().flat_map(|it| {
        let (title, style) = page(it);
        let style = if it == model.page { style.patch(palette.selected()) } else { style };
        [Span::styled(format!(" {title} "), style), Span::raw(" ")]
    });
    Line::from(spans.collect::<Vec<_>>())
}

fn note(model: &Model, width: u16, palette: Palette) -> Line<'static> {
    match model.doubt() {
        Some(doubt) => Line::styled(cut(&plain(&doubt), width.into()).into_owned(), palette.bad()),
        None => Line::raw(cut(&plain(model.note()), width.into()).into_owned()),
    }
}

fn keys(model: &Model) -> Line<'static> {
    Line::raw(match (model.focus(), model.page) {
        (Focus::Search, _) => "type a part of a name   Enter keep   Esc leave",
        (Focus::Answer, _) => "Enter next   Esc leave   Ctrl-U erase",
        (Focus::Confirmation, _) if model.takes_reason() => {
            "Enter or y do it   c give a reason   Esc or n leave"
        }
        (Focus::Confirmation, _) => "Enter or y do it   Esc or n leave",
        (Focus::Message, _) => "Enter close   Up and Down scroll",
        (Focus::List, page) => {
            let mut commands = commands(page, model.access());
            let tasks = model.node.as_ref().map_or(0, |node| node.tasks.len());
            let shown = model.task_cursor.window();
            if page == Page::Tasks && shown.len() < tasks {
                let (first, last) = (shown.start + 1, shown.end);
                commands = format!("{commands}  Up and Down: task {first} to {last} of {tasks}");
            }
            return Line::raw(commands);
        }
    })
}

/// The possible actions on a page, as far as the node allows them.
fn commands(page: Page, access: Access) -> String {
    let on_signals = page == Page::Signals;
    let (can_set, can_force) = (access >= Access::Set, access >= Access::Force);
    let parts = [
        (can_set && on_signals, "Enter set"),
        (can_force && on_signals, "f force"),
        (can_force && page == Page::Forces, "f force again"),
        (can_force && (on_signals || page == Page::Forces), "r release"),
        (can_set && page == Page::Alarms, "c acknowledge"),
        (can_set, "u undo"),
        (on_signals, "/ search"),
        (on_signals, "a i p w o list"),
        (!on_signals, "Tab next page"),
        (true, "? help"),
        (true, "q quit"),
    ];
    let offered = parts.into_iter().filter(|(is_offered, _)| *is_offered);
    offered.map(|(_, part)| part).collect::<Vec<_>>().join("  ")
}

#[cfg(test)]
mod tests;
