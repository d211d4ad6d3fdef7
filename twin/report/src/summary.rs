//! Summary of a result for terminals: title, headline, tables, facts.

use std::path::PathBuf;

use crate::table::Table;
use crate::text::grid::{Cell, Grid, Left};
use crate::text::style::{BOLD, DIM, styled};

/// Summary of a result, from its title on.
#[derive(Clone, Debug)]
pub struct Summary {
    lines: Vec<String>,
    facts: Grid,
}

impl Summary {
    /// Begins the summary of a result of this kind; without a headline there is no line for it.
    pub fn new(scenario: &str, kind: &str, headline: String) -> Self {
        let title = format!("{}  {}", styled(BOLD, scenario), styled(DIM, kind));
        let headline = Some(headline).filter(|text| !text.is_empty());
        Self {
            lines: std::iter::once(title).chain(headline).collect(),
            facts: Grid::new(&[Left, Left]),
        }
    }

    /// Adds lines after an empty one.
    pub fn block(&mut self, lines: impl IntoIterator<Item = String>) {
        self.lines.push(String::new());
        self.lines.extend(lines);
    }

    /// Adds a table with its heading, unless it has no rows.
    pub fn table(&mut self, heading: &str, table: &Table) {
        self.grid(heading, &table.grid());
    }

    /// Adds a grid with its heading, unless it has a header only.
    pub fn grid(&mut self, heading: &str, grid: &Grid) {
        let rows = grid.lines(4);
        if rows.len() > 1 {
            self.section(heading, rows);
        }
    }

    /// Adds lines with their heading.
    pub fn section(&mut self, heading: &str, lines: impl IntoIterator<Item = String>) {
        let heading = format!("  {}", styled(BOLD, heading));
        self.block(std::iter::once(heading).chain(lines));
    }

    /// Adds a fact to the list at the end.
    pub fn fact(&mut self, name: &str, text: impl Into<String>) {
        self.facts.row([Cell::new(name, DIM), text.into().into()]);
    }

    /// Adds the parts that are left out.
    pub fn left_out(&mut self, parts: &[String]) {
        for part in parts {
            self.fact("left out", part);
        }
    }

    /// Ends the text with the names of the files.
    pub fn finish(mut self, files: &[PathBuf]) -> String {
        for file in files {
            self.fact("written", file.display().to_string());
        }
        let facts = self.facts.lines(2);
        self.block(facts);
        self.lines.join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_without_rows_and_empty_headlines_are_omitted() {
        let mut grid = Grid::new(&[Left, Left]);
        grid.header("gait | speed");
        let mut text = Summary::new("trot", "study of gaits", String::new());
        text.grid("none", &grid);
        grid.row(["trot", "1 m/s"].map(Cell::from));
        text.grid("gaits", &grid);
        text.fact("truncated", "nothing");
        text.left_out(&["lcp: why".to_owned()]);
        let found = text.finish(&["a.csv".into()]);
        let expected = "trot  study of gaits\n\n  gaits\n    gait  speed\n    trot  1 m/s\n\n  \
                        truncated  nothing\n  left out   lcp: why\n  written    a.csv";
        assert_eq!(anstream::adapter::strip_str(&found).to_string(), expected);
    }
}
