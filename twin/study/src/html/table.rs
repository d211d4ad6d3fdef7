//! Tables in HTML.

use super::text::{element, escaped};

/// A table whose columns are numbers but for the first `words`.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    head: Vec<String>,
    words: usize,
    rows: Vec<(String, Vec<String>)>,
}

/// More columns than this take all the width there is.
const WIDE: usize = 7;
/// And more than this do not even have that.
const WIDEST: usize = 14;

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
        // Where there are many columns there is no room for reasons beside them: they get a line of their own below.
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
        let heads = vec!["head"; columns - 1];
        let heads: Vec<&str> = heads.into_iter().chain(["why"]).collect();
        let mut table = Table::new(&heads, 1);
        let mut cells = vec!["1".to_owned(); columns - 1];
        cells.push("it fell".to_owned());
        table.row("first bad", cells);
        table.row("", vec!["1".to_owned(); columns - 1]);
        table.html()
    }

    #[test]
    fn reasons_stand_beside_a_few_columns_and_below_many() {
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
