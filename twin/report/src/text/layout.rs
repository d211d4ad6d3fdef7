//! Layout of reports: lines and tables that fit the columns of a terminal.
//!
//! The texts of a table that is too wide are wrapped in narrower columns; its last text follows
//! below each row if that takes fewer lines. Where the numbers need more columns than there are,
//! those that do not fit follow in further lines of each row, aligned among themselves; where these
//! would be many, each value follows in a line with the name of its column. Numbers are never cut,
//! nor are words, such as paths.

use super::grid::{
    CONTINUED, GAP, GRID, HEADER, LEFT, Left, MARKS, RIGHT, Right, Side, push_cells,
};
use super::width::{fit_line, width, words, wrap};

/// Indentation of the further lines of a row, in addition to that of the table \[columns\].
const HANGING: usize = 4;
/// Least width of a text that is wrapped beside other columns \[columns\].
const TEXT_LEAST: usize = 16;
/// Least width of a text that is wrapped as the last one of a line of a row \[columns\].
const LAST_LEAST: usize = 24;

/// Greatest number of lines of a row in which columns with names are aligned.
const LINES_MOST: usize = 2;

/// Returns a report without the marks of its tables; its lines fit `columns` if there is a limit.
pub fn laid_out(text: &str, columns: Option<usize>) -> String {
    let mut lines = Vec::new();
    let mut rows: Vec<Row<'_>> = Vec::new();
    for line in text.split('\n') {
        let row = Row::of(line);
        if row.as_ref().is_none_or(|row| row.begins) {
            table(&std::mem::take(&mut rows), columns, &mut lines);
        }
        match (row, columns) {
            (Some(row), _) => rows.push(row),
            (None, Some(columns)) => lines.push(fit_line(line, columns)),
            (None, None) => lines.push(line.to_owned()),
        }
    }
    table(&rows, columns, &mut lines);
    lines.join("\n")
}

