//! Questions, messages and the help, in a box over the list.

use isochrone_control::Role;
use isochrone_engine::escaped_lines;
use ratatui::Frame;
use ratatui::layout::{Constraint, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Padding, Paragraph};

use super::text::plain;
use crate::base::session::Target;
use crate::top::dialog::{Asks, Dialog, Question};
use crate::top::message::{Space, message_lines, wrapped};
use crate::top::model::Model;
use crate::top::palette::Palette;

/// As wide as reads well.
const WIDEST: u16 = 76;
/// The frame of a box and the blanks within it.
const AROUND: u16 = 4;
const FRAME: u16 = 2;

const HELP: &str = "\
Marks     F  forced   f  computed from what is forced
          !  input not ok, or block in error
          ?  computed from what is not ok, in error or a substitute
Pages     1 to 4, Tab, Left and Right
Move      Up, Down, PageUp, PageDown, Home, End; k, j, g, G
List      a all  i inputs  p parameters  w wired  o outputs
Search    /  a part of a name; Enter keeps it, Esc leaves it
Set       Enter  a new value of the selected parameter or variable
Force     f  a value and a time for the selected signal
Release   r  ends the force of the selected signal
Alarm     c  acknowledges the selected process alarm
Undo      u  takes back a set, with all of its values
Quit      q  or Ctrl-C; Ctrl-L draws the screen again

Each change is shown and waits for Enter. With a set, a force or an
acknowledgement, c gives a reason, which is kept. Forces go on when you quit.";

/// Room for the text of a message.
pub(super) fn message_space(area: Rect) -> Space {
    let area = area.centered(Constraint::Max(WIDEST), Constraint::Max(area.height));
    Space {
        columns: area.width.saturating_sub(AROUND).into(),
        lines: area.height.saturating_sub(FRAME).into(),
    }
}

pub(super) fn draw(
    frame: &mut Frame<'_>,
    area: Rect,
    dialog: &Dialog,
    model: &Model,
    palette: Palette,
) {
    let space = message_space(area);
    let (title, text): (_, Vec<Line<'_>>) = match dialog {
        Dialog::Help => ("Keys", HELP.lines().map(Line::raw).collect()),
        Dialog::Message { title, text, first } => {
            let mut lines = message_lines(title, text, space);
            (NOTICE, lines.drain((*first).min(lines.len())..).map(Line::raw).collect())
        }
        Dialog::Question(question) => {
            (title_of(question), lines_of(question, model, space, palette))
        }
    };
    let height = u16::try_from(text.len()).unwrap_or(u16::MAX).saturating_add(FRAME);
    let place = area.centered(Constraint::Max(WIDEST), Constraint::Max(height));
    let around = Block::bordered()
        .title(Span::styled(format!(" {title} "), palette.heading()))
        .padding(Padding::horizontal(1));
    frame.render_widget(Clear, place);
    frame.render_widget(Paragraph::new(text).block(around), place);
}

const NOTICE: &str = "The node says";

fn title_of(question: &Question) -> &'static str {
    match &question.asks {
        Asks::NewValue(target) if target.role == Role::Variable => "Set a variable",
        Asks::NewValue(_) => "Set a parameter",
        Asks::ForcedValue(_) => "Force a signal",
        Asks::ForceTime(..) => "Force for how long?",
        Asks::Transaction => "Undo which transaction?",
        Asks::Confirm(_) => "Do this?",
        Asks::Comment(..) => "For what reason?",
    }
}

fn lines_of<'a>(
    question: &'a Question,
    model: &Model,
    space: Space,
    palette: Palette,
) -> Vec<Line<'a>> {
    let wrap = |text: &str| wrapped(&escaped_lines(text), space.columns).into_iter();
    let mut lines: Vec<Line<'_>> = Vec::new();
    match &question.asks {
        Asks::Confirm(order) => {
            lines
                .extend(wrap(&order.to_string()).map(|line| Line::styled(line, palette.heading())));
            if let Some(name) = order.signal() {
                lines.extend(wrap(&now(model, name)).map(Line::raw));
            }
            if let Some(comment) = order.comment() {
                lines.extend(wrap(&format!("reason: {comment}")).map(Line::raw));
            }
            return lines;
        }
        Asks::NewValue(target) | Asks::ForcedValue(target) => {
            let now = now(model, &target.name);
            let now = format!("{} ({}), {now}", target.name, target.value_type);
            lines.extend(wrap(&now).map(Line::raw));
        }
        Asks::ForceTime(target, to) => {
            let now = now(model, &target.name);
            let text = format!("{} to {}, {now}", target.name, target.shown(*to));
            lines.extend(wrap(&text).map(Line::raw));
        }
        Asks::Transaction => {}
        Asks::Comment(order) => {
            lines.extend(wrap(&order.to_string()).map(Line::raw));
        }
    }
    lines.push(Line::from(vec![
        Span::styled(format!("> {}", plain(&question.input)), palette.heading()),
        Span::styled(" ", palette.selected()),
    ]));
    match &question.error {
        Some(error) => lines.extend(wrap(error).map(|line| Line::styled(line, palette.bad()))),
        None => {
            let help = question.help(&model.history, &model.signals);
            lines.extend(wrap(&help).map(Line::raw));
        }
    }
    lines
}

/// The value that a signal has at the moment, which others may change while a question waits.
fn now(model: &Model, name: &str) -> String {
    let value = model.signals.value(name);
    match model.signals.find(name).zip(value) {
        Some((signal, value)) => format!("now {}", Target::new(signal).shown(value)),
        None => "now: not read yet".into(),
    }
}
