//! Characters in lines and columns, each with its meaning.

/// The element that a character belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Ink {
    Text,
    Heading,
    Axis,
    /// The curve of the signal of this number.
    Band(usize),
    Trigger,
    /// A mark for missing values.
    Gap,
    /// A value that is not a number.
    Odd,
}

/// Lines of letters.
#[derive(Debug, Clone)]
pub(in super::super) struct Grid {
    columns: usize,
    cells: Vec<(char, Ink)>,
}

impl Grid {
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        Self { columns, cells: vec![(' ', Ink::Text); columns * rows] }
    }

    /// Writes a letter; what lies outside is left out.
    pub(super) fn put(&mut self, column: usize, row: usize, letter: char, ink: Ink) {
        if column < self.columns
            && let Some(cell) = self.cells.get_mut(row * self.columns + column)
        {
            *cell = (letter, ink);
        }
    }

    /// Writes a text from a column on.
    pub(super) fn text(&mut self, column: usize, row: usize, text: &str, ink: Ink) {
        (column..)
            .zip(text.chars())
            .for_each(|(column, letter)| self.put(column, row, letter, ink));
    }

    /// Writes a text that ends before a column.
    pub(super) fn text_before(&mut self, column: usize, row: usize, text: &str, ink: Ink) {
        self.text(column.saturating_sub(text.chars().count()), row, text, ink);
    }

    /// Whether nothing stands there.
    pub(super) fn is_free(&self, column: usize, row: usize) -> bool {
        self.cells.get(row * self.columns + column).is_some_and(|(letter, _)| *letter == ' ')
    }

    /// The lines, each in pieces of one ink.
    pub(in super::super) fn lines(&self) -> impl Iterator<Item = Vec<(Ink, String)>> {
        self.cells.chunks(self.columns.max(1)).map(|cells| {
            let end = cells.iter().rposition(|(letter, _)| *letter != ' ').map_or(0, |end| end + 1);
            let mut pieces: Vec<(Ink, String)> = Vec::new();
            for (letter, ink) in cells.iter().take(end) {
                match pieces.last_mut() {
                    // A blank has no colour.
                    Some((last, text)) if last == ink || *letter == ' ' => text.push(*letter),
                    _ => pieces.push((*ink, letter.to_string())),
                }
            }
            pieces
        })
    }

    /// The lines without colour.
    pub(in super::super) fn plain(&self) -> String {
        let line = |pieces: Vec<(Ink, String)>| {
            pieces.into_iter().map(|(_, text)| text).chain(["\n".to_owned()]).collect::<String>()
        };
        self.lines().map(line).collect()
    }
}
