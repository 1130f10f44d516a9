//! Keys on the screen of a scope.

use std::time::Duration;

use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::super::display::Display;
use crate::failure::Failure;
use crate::top::{Wait, wait};

/// The commands of the keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KeyAction {
    Nothing,
    /// A new drawing.
    Draw,
    End,
}

/// Waits this long for keys.
pub(super) fn wait_for(time: Duration, display: &mut Display) -> Result<KeyAction, Failure> {
    let failed = |error| Failure::found(format!("cannot use the terminal: {error}"));
    let mut asked = KeyAction::Nothing;
    if wait(time).map_err(failed)? == Wait::HungUp {
        return Ok(KeyAction::End);
    }
    while event::poll(Duration::ZERO).map_err(failed)? {
        // A new size is drawn as well.
        asked = KeyAction::Draw;
        match event::read().map_err(failed)? {
            Event::Key(key) if quits(key) => return Ok(KeyAction::End),
            Event::Key(key) if redraws(key) => display.clear(),
            _ => {}
        }
    }
    Ok(asked)
}

fn quits(key: KeyEvent) -> bool {
    let is_ctrl = key.modifiers.contains(KeyModifiers::CONTROL);
    key.kind != KeyEventKind::Release
        && match key.code {
            KeyCode::Char('c') => is_ctrl,
            KeyCode::Char('q') | KeyCode::Esc => !is_ctrl,
            _ => false,
        }
}

fn redraws(key: KeyEvent) -> bool {
    key.modifiers.contains(KeyModifiers::CONTROL) && key.code == KeyCode::Char('l')
}
