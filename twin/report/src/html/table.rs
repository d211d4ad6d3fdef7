//! HTML tables.

use super::element::{element, escaped};

/// Table of numbers, which are right-aligned, and texts.
#[derive(Clone, Debug)]
pub(crate) struct HtmlTable {
    head: Vec<String>,
    /// Whether each column has texts.
    texts: Vec<bool>,
    rows: Vec<(String, Vec<String>)>,
}

/// Greatest number of columns of a normal table; wider ones use the full width.
const WIDE: usize = 7;
/// Greatest number of columns at the full width; wider ones use a smaller font.
const WIDEST: usize = 14;

impl HtmlTable {
    /// Creates a table whose columns have these names, and texts or numbers.
    pub(crate) fn of_columns(columns: impl IntoIterator<Item = (impl Into<String>, bool)>) -> Self {
        let columns = columns.into_iter().map(|(name, text)| (name.into(), text));
        let (head, texts) = columns.unzip();
        Self {
            head,
            texts,
            rows: Vec::new(),
        }
    }

    /// Adds a row of a class; its cells are HTML.
    pub(crate) fn row(&mut self, class: &str, cells: Vec<String>) {
        self.rows.push((class.to_owned(), cells));
    }

    /// Returns the element.
    pub(crate) fn html(&self) -> String {
        // Empty columns are omitted.
        let filled = |column: usize| {
            let mut cells = self.rows.iter().filter_map(|(_, cells)| cells.get(column));
            cells.any(|cell| !cell.is_empty())
        };
        let columns: Vec<usize> = (0..self.head.len()).filter(|&n| filled(n)).collect();
        // Text columns are left-aligned, as is the last one with reasons, which may be long.
        let last = self.head.len() - 1;
        let reasons = |head: &str| head.is_empty() || head.starts_with("why");
        let side = |column: usize| match &*self.head[column] {
            head if column == last && reasons(head) => "w",
            _ if self.texts[column] => "",
            _ => "n",
        };
        // In a wide table the reasons have separate rows below, as there is no room for a column.
        let wide = columns.len() > WIDE;
        let (columns, below) = match columns.split_last() {
            Some((&reason, others)) if wide && side(reason) == "w" => (others, Some(reason)),
            _ => (&*columns, None),
        };
        let head: String = columns
            .iter()
            .map(|&n| element("th", side(n), &escaped(&self.head[n])))
            .collect();
        let mut body = String::new();
        for (class, cells) in &self.rows {
            let cell = |n: usize| cells.get(n).map_or("", String::as_str);
            let line: String = columns
                .iter()
                .map(|&n| element("td", side(n), cell(n)))
                .collect();
            body += &element("tr", class, &line);
            body.push('\n');
            let reason = below.map_or("", cell);
            if !reason.is_empty() {
                let class = class.replace("first", "");
                let span = columns.len();
                let line = format!("<td colspan=\"{span}\">{reason}</td>");
                body += &element("tr", &format!("reason {}", class.trim()), &line);
                body.push('\n');
            }
        }
        let class = match columns.len() {
            count if count > WIDEST => " class=\"wide widest\"",
            _ if wide => " class=\"wide\"",
            _ => "",
        };
        format!(
            "<div class=\"scroll\"><table{class}><thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(columns: usize) -> String {
        let head = |column: usize| if column == columns { "why" } else { "head" };
        let mut table = HtmlTable::of_columns((1..=columns).map(|n| (head(n), n == 1)));
        let mut cells = vec!["1".to_owned(); columns - 1];
        cells.push("it fell".to_owned());
        table.row("first bad", cells);
        table.row("", vec!["1".to_owned(); columns - 1]);
        table.html()
    }

    #[test]
    fn empty_columns_are_omitted() {
        let mut table = HtmlTable::of_columns([("run", true), ("empty", false), ("count", false)]);
        table.row("", ["trot", "", "1"].map(str::to_owned).into());
        assert!(!table.html().contains("empty"));
    }

    #[test]
    fn reasons_are_a_column_of_narrow_tables_and_a_row_of_wide_ones() {
        let (few, many) = (table(4), table(14));
        assert!(few.contains("<td class=\"w\">it fell</td>") && !few.contains("colspan"));
        assert!(many.contains("<tr class=\"reason bad\"><td colspan=\"13\">it fell</td></tr>"));
        // One of the two rows has a reason, and there is no column for it.
        assert_eq!(many.matches("<tr").count(), 1 + 2 + 1);
        assert_eq!(
            many.matches("<th").count() - many.matches("<thead").count(),
            13
        );
    }
}
