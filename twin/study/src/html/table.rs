//! Tables in HTML.

use super::text::{element, escaped};

/// A table whose columns are numbers but for the first `words`.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    head: Vec<String>,
    words: usize,
    rows: Vec<(String, Vec<String>)>,
}

impl Table {
    pub(crate) fn new(head: &[&str], words: usize) -> Self {
        Self {
            head: head.iter().map(|&text| text.to_owned()).collect(),
            words,
            rows: Vec::new(),
        }
    }

    /// Adds a row of a class; its cells are HTML.
    pub(crate) fn row(&mut self, class: &str, cells: Vec<String>) {
        self.rows.push((class.to_owned(), cells));
    }

    pub(crate) fn html(&self) -> String {
        // A column without any content says nothing.
        let filled = |column: usize| {
            let mut cells = self.rows.iter().filter_map(|(_, cells)| cells.get(column));
            cells.any(|cell| !cell.is_empty())
        };
        let columns: Vec<usize> = (0..self.head.len()).filter(|&n| filled(n)).collect();
        // Words stand on the left, and reasons, which come last and may be long.
        let last = self.head.len() - 1;
        let reasons = |head: &str| head.is_empty() || head.starts_with("why");
        let side = |column: usize| match &*self.head[column] {
            head if column == last && reasons(head) => "w",
            _ if column < self.words => "",
            _ => "n",
        };
        let head: String = columns
            .iter()
            .map(|&n| element("th", side(n), &escaped(&self.head[n])))
            .collect();
        let mut body = String::new();
        for (class, cells) in &self.rows {
            let cells: String = columns
                .iter()
                .map(|&n| element("td", side(n), cells.get(n).map_or("", String::as_str)))
                .collect();
            body += &element("tr", class, &cells);
            body.push('\n');
        }
        format!(
            "<div class=\"scroll\"><table><thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n"
        )
    }
}
