//! Cells in columns that are as wide as they need to be.

use isochrone_timing::units::duration;

/// Between columns.
const GAP: &str = "  ";
/// Stands where the samples are too few, or nobody knows.
pub(super) const UNKNOWN: &str = "-";

/// Where cells narrower than their column stand in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Alignment {
    /// At its left, as words do.
    #[default]
    Left,
    /// At its right, as numbers do.
    Right,
}

/// A table for a terminal: columns as wide as their widest cell, in characters, with two spaces
/// between them. The first column is aligned left, the others as the table says.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    alignment: Alignment,
    rows: Vec<Vec<String>>,
}

/// The cell of a time.
pub(super) fn time(ns: Option<u64>) -> String {
    ns.map_or_else(|| UNKNOWN.to_owned(), |ns| duration(ns as f64))
}

impl Table {
    /// A table without rows, whose columns after the first are aligned like this.
    pub const fn new(alignment: Alignment) -> Self {
        Self { alignment, rows: Vec::new() }
    }

    /// Adds a row, which may have fewer cells than others.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Draws the table, each line indented by `indent` spaces and ended by a line feed.
    pub fn draw(&self, indent: usize) -> String {
        let mut widths: Vec<usize> = Vec::new();
        for row in &self.rows {
            widths.resize(widths.len().max(row.len()), 0);
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = (*width).max(cell.chars().count());
            }
        }
        // A width in a format string has 16 bits, and a cell may be longer.
        let aligned = |(column, (cell, &width)): (usize, (&String, &usize))| {
            let blanks = " ".repeat(width.saturating_sub(cell.chars().count()));
            match self.alignment {
                Alignment::Right if column > 0 => blanks + cell,
                Alignment::Left | Alignment::Right => cell.clone() + &blanks,
            }
        };
        let mut text = String::new();
        for row in &self.rows {
            let cells: Vec<String> = row.iter().zip(&widths).enumerate().map(aligned).collect();
            text += &format!("{:indent$}{}\n", "", cells.join(GAP).trim_end());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(alignment: Alignment, indent: usize) -> String {
        let mut table = Table::new(alignment);
        table.row(["arm", "p50", "of"]);
        table.row(["a long one", "1", "7"]);
        table.row(["µ"]);
        table.draw(indent)
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell_and_rows_may_be_short() {
        let expected = "arm         p50  of\na long one  1    7\nµ\n";
        assert_eq!(drawn(Alignment::Left, 0), expected);
    }

    #[test]
    fn numbers_are_aligned_right_after_the_first_column() {
        let expected = "  arm         p50  of\n  a long one    1   7\n  µ\n";
        assert_eq!(drawn(Alignment::Right, 2), expected);
    }

    #[test]
    fn a_cell_may_be_longer_than_a_width_in_a_format_string() {
        let long = "x".repeat(70_000);
        let mut table = Table::new(Alignment::Right);
        table.row(["a", &long, "b"]);
        table.row(["c", "1", "d"]);
        let drawn = table.draw(0);
        assert_eq!(drawn.lines().next(), Some(&*format!("a  {long}  b")));
        assert_eq!(drawn.lines().nth(1), Some(&*format!("c  {}1  d", " ".repeat(69_999))));
    }
}
