//! Text in aligned columns.

use anstyle::Style;

use crate::report::style::{DIM, styled};
use crate::report::width::width;

pub use Side::{Left, Right};

/// Alignment of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Left-aligned, for text.
    Left,
    /// Right-aligned, for numbers.
    Right,
}

/// Cell of a grid.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    text: String,
    style: Style,
}

impl Cell {
    /// Creates a styled cell.
    pub fn new(text: impl Into<String>, style: Style) -> Self {
        Self {
            text: text.into(),
            style,
        }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::new(text, Style::new())
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::new(text, Style::new())
    }
}

/// Rows of cells; each column is as wide as its widest cell, with two spaces between columns. Empty
/// columns are omitted.
#[derive(Clone, Debug)]
pub struct Grid {
    sides: Vec<Side>,
    rows: Vec<Vec<Cell>>,
}

impl Grid {
    /// Creates an empty grid with the alignments of its columns.
    pub fn new(sides: &[Side]) -> Self {
        Self {
            sides: sides.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row with the names of the columns, separated by `|`.
    pub fn header(&mut self, names: &str) {
        let names = names.split('|');
        let cells = names.map(|name| Cell::new(name.trim(), DIM));
        self.rows.push(cells.collect());
    }

    /// Adds a row; missing cells are empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Returns the lines, indented by `indent` spaces and without trailing spaces.
    pub fn lines(&self, indent: usize) -> Vec<String> {
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| width(&cell.text)).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.sides.len()).map(width).collect();
        self.rows
            .iter()
            .map(|row| self.line(row, &widths, indent))
            .collect()
    }

    fn line(&self, row: &[Cell], widths: &[usize], indent: usize) -> String {
        let mut line = " ".repeat(indent);
        let mut blanks = 0;
        let columns = widths.iter().zip(&self.sides).enumerate();
        for (column, (&wide, side)) in columns.filter(|(_, (wide, _))| **wide > 0) {
            let empty = Cell::default();
            let cell = row.get(column).unwrap_or(&empty);
            let padding = wide - width(&cell.text);
            let (before, after) = match side {
                Left => (0, padding),
                Right => (padding, 0),
            };
            blanks += before;
            // Spaces are written only before the next text.
            if cell.text.is_empty() {
                blanks += wide - padding;
            } else {
                line.push_str(&" ".repeat(blanks));
                line.push_str(&styled(cell.style, &cell.text));
                blanks = 0;
            }
            blanks += after + 2;
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_empty_columns_omitted() {
        let mut grid = Grid::new(&[Left, Left, Right, Left]);
        grid.row(["✓".into(), "".into(), "0.5".into(), "m".into()]);
        grid.row(["✗".into(), "".into(), "12.25".into(), "".into()]);
        grid.row(["✓".into(), "".into(), "".into(), "s".into()]);
        let lines = grid.lines(1);
        assert_eq!(lines, [" ✓    0.5  m", " ✗  12.25", " ✓         s"]);
    }
}
