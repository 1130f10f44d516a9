//! The place in a list that is longer than the screen.

use std::ops::Range;

/// A selected line and the part of the list that is on the screen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Cursor {
    selected: usize,
    first: usize,
    /// Lines on the screen.
    rows: usize,
    /// Lines of the list.
    len: usize,
}

/// A way through a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Motion {
    Up,
    Down,
    PageUp,
    PageDown,
    First,
    Last,
}

impl Cursor {
    pub(super) fn selected(&self) -> usize {
        self.selected
    }

    /// The lines that are on the screen.
    pub(super) fn window(&self) -> Range<usize> {
        self.first..(self.first + self.rows).min(self.len)
    }

    /// The list has so many lines now.
    pub(super) fn set_len(&mut self, len: usize) {
        self.len = len;
        self.select(self.selected);
    }

    /// The screen has so many lines now.
    pub(super) fn set_rows(&mut self, rows: usize) {
        self.rows = rows;
        self.select(self.selected);
    }

    pub(super) fn go(&mut self, motion: Motion) {
        let page = self.rows.saturating_sub(1).max(1);
        self.select(match motion {
            Motion::Up => self.selected.saturating_sub(1),
            Motion::Down => self.selected.saturating_add(1),
            Motion::PageUp => self.selected.saturating_sub(page),
            Motion::PageDown => self.selected.saturating_add(page),
            Motion::First => 0,
            Motion::Last => usize::MAX,
        });
    }

    /// Selects a line, the last one if there are fewer, and scrolls as little as shows it.
    pub(super) fn select(&mut self, line: usize) {
        self.selected = line.min(self.len.saturating_sub(1));
        let last_first = self.len.saturating_sub(self.rows);
        let least = (self.selected + 1).saturating_sub(self.rows);
        self.first = self.first.max(least).min(self.selected).min(last_first);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cursor(len: usize, rows: usize) -> Cursor {
        let mut cursor = Cursor::default();
        cursor.set_len(len);
        cursor.set_rows(rows);
        cursor
    }

    #[test]
    fn the_selected_line_is_always_on_the_screen() {
        let motions = [
            Motion::Down,
            Motion::PageDown,
            Motion::PageUp,
            Motion::Up,
            Motion::Last,
            Motion::First,
        ];
        for (len, rows) in [(1, 1), (5, 10), (5000, 20), (21, 20), (3, 1)] {
            let mut cursor = cursor(len, rows);
            for motion in motions.iter().cycle().take(100) {
                cursor.go(*motion);
                assert!(cursor.window().contains(&cursor.selected()), "{cursor:?}");
                assert_eq!(cursor.window().len(), rows.min(len), "the screen is full: {cursor:?}");
            }
        }
    }

    #[test]
    fn a_list_that_shrinks_and_a_screen_that_is_resized_keep_a_line_selected() {
        let mut cursor = cursor(5000, 20);
        cursor.go(Motion::Last);
        cursor.set_rows(5);
        assert_eq!((cursor.selected(), cursor.window()), (4999, 4995..5000));
        cursor.set_len(3);
        assert_eq!((cursor.selected(), cursor.window()), (2, 0..3));
        cursor.set_len(0);
        assert_eq!((cursor.selected(), cursor.window()), (0, 0..0));
        cursor.set_rows(0);
        assert_eq!(cursor.window(), 0..0);
    }
}
