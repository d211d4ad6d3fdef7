//! Text in aligned columns.
//!
//! A grid is written as wide as its widest cells. Its cells are marked by separators, characters
//! without width, from which [`laid_out`](super::layout::laid_out) makes a table that fits the
//! terminal; text from outside contains none, as control characters are escaped.

use anstyle::Style;
use twinrig_document::escaped;

use super::style::{DIM, with_style};
use super::width::{width, wrap};

pub use Side::{Left, Right};

/// Alignment of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Left-aligned, for text.
    Left,
    /// Right-aligned, for numbers.
    Right,
}

/// Spaces between columns.
pub(super) const GAP: usize = 2;
/// Mark of a line with the names of the columns.
pub(super) const HEADER: char = '\u{1}';
/// Mark of the first line of a grid.
pub(super) const GRID: char = '\u{1c}';
/// Mark of a cell whose text continues that of the cell above.
pub(super) const CONTINUED: char = '\u{1d}';
/// Mark of a right-aligned cell.
pub(super) const RIGHT: char = '\u{1e}';
/// Mark of a left-aligned cell.
pub(super) const LEFT: char = '\u{1f}';

/// All marks.
pub(super) const MARKS: [char; 5] = [HEADER, GRID, CONTINUED, RIGHT, LEFT];

/// Cell of a grid. Control characters of its text are escaped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    text: String,
    style: Style,
    continued: bool,
}

impl Cell {
    /// Creates a styled cell.
    pub fn new(text: impl Into<String>, style: Style) -> Self {
        Self {
            text: escaped(&text.into()).replace('\n', " "),
            style,
            continued: false,
        }
    }

    /// Creates a cell of text that is styled in parts.
    pub fn of_styled(text: String) -> Self {
        Self {
            text,
            ..Self::default()
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
    /// Number of the row with the names of the columns.
    header: Option<usize>,
}

impl Grid {
    /// Creates an empty grid with the alignments of its columns.
    pub fn new(sides: &[Side]) -> Self {
        Self {
            sides: sides.to_vec(),
            rows: Vec::new(),
            header: None,
        }
    }

    /// Adds a row with the names of the columns, separated by `|`.
    pub fn header(&mut self, names: &str) {
        let names = names.split('|');
        let cells = names.map(|name| Cell::new(name.trim(), DIM));
        self.header = Some(self.rows.len());
        self.rows.push(cells.collect());
    }

    /// Adds a row; missing cells are empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Adds a row of a name and a text, whose lines have at most `columns`.
    pub fn paragraph(&mut self, name: Cell, text: &Cell, columns: usize) {
        let mut name = Some(name);
        for (n, line) in wrap(&text.text, columns).into_iter().enumerate() {
            let line = Cell {
                text: line,
                style: text.style,
                continued: n > 0,
            };
            self.row([name.take().unwrap_or_default(), line]);
        }
    }

    /// Returns the lines, indented by `indent` spaces and without trailing spaces.
    pub fn lines(&self, indent: usize) -> Vec<String> {
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| width(&cell.text)).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.sides.len()).map(width).collect();
        let rows = self.rows.iter().enumerate();
        let lines = rows.map(|(n, row)| {
            let first = (n == 0).then_some(GRID);
            let header = (self.header == Some(n)).then_some(HEADER);
            let mut line = " ".repeat(indent);
            line.extend(first.into_iter().chain(header));
            self.push(row, &widths, &mut line);
            line
        });
        lines.collect()
    }

    fn push(&self, row: &[Cell], widths: &[usize], line: &mut String) {
        let columns = widths.iter().zip(&self.sides).enumerate();
        let columns = columns.filter(|(_, (wide, _))| **wide > 0);
        let cells = columns.map(|(column, (&wide, &side))| {
            let cell = row.get(column).cloned().unwrap_or_default();
            let mark = match side {
                _ if cell.continued => CONTINUED,
                Left => LEFT,
                Right => RIGHT,
            };
            (Some(mark), with_style(cell.style, &cell.text), wide, side)
        });
        push_cells(line, cells);
    }
}

/// Adds cells, each with its mark, text and width, to a line; without trailing spaces.
pub(super) fn push_cells(
    line: &mut String,
    cells: impl IntoIterator<Item = (Option<char>, String, usize, Side)>,
) {
    let mut blanks = 0;
    for (mark, text, wide, side) in cells {
        let padding = wide.saturating_sub(width(&text));
        let (before, after) = match side {
            Left => (0, padding),
            Right => (padding, 0),
        };
        // Spaces are written only before the next text.
        if text.is_empty() {
            line.extend(mark);
            blanks += wide + GAP;
            continue;
        }
        // The padding of a number follows its mark, that of a text precedes the next mark.
        line.extend(mark.filter(|_| side == Right));
        line.push_str(&" ".repeat(blanks + before));
        line.extend(mark.filter(|_| side == Left));
        line.push_str(&text);
        blanks = after + GAP;
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
        let lines = grid.lines(1).into_iter();
        let lines: Vec<_> = lines
            .map(|line| anstream::adapter::strip_str(&line).to_string())
            .collect();
        assert_eq!(lines, [" ✓    0.5  m", " ✗  12.25", " ✓         s"]);
    }
}