/// Adds the lines of a table.
fn table(rows: &[Row<'_>], columns: Option<usize>, lines: &mut Vec<String>) {
    let natural: Vec<String> = rows.iter().map(Row::natural).collect();
    match columns {
        Some(columns) if natural.iter().any(|line| width(line) > columns) => {
            let table = Table::of(rows, columns);
            let below = table.below();
            let beside = table.beside(below.is_some());
            let forms = [below, beside].into_iter().flatten();
            let forms = forms.map(|form| table.lines(&form));
            let shortest = forms.min_by_key(Vec::len);
            lines.extend(shortest.unwrap_or_else(|| {
                let stacked = table.stacked();
                match &table.header {
                    Some(names) if has_many(names, &stacked) => table.named(names),
                    _ => table.lines(&stacked),
                }
            }));
        }
        _ => lines.extend(natural),
    }
}

/// Line of a grid, with its marks.
struct Row<'t> {
    line: &'t str,
    indent: usize,
    begins: bool,
    is_header: bool,
    cells: Vec<(char, &'t str)>,
}

impl<'t> Row<'t> {
    /// Returns the row of a line; none if it has no cells.
    fn of(line: &'t str) -> Option<Self> {
        let is_cell = |c: char| [CONTINUED, LEFT, RIGHT].contains(&c);
        let start = line.find(is_cell)?;
        let mut cells = Vec::new();
        for (at, mark) in line.match_indices(is_cell) {
            let from = at + mark.len();
            let to = line[from..].find(is_cell).map_or(line.len(), |n| from + n);
            let text = line[from..to].trim_end_matches(' ');
            cells.push(match mark.chars().next() {
                Some(RIGHT) => (RIGHT, text.trim_start_matches(' ')),
                mark => (mark.unwrap_or(LEFT), text),
            });
        }
        Some(Self {
            line,
            indent: width(&line[..start]),
            begins: line[..start].contains(GRID),
            is_header: line[..start].contains(HEADER),
            cells,
        })
    }

    /// Returns the line as it was written.
    fn natural(&self) -> String {
        self.line.replace(MARKS, "")
    }
}

/// Column of a table in a line of its rows.
#[derive(Clone, Copy)]
struct Column {
    index: usize,
    wide: usize,
}

struct Table {
    indent: usize,
    columns: usize,
    sides: Vec<Side>,
    /// Names of the columns.
    header: Option<Vec<String>>,
    /// Rows of cells.
    rows: Vec<Vec<String>>,
}

impl Table {
    fn of(rows: &[Row<'_>], columns: usize) -> Self {
        let mut table = Self {
            indent: rows.first().map_or(0, |row| row.indent).min(columns / 2),
            columns,
            sides: Vec::new(),
            header: None,
            rows: Vec::new(),
        };
        for row in rows {
            let continued = row.cells.iter().any(|(mark, _)| *mark == CONTINUED);
            if let (true, Some(above)) = (continued, table.rows.last_mut()) {
                for (cell, (_, text)) in above.iter_mut().zip(&row.cells) {
                    if !text.is_empty() {
                        cell.push(' ');
                        cell.push_str(text);
                    }
                }
                continue;
            }
            let sides = row.cells.iter().map(|(mark, _)| match *mark {
                RIGHT => Right,
                _ => Left,
            });
            table.sides = sides.collect();
            let cells = row.cells.iter().map(|(_, text)| (*text).to_owned());
            let cells: Vec<String> = cells.collect();
            table.header = row.is_header.then(|| cells.clone()).or(table.header.take());
            table.rows.push(cells);
        }
        table
    }

    fn greatest(&self, column: usize, of: impl Fn(&str) -> usize) -> usize {
        let cells = self.rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| of(cell)).max().unwrap_or(0)
    }

    /// Columns that the cells of a line may take.
    fn available(&self) -> usize {
        self.columns - self.indent
    }

    /// Returns the columns in one line, with the texts, or the last one only, as narrow as they
    /// have to be; none if they do not fit.
    fn beside(&self, last_only: bool) -> Option<Vec<Vec<Column>>> {
        let last = self.sides.len().checked_sub(1)?;
        let least = |index: usize| {
            let longest = |most| self.greatest(index, |text| longest_word(text, most));
            match index == last {
                // Longer words have lines of their own.
                true => longest(self.available() / 2).max(TEXT_LEAST),
                false if last_only => usize::MAX,
                false => longest(usize::MAX),
            }
        };
        self.narrowed(last + 1, least).map(|line| vec![line])
    }

    /// Returns the columns with the last text in a line of its own; none if the other ones do not
    /// fit in one line, or if there is no such text.
    fn below(&self) -> Option<Vec<Vec<Column>>> {
        let last = self.sides.len().checked_sub(1)?;
        // Words in a column of their own are no text.
        let is_text = self.sides[last] == Left && self.greatest(last, width) > TEXT_LEAST;
        if last < 2 || !is_text {
            return None;
        }
        let least = |index| {
            let longest = self.greatest(index, |text| longest_word(text, usize::MAX));
            longest.max(TEXT_LEAST)
        };
        let line = self.narrowed(last, least)?;
        let wide = self.available() - HANGING;
        Some(vec![line, vec![Column { index: last, wide }]])
    }

    /// Returns the first `count` columns in one line, with texts at least as wide as `least` says.
    fn narrowed(&self, count: usize, least: impl Fn(usize) -> usize) -> Option<Vec<Column>> {
        let natural = (0..count).map(|index| Column {
            index,
            wide: self.greatest(index, width),
        });
        let mut columns: Vec<Column> = natural.collect();
        let least = columns.iter().map(|it| match self.sides[it.index] {
            Right => it.wide,
            Left => it.wide.min(least(it.index)),
        });
        let least: Vec<usize> = least.collect();
        let gaps = GAP * count.saturating_sub(1);
        let mut total = columns.iter().map(|it| it.wide).sum::<usize>() + gaps;
        while total > self.available() {
            let wider = columns.iter_mut().filter(|it| it.wide > least[it.index]);
            wider.max_by_key(|it| it.wide)?.wide -= 1;
            total -= 1;
        }
        Some(columns)
    }

    /// Returns the columns in as many lines as they need.
    fn stacked(&self) -> Vec<Vec<Column>> {
        let mut lines: Vec<Vec<Column>> = vec![Vec::new()];
        let mut free = self.available();
        for (index, &side) in self.sides.iter().enumerate() {
            let natural = self.greatest(index, width);
            let longest = self.greatest(index, |text| longest_word(text, usize::MAX));
            let is_wrapped = side == Left && free >= longest.max(LAST_LEAST);
            let is_new = lines.last().is_some_and(|line| !line.is_empty());
            if natural > free && is_new && !is_wrapped {
                lines.push(Vec::new());
                free = self.available() - HANGING;
            }
            let wide = natural.min(free);
            if let Some(line) = lines.last_mut() {
                line.push(Column { index, wide });
            }
            free = free.saturating_sub(wide + GAP);
        }
        lines
    }

    /// Returns the lines of all rows, whose columns are in these lines.
    fn lines(&self, lines: &[Vec<Column>]) -> Vec<String> {
        let mut out = Vec::new();
        for row in &self.rows {
            let before = out.len();
            for (n, columns) in lines.iter().enumerate() {
                let indent = self.indent + if n == 0 { 0 } else { HANGING };
                self.row(row, columns, indent, &mut out);
            }
            if out.len() == before {
                out.push(String::new());
            }
        }
        out
    }

    /// Returns the rows as blocks: the cells up to that of the first column with a name, if it is a
    /// text, then a line for each name with its values.
    fn named(&self, names: &[String]) -> Vec<String> {
        let first = names.iter().position(|name| !name.is_empty());
        let heading = first.filter(|first| self.sides[*first] == Left);
        let mut out = Vec::new();
        for row in self.rows.iter().filter(|row| *row != names) {
            let mut lines: Vec<String> = Vec::new();
            for (index, cell) in row.iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
                let name = names.get(index).map_or("", String::as_str);
                let continues = name.is_empty() || heading >= Some(index);
                match lines.last_mut().filter(|_| continues) {
                    Some(line) => *line = format!("{line}{}{cell}", " ".repeat(GAP)),
                    None if continues => lines.push(cell.clone()),
                    None => lines.push(format!("{name}: {cell}")),
                }
            }
            for (n, line) in lines.iter().enumerate() {
                let indent = self.indent + if n == 0 { 0 } else { HANGING };
                let line = fit_line(&(" ".repeat(indent) + line), self.columns);
                out.extend(line.split('\n').map(str::to_owned));
            }
        }
        out
    }

    /// Adds the lines of one row in these columns; none if all cells are empty.
    fn row(&self, row: &[String], columns: &[Column], indent: usize, out: &mut Vec<String>) {
        let cell = |column: &Column| row.get(column.index).map_or("", String::as_str);
        // The longest words of a last text take the whole line, below the other cells.
        let below = columns.last().filter(|last| {
            let text = cell(last);
            columns.len() > 1 && longest_word(text, usize::MAX) > last.wide
        });
        let cells: Vec<Vec<String>> = columns
            .iter()
            .map(|column| match (cell(column), self.sides[column.index]) {
                ("", _) => Vec::new(),
                _ if below.is_some_and(|last| last.index == column.index) => Vec::new(),
                (text, Right) => vec![text.to_owned()],
                (text, Left) => wrap(text, column.wide),
            })
            .collect();
        for n in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
            let mut line = " ".repeat(indent);
            let cells = columns.iter().zip(&cells).map(|(column, lines)| {
                let text = lines.get(n).cloned().unwrap_or_default();
                (None, text, column.wide, self.sides[column.index])
            });
            push_cells(&mut line, cells);
            out.push(line);
        }
        if let Some(last) = below {
            let indent = (self.indent + HANGING).min(self.columns / 2);
            let lines = wrap(cell(last), self.columns - indent).into_iter();
            out.extend(lines.map(|line| " ".repeat(indent) + &line));
        }
    }
}

/// Whether more than two of these lines have columns with names.
fn has_many(names: &[String], lines: &[Vec<Column>]) -> bool {
    let is_named = |column: &Column| names.get(column.index).is_some_and(|it| !it.is_empty());
    let named = lines.iter().filter(|line| line.iter().any(is_named));
    named.count() > LINES_MOST
}

/// Returns the width of the longest word that has at most `most` columns; a number and its unit are
/// one word.
fn longest_word(text: &str, most: usize) -> usize {
    let words = words(text).into_iter().map(|(word, _)| width(&word));
    words.filter(|wide| *wide <= most).max().unwrap_or(0)
}

#[cfg(test)]
mod tests;
