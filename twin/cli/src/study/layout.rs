//! Layout of the texts of all studies: title, headline, tables, facts.

use std::path::PathBuf;

use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{BOLD, DIM, styled};

/// Text of a study for the terminal, from its title on.
pub(crate) struct StudyText {
    lines: Vec<String>,
    facts: Grid,
}

impl StudyText {
    /// Begins the text of a study of this kind; without a headline there is no line for it.
    pub(crate) fn new(scenario: &str, kind: &str, headline: String) -> Self {
        let title = format!("{}  {}", styled(BOLD, scenario), styled(DIM, kind));
        let headline = Some(headline).filter(|text| !text.is_empty());
        Self {
            lines: std::iter::once(title).chain(headline).collect(),
            facts: Grid::new(&[Left, Left]),
        }
    }

    /// Adds lines after an empty one.
    pub(crate) fn block(&mut self, lines: impl IntoIterator<Item = String>) {
        self.lines.push(String::new());
        self.lines.extend(lines);
    }

    /// Adds a table with its heading, unless it has a header only.
    pub(crate) fn table(&mut self, heading: &str, grid: &Grid) {
        let rows = grid.lines(4);
        if rows.len() > 1 {
            self.section(heading, rows);
        }
    }

    /// Adds lines with their heading.
    pub(crate) fn section(&mut self, heading: &str, lines: impl IntoIterator<Item = String>) {
        let heading = format!("  {}", styled(BOLD, heading));
        self.block(std::iter::once(heading).chain(lines));
    }

    /// Adds a fact to the list at the end.
    pub(crate) fn fact(&mut self, name: &str, text: impl Into<String>) {
        self.facts.row([Cell::new(name, DIM), text.into().into()]);
    }

    /// Ends the text with the parts that are left out, and the names of the files.
    pub(crate) fn finish(mut self, left_out: &[String], files: &[PathBuf]) -> String {
        for left in left_out {
            self.fact("left out", left);
        }
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
        let mut text = StudyText::new("trot", "study of gaits", String::new());
        text.table("none", &grid);
        grid.row(["trot", "1 m/s"].map(Cell::from));
        text.table("gaits", &grid);
        text.fact("truncated", "nothing");
        let found = text.finish(&["lcp: why".to_owned()], &["a.csv".into()]);
        let expected = "trot  study of gaits\n\n  gaits\n    gait  speed\n    trot  1 m/s\n\n  \
                        truncated  nothing\n  left out   lcp: why\n  written    a.csv";
        assert_eq!(anstream::adapter::strip_str(&found).to_string(), expected);
    }
}
