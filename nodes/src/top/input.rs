//! The meaning of the keys.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::cursor::Motion;
use super::signals::Filter;

/// Who the keyboard talks to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Focus {
    List,
    /// The text that is searched for.
    Search,
    /// The answer to a question.
    Answer,
    /// A question that is answered with yes or no.
    Confirmation,
    /// A message or the help.
    Message,
}

/// A page of the screen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Page {
    #[default]
    Signals,
    Tasks,
    Alarms,
    Forces,
}

impl Page {
    pub(super) const ALL: [Self; 4] = [Self::Signals, Self::Tasks, Self::Alarms, Self::Forces];
}

/// The command of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Action {
    Quit,
    /// Draws everything again, over whatever another program wrote.
    Redraw,
    Help,
    Show(Page),
    NextPage,
    PreviousPage,
    Go(Motion),
    List(Filter),
    Search,
    Set,
    Force,
    Release,
    Undo,
    Acknowledge,
    Type(char),
    Erase,
    EraseAll,
    Accept,
    /// Give a reason for what is to be confirmed.
    Comment,
    Cancel,
}

/// The meaning of a key in its context.
pub(super) fn action(focus: Focus, key: KeyEvent) -> Option<Action> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        return match key.code {
            KeyCode::Char('c') => Some(Action::Quit),
            KeyCode::Char('l') => Some(Action::Redraw),
            KeyCode::Char('u') => Some(Action::EraseAll),
            _ => None,
        };
    }
    if key.modifiers.contains(KeyModifiers::ALT) {
        return None;
    }
    match focus {
        Focus::List => on_list(key.code),
        Focus::Search => match motion(key.code) {
            Some(motion) => Some(Action::Go(motion)),
            None => on_text(key.code),
        },
        Focus::Answer => on_text(key.code),
        Focus::Confirmation => match key.code {
            KeyCode::Enter | KeyCode::Char('y') => Some(Action::Accept),
            KeyCode::Char('c') => Some(Action::Comment),
            KeyCode::Esc | KeyCode::Char('n' | 'q') => Some(Action::Cancel),
            _ => None,
        },
        Focus::Message => match key.code {
            KeyCode::Enter | KeyCode::Esc | KeyCode::Char(' ' | 'q' | '?') => Some(Action::Cancel),
            code => motion(code).map(Action::Go),
        },
    }
}

fn on_list(code: KeyCode) -> Option<Action> {
    if let Some(motion) = motion(code) {
        return Some(Action::Go(motion));
    }
    Some(match code {
        KeyCode::Char('q') => Action::Quit,
        KeyCode::Char('?') | KeyCode::F(1) => Action::Help,
        KeyCode::Char('1') => Action::Show(Page::Signals),
        KeyCode::Char('2') => Action::Show(Page::Tasks),
        KeyCode::Char('3') => Action::Show(Page::Alarms),
        KeyCode::Char('4') => Action::Show(Page::Forces),
        KeyCode::Tab | KeyCode::Right => Action::NextPage,
        KeyCode::BackTab | KeyCode::Left => Action::PreviousPage,
        KeyCode::Char('k') => Action::Go(Motion::Up),
        KeyCode::Char('j') => Action::Go(Motion::Down),
        KeyCode::Char('g') => Action::Go(Motion::First),
        KeyCode::Char('G') => Action::Go(Motion::Last),
        KeyCode::Char('/') => Action::Search,
        KeyCode::Enter => Action::Set,
        KeyCode::Char('f') => Action::Force,
        KeyCode::Char('r') => Action::Release,
        KeyCode::Char('u') => Action::Undo,
        KeyCode::Char('c') => Action::Acknowledge,
        KeyCode::Esc => Action::Cancel,
        KeyCode::Char(key) => {
            return Filter::ALL.into_iter().find(|filter| filter.key() == key).map(Action::List);
        }
        _ => return None,
    })
}

fn on_text(code: KeyCode) -> Option<Action> {
    match code {
        KeyCode::Char(character) => Some(Action::Type(character)),
        KeyCode::Backspace => Some(Action::Erase),
        KeyCode::Enter => Some(Action::Accept),
        KeyCode::Esc => Some(Action::Cancel),
        _ => None,
    }
}

fn motion(code: KeyCode) -> Option<Motion> {
    Some(match code {
        KeyCode::Up => Motion::Up,
        KeyCode::Down => Motion::Down,
        KeyCode::PageUp => Motion::PageUp,
        KeyCode::PageDown => Motion::PageDown,
        KeyCode::Home => Motion::First,
        KeyCode::End => Motion::Last,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const EACH: [Focus; 5] =
        [Focus::List, Focus::Search, Focus::Answer, Focus::Confirmation, Focus::Message];

    fn pressed(focus: Focus, code: KeyCode) -> Option<Action> {
        action(focus, KeyEvent::new(code, KeyModifiers::NONE))
    }

    #[test]
    fn ctrl_c_quits_from_everywhere_and_q_only_where_it_is_no_text() {
        for focus in EACH {
            let ctrl_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
            assert_eq!(action(focus, ctrl_c), Some(Action::Quit), "{focus:?}");
        }
        assert_eq!(pressed(Focus::List, KeyCode::Char('q')), Some(Action::Quit));
        for focus in [Focus::Search, Focus::Answer] {
            assert_eq!(pressed(focus, KeyCode::Char('q')), Some(Action::Type('q')));
        }
        assert_eq!(pressed(Focus::Message, KeyCode::Char('q')), Some(Action::Cancel));
    }

    #[test]
    fn what_is_typed_into_an_answer_commands_nothing() {
        for character in "fru/?apiow1 G".chars() {
            let typed = pressed(Focus::Answer, KeyCode::Char(character));
            assert_eq!(typed, Some(Action::Type(character)));
        }
        let with_ctrl = KeyEvent::new(KeyCode::Char('f'), KeyModifiers::CONTROL);
        assert_eq!(action(Focus::List, with_ctrl), None);
    }

    #[test]
    fn a_confirmation_takes_enter_or_y_and_leaves_by_escape_or_n() {
        let pressed = |code| pressed(Focus::Confirmation, code);
        assert_eq!(pressed(KeyCode::Enter), Some(Action::Accept));
        assert_eq!(pressed(KeyCode::Char('y')), Some(Action::Accept));
        assert_eq!(pressed(KeyCode::Esc), Some(Action::Cancel));
        assert_eq!(pressed(KeyCode::Char('n')), Some(Action::Cancel));
        assert_eq!(pressed(KeyCode::Char('f')), None);
    }

    #[test]
    fn each_filter_has_its_key_and_no_other_command_has_the_same() {
        for filter in Filter::ALL {
            let chosen = pressed(Focus::List, KeyCode::Char(filter.key()));
            assert_eq!(chosen, Some(Action::List(filter)));
        }
    }

    #[test]
    fn a_key_that_is_let_go_means_nothing() {
        let mut key = KeyEvent::new(KeyCode::Char('f'), KeyModifiers::NONE);
        key.kind = KeyEventKind::Release;
        assert_eq!(action(Focus::List, key), None);
    }
}
