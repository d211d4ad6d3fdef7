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

use std::fmt::Write as _;

use crate::html::element::{element, escaped};
use crate::html::table::HtmlTable;
use crate::number::{fixed, percent, plain, si};
use crate::text::grid::{self, Grid, Side};
use crate::text::style::{DIM, GREEN, RED, YELLOW};

/// Column of a table.
#[derive(Clone, Debug)]
pub struct Column {
    name: String,
    role: Role,
    unit: String,
    places: Option<usize>,
    only_on_pages: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// Names the row.
    Label,
    Text,
    /// Verdict of the row.
    Status,
    Number,
    /// Reason why the row has no values, which may be long.
    Reason,
}

impl Column {
    fn of(name: impl Into<String>, role: Role) -> Self {
        Self {
            name: name.into(),
            role,
            unit: String::new(),
            places: None,
            only_on_pages: false,
        }
    }

    /// Creates a column of texts that name their rows.
    pub fn label(name: impl Into<String>) -> Self {
        Self::of(name, Role::Label)
    }

    /// Creates a column of texts.
    pub fn text(name: impl Into<String>) -> Self {
        Self::of(name, Role::Text)
    }

    /// Creates a column of verdicts.
    pub fn status(name: impl Into<String>) -> Self {
        Self::of(name, Role::Status)
    }

    /// Creates a column of numbers with three significant digits.
    pub fn number(name: impl Into<String>) -> Self {
        Self::of(name, Role::Number)
    }

    /// Creates a last column of reasons, which have a row of their own where there is no room.
    pub fn reason() -> Self {
        Self::of("why", Role::Reason)
    }

    /// Sets the unit of the numbers: its symbol.
    #[must_use]
    pub fn in_unit(mut self, symbol: impl Into<String>) -> Self {
        self.unit = symbol.into();
        self
    }

    /// Sets the number of decimal places. The unit then has no prefix, and pages show it in the
    /// head.
    #[must_use]
    pub fn with_places(mut self, places: usize) -> Self {
        self.places = Some(places);
        self
    }

    /// Omits the column from text, where there is less room.
    #[must_use]
    pub fn only_on_pages(mut self) -> Self {
        self.only_on_pages = true;
        self
    }

    /// Returns the head where all numbers are in the unit of the column.
    fn head(&self) -> String {
        match (&*self.unit, self.places) {
            ("", _) | (_, None) => self.name.clone(),
            (unit, Some(_)) => format!("{} [{unit}]", self.name),
        }
    }

    /// Formats a number without the unit that the head has.
    fn bare(&self, value: f64) -> String {
        match self.places {
            Some(places) => fixed(value, places),
            None if self.unit.is_empty() => plain(value),
            None => si(value, &self.unit),
        }
    }

    /// Formats a number with its unit.
    fn with_unit(&self, value: f64) -> String {
        match (&*self.unit, self.places) {
            ("", _) | (_, None) => self.bare(value),
            (unit, Some(_)) => format!("{} {unit}", self.bare(value)),
        }
    }
}

/// Value of a cell.
#[derive(Clone, Debug, Default, PartialEq)]
enum Value {
    #[default]
    Empty,
    Text(String),
    Code(String),
    Number(f64),
    Share(f64),
    Interval(Interval),
}

/// Interval of a share, drawn on pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Ends.
    pub ends: [f64; 2],
    /// Estimate, if there is one.
    pub share: Option<f64>,
    /// Required shares, least and greatest.
    pub bounds: [Option<f64>; 2],
}

impl Interval {
    fn text(&self) -> String {
        let [low, high] = self.ends;
        format!("{:.1} … {}", 100.0 * low, percent(high))
    }

    /// Draws the interval on a scale from 0 to 1.
    fn svg(&self) -> String {
        const WIDTH: f64 = 120.0;
        let x = |share: f64| 2.0 + (WIDTH - 4.0) * share.clamp(0.0, 1.0);
        let [low, high] = self.ends.map(x);
        let mut bounds = String::new();
        for at in self.bounds.into_iter().flatten().map(x) {
            // Writing to a string cannot fail.
            let _ = write!(bounds, "<polyline points=\"{at:.1},1 {at:.1},13\"/>");
        }
        let dot = self.share.map_or(String::new(), |share| {
            format!("<circle cx=\"{:.1}\" cy=\"7\" r=\"3.2\"/>", x(share))
        });
        format!(
            "<svg class=\"interval\" viewBox=\"0 0 {WIDTH} 14\" role=\"img\" aria-label=\"{}\">\
             <g class=\"c7\">{bounds}</g>\
             <g class=\"c0\"><polyline points=\"{low:.1},7 {high:.1},7\"/>{dot}</g></svg>",
            self.text()
        )
    }
}

/// Meaning of a value for the reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// As expected.
    #[default]
    Plain,
    /// A success.
    Good,
    /// A failure, or the first of several.
    Bad,
    /// With a reservation.
    Doubtful,
    /// Of less interest.
    Faint,
}

/// Cell of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    value: Value,
    tone: Tone,
    detail: String,
}

impl Cell {
    /// Creates an empty cell.
    pub fn empty() -> Self {
        Self::default()
    }

