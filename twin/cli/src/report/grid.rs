//! Aligned columns of text.

use crate::report::paint::Paint;

/// On which side of its column a text stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// How a cell is painted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tint {
    /// As it is.
    #[default]
    None,
    /// Good.
    Green,
    /// Wrong.
    Red,
    /// Odd.
    Yellow,
    /// In the background.
    Dim,
}

/// A text in a table.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    text: String,
    tint: Tint,
}

impl Cell {
    /// A painted text.
    pub fn new(text: impl Into<String>, tint: Tint) -> Self {
        Self {
            text: text.into(),
            tint,
        }
    }

    fn painted(&self, paint: Paint) -> String {
        match self.tint {
            Tint::None => self.text.clone(),
            Tint::Green => paint.green(&self.text),
            Tint::Red => paint.red(&self.text),
            Tint::Yellow => paint.yellow(&self.text),
            Tint::Dim => paint.dim(&self.text),
        }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::new(text, Tint::None)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::new(text, Tint::None)
    }
}

/// Rows of cells, each column as wide as its widest cell, two blanks between columns. Columns without any text take no room.
#[derive(Clone, Debug)]
pub struct Grid {
    sides: Vec<Side>,
    rows: Vec<Vec<Cell>>,
}

impl Grid {
    /// An empty grid whose columns stand on these sides.
    pub fn new(sides: &[Side]) -> Self {
        Self {
            sides: sides.to_vec(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; missing cells are empty.
    pub fn row<const N: usize>(&mut self, cells: [Cell; N]) {
        self.rows.push(cells.into());
    }

    /// The lines, each indented by `indent` blanks and without blanks at its end.
    pub fn lines(&self, indent: usize, paint: Paint) -> Vec<String> {
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| width(&cell.text)).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.sides.len()).map(width).collect();
        self.rows
            .iter()
            .map(|row| self.line(row, &widths, indent, paint))
            .collect()
    }

    fn line(&self, row: &[Cell], widths: &[usize], indent: usize, paint: Paint) -> String {
        let mut line = " ".repeat(indent);
        let mut blanks = 0;
        let columns = widths.iter().zip(&self.sides).enumerate();
        for (column, (&wide, side)) in columns.filter(|(_, (wide, _))| **wide > 0) {
            let empty = Cell::default();
            let cell = row.get(column).unwrap_or(&empty);
            let room = wide - width(&cell.text);
            let (before, after) = match side {
                Side::Left => (0, room),
                Side::Right => (room, 0),
            };
            blanks += before;
            // Blanks wait for a text behind them.
            if cell.text.is_empty() {
                blanks += wide - room;
            } else {
                line.push_str(&" ".repeat(blanks));
                line.push_str(&cell.painted(paint));
                blanks = 0;
            }
            blanks += after + 2;
        }
        line
    }
}

/// Width of a text on a terminal, good enough for the letters that appear here.
fn width(text: &str) -> usize {
    text.chars().count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_empty_ones_vanish() {
        let mut grid = Grid::new(&[Side::Left, Side::Left, Side::Right, Side::Left]);
        grid.row(["✓".into(), "".into(), "0.5".into(), "m".into()]);
        grid.row(["✗".into(), "".into(), "12.25".into(), "".into()]);
        grid.row(["✓".into(), "".into(), "".into(), "s".into()]);
        let lines = grid.lines(1, Paint::PLAIN);
        assert_eq!(lines, [" ✓    0.5  m", " ✗  12.25", " ✓         s"]);
    }
}
