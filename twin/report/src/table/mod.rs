//! Tables with typed columns, declared once and shown as text, on pages and in Markdown.
//!
//! ```
//! use twinrig_report::table::{Column, Table};
//!
//! let mut table = Table::new([
//!     Column::label("run"),
//!     Column::number("begins").in_unit("s").with_places(2),
//! ]);
//! table.row(["trot".into(), 1.5.into()]);
//! assert_eq!(table.markdown(), "| run | begins [s] |\n|---|---|\n| trot | 1.50 |\n");
//! ```

mod cell;
mod column;
#[cfg(test)]
mod tests;

use crate::html::element::{element, escaped};
use crate::html::table::HtmlTable;
use crate::text::grid::{self, Grid, Side};

use cell::Value;
pub use cell::{Cell, Interval, Tone};
pub use column::Column;
use column::Role;

#[derive(Clone, Debug)]
struct Row {
    cells: Vec<Cell>,
    begins_group: bool,
    tone: Tone,
}

/// Rows of typed cells. Empty columns are omitted.
#[derive(Clone, Debug)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Row>,
}

impl Table {
    /// Creates a table without rows.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self {
            columns: columns.into_iter().collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row; missing cells are empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(Row {
            cells: cells.into_iter().collect(),
            begins_group: false,
            tone: Tone::Plain,
        });
    }

    /// Marks the last row as the first of a group, which a line separates.
    pub fn begin_group(&mut self) {
        if let Some(row) = self.rows.last_mut() {
            row.begins_group = true;
        }
    }

    /// Sets the tone of the whole last row.
    pub fn set_tone(&mut self, tone: Tone) {
        if let Some(row) = self.rows.last_mut() {
            row.tone = tone;
        }
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Returns the cells of a row, one for each column.
    fn cells<'t>(&'t self, row: &'t Row) -> impl Iterator<Item = (&'t Column, Cell)> {
        let cells = row.cells.iter().cloned();
        let cells = cells.chain(std::iter::repeat(Cell::default()));
        self.columns.iter().zip(cells)
    }

    /// Returns the table for terminals. A row with its labels alone is omitted.
    pub fn grid(&self) -> Grid {
        let is_filled = |n: usize| {
            let mut cells = self.rows.iter().filter_map(|row| row.cells.get(n));
            cells.any(|cell| !cell.text(|_| "0".to_owned()).is_empty())
        };
        let columns = self.columns.iter().enumerate();
        let shown = columns.map(|(n, column)| is_filled(n) && !column.only_on_pages);
        let shown: Vec<bool> = shown.collect();
        let columns = self.columns.iter().zip(&shown);
        let columns = columns.filter_map(|(column, shown)| shown.then_some(column));
        let sides = columns.clone().map(|column| match column.role {
            Role::Number => Side::Right,
            Role::Label | Role::Text | Role::Status | Role::Reason => Side::Left,
        });
        let mut grid = Grid::new(&sides.collect::<Vec<Side>>());
        let names: Vec<&str> = columns.map(|column| &*column.name).collect();
        grid.header(&names.join("|"));
        for row in &self.rows {
            let cells = self.cells(row).zip(&shown);
            let cells: Vec<(&Column, Cell)> = cells
                .filter_map(|(cell, shown)| shown.then_some(cell))
                .collect();
            let has_value = |(column, cell): &(&Column, Cell)| {
                column.role != Role::Label && cell.value != Value::Empty
            };
            if cells.iter().any(has_value) {
                grid.row(cells.iter().map(|(column, cell)| {
                    let text = cell.text(|value| column.with_unit(value));
                    let tone = if cell.tone == Tone::Plain {
                        row.tone
                    } else {
                        cell.tone
                    };
                    grid::Cell::new(text, tone.style())
                }));
            }
        }
        grid
    }

    /// Returns the table in HTML.
    pub fn html(&self) -> String {
        let columns = self.columns.iter();
        let columns = columns.map(|column| (column.head(), column.role != Role::Number));
        let mut table = HtmlTable::of_columns(columns);
        for row in &self.rows {
            let cells = self.cells(row).map(|(column, cell)| {
                let text = escaped(&cell.text(|value| column.bare(value)));
                let detail = match &*cell.detail {
                    "" => String::new(),
                    detail => element("span", "wrap soft", &escaped(detail)),
                };
                let text = match &cell.value {
                    Value::Empty => return text,
                    Value::Interval(interval) => text + &interval.svg(),
                    Value::Code(_) => element("code", "", &text),
                    Value::Link(_, to) => format!("<a href=\"{}\">{text}</a>", escaped(to)),
                    _ if text.is_empty() => return text,
                    _ => text,
                };
                let text = match (column.role, cell.tone) {
                    (Role::Label, Tone::Faint) => element("i", "", &text),
                    (Role::Label, _) => element("b", "", &text),
                    (Role::Reason, _) => element("span", "why", &text),
                    (Role::Status, Tone::Bad) => element("span", "tag bad", &text),
                    (Role::Status, Tone::Good) => element("span", "tag ok", &text),
                    (Role::Status, _) => element("span", "tag", &text),
                    (_, Tone::Bad) => element("b", "bad", &text),
                    (_, Tone::Doubtful) => element("span", "doubtful", &text),
                    (_, Tone::Faint) => element("span", "soft", &text),
                    (_, Tone::Plain | Tone::Good) => text,
                };
                text + &detail
            });
            let first = if row.begins_group { "first" } else { "" };
            let tone = match row.tone {
                Tone::Bad => "bad",
                Tone::Faint => "cut",
                _ => "",
            };
            let class = [first, tone].join(" ");
            table.row(class.trim(), cells.collect());
        }
        table.html()
    }

    /// Returns the table in Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let heads = self.columns.iter().map(|column| marked(&column.head()));
        let mut text = line(heads.collect());
        text += "|";
        text += &"---|".repeat(self.columns.len());
        text += "\n";
        for row in &self.rows {
            let cells = self.cells(row).map(|(column, cell)| {
                let text = marked(&cell.text(|value| column.bare(value)));
                let text = match (column.role, cell.tone) {
                    _ if text.is_empty() => return text,
                    _ if matches!(cell.value, Value::Code(_)) => format!("`{text}`"),
                    (_, Tone::Bad) | (Role::Status, Tone::Doubtful) => format!("**{text}**"),
                    (Role::Label, Tone::Faint) => format!("*{text}*"),
                    _ => text,
                };
                match &*cell.detail {
                    "" => text,
                    detail => format!("{text} ({})", marked(detail)),
                }
            });
            text += &line(cells.collect());
        }
        text
    }
}

/// Escapes the characters that Markdown would take as marks.
fn marked(text: &str) -> String {
    text.replace('|', r"\|").replace('*', r"\*")
}