    /// Creates a cell with a share: `82.5 %`.
    pub fn share(share: f64) -> Self {
        Value::Share(share).into()
    }

    /// Creates a cell with a text that is printed as code.
    pub fn code(text: impl Into<String>) -> Self {
        Value::Code(text.into()).into()
    }

    /// Sets the tone.
    #[must_use]
    pub fn with_tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    /// Adds a text that pages show below the value.
    #[must_use]
    pub fn with_detail(mut self, detail: impl Into<String>) -> Self {
        self.detail = detail.into();
        self
    }

    fn text(&self, number: impl Fn(f64) -> String) -> String {
        match &self.value {
            Value::Empty => String::new(),
            Value::Text(text) | Value::Code(text) => text.clone(),
            Value::Number(value) => number(*value),
            Value::Share(share) => percent(*share),
            Value::Interval(interval) => interval.text(),
        }
    }
}

impl From<Value> for Cell {
    fn from(value: Value) -> Self {
        Self {
            value,
            ..Self::default()
        }
    }
}

impl From<Interval> for Cell {
    fn from(interval: Interval) -> Self {
        Value::Interval(interval).into()
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Value::Text(text).into()
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Value::Number(number).into()
    }
}

/// A count, with all of its digits.
impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        count.to_string().into()
    }
}

/// Nothing is an empty cell.
impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or_else(Self::default, Into::into)
    }
}

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
        let shown = |column: &&Column| !column.only_on_pages;
        let columns: Vec<&Column> = self.columns.iter().filter(shown).collect();
        let sides = columns.iter().map(|column| match column.role {
            Role::Number => Side::Right,
            Role::Label | Role::Text | Role::Status | Role::Reason => Side::Left,
        });
        let mut grid = Grid::new(&sides.collect::<Vec<Side>>());
        let names: Vec<&str> = columns.iter().map(|column| &*column.name).collect();
        grid.header(&names.join("|"));
        for row in &self.rows {
            let cells: Vec<(&Column, Cell)> = self
                .cells(row)
                .filter(|(column, _)| !column.only_on_pages)
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
                    match tone {
                        Tone::Plain => text.into(),
                        Tone::Good => grid::Cell::new(text, GREEN),
                        Tone::Bad => grid::Cell::new(text, RED),
                        Tone::Doubtful => grid::Cell::new(text, YELLOW),
                        Tone::Faint => grid::Cell::new(text, DIM),
                    }
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
                match (column.role, cell.tone) {
                    _ if text.is_empty() => text,
                    (_, Tone::Bad) => format!("**{text}**"),
                    (Role::Label, Tone::Faint) => format!("*{text}*"),
                    _ => text,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new([
            Column::label("run"),
            Column::number("begins").in_unit("s").with_places(2),
            Column::number("error").in_unit("m"),
            Column::number("held").only_on_pages(),
            Column::reason().only_on_pages(),
        ]);
        let bad = Cell::from(1.3e-7).with_tone(Tone::Bad);
        let begins = Cell::from(1.5).with_detail("± <2>");
        table.row(["a | b*".into(), begins, bad, Cell::share(0.825)]);
        table.begin_group();
        let [none, nothing, never] = [(); 3].map(|()| Cell::empty());
        table.row(["<c>".into(), none, nothing, never, "it fell".into()]);
        table.set_tone(Tone::Bad);
        table
    }

    #[test]
    fn text_has_units_in_its_cells_and_no_row_without_values() {
        let lines = table().grid().lines(0);
        let marks = |line: &String| {
            let text = anstream::adapter::strip_str(line).to_string();
            text.chars().filter(|c| !c.is_control()).collect::<String>()
        };
        let lines: Vec<String> = lines.iter().map(marks).collect();
        assert_eq!(lines, ["run     begins   error", "a | b*  1.50 s  130 nm"]);
    }

    #[test]
    fn page_has_units_in_its_head_and_escapes_its_cells() {
        let html = table().html();
        for expected in [
            "<th class=\"n\">begins [s]</th><th class=\"n\">error</th>",
            "<tr class=\"first\"><td><b>a | b*</b></td>",
            "<td class=\"n\">1.50<span class=\"wrap soft\">± &lt;2&gt;</span></td>",
            "<td class=\"n\"><b class=\"bad\">130 nm</b></td>",
            "<td class=\"n\">82.5 %</td>",
            "<tr class=\"bad\"><td><b>&lt;c&gt;</b></td>",
            "<span class=\"why\">it fell</span>",
        ] {
            assert!(html.contains(expected), "no {expected} in\n{html}");
        }
    }

    #[test]
    fn markdown_escapes_its_marks_and_emphasizes_failures() {
        let mut lines = table()
            .markdown()
            .lines()
            .map(str::to_owned)
            .collect::<Vec<_>>();
        lines.remove(1);
        assert_eq!(
            lines,
            [
                "| run | begins [s] | error | held | why |",
                r"| a \| b\* | 1.50 | **130 nm** | 82.5 % |  |",
                "| <c> |  |  |  | it fell |"
            ]
        );
    }
}
