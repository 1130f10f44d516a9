//! Cells in columns that are as wide as they need to be.

use std::fmt::{Display, Formatter, Result};

/// Between columns.
const GAP: usize = 2;

/// A table: the first column to the left, the others to the right.
pub(super) struct Grid(Vec<Vec<String>>);

impl Grid {
    pub(super) fn new<'a>(head: impl IntoIterator<Item = &'a str>) -> Self {
        Self(vec![head.into_iter().map(str::to_owned).collect()])
    }

    pub(super) fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.0.push(cells.into_iter().collect());
    }
}

impl Display for Grid {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let mut widths = Vec::new();
        for row in &self.0 {
            widths.resize(widths.len().max(row.len()), 0);
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = cell.chars().count().max(*width);
            }
        }
        for row in &self.0 {
            let mut line = String::new();
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                line += &match column {
                    0 => format!("{:GAP$}{cell:<width$}", ""),
                    _ => format!("{:GAP$}{cell:>width$}", ""),
                };
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell_and_rows_may_be_short() {
        let mut grid = Grid::new(["arm", "p50"]);
        grid.row(["a long one", "1"].map(str::to_owned));
        grid.row(["b".to_owned()]);
        assert_eq!(grid.to_string(), "  arm         p50\n  a long one    1\n  b\n");
    }
}
