//! Parts of pages as text, for tests.

use twinrig_report::page::{Block, Card};
use twinrig_report::table::Table;

/// Returns the rows of a table below its head, without empty columns.
pub(crate) fn rows(table: &Table) -> Vec<String> {
    let lines = table.markdown();
    let cells = |line: &str| -> Vec<String> {
        let cells = line.trim_matches('|').split(" | ");
        cells.map(|cell| cell.trim().to_owned()).collect()
    };
    let lines: Vec<Vec<String>> = lines.lines().map(cells).collect();
    let filled = |column: usize| lines[2..].iter().any(|line| !line[column].is_empty());
    let columns: Vec<usize> = (0..lines[0].len()).filter(|&n| filled(n)).collect();
    let kept = |line: &Vec<String>| {
        let cells = columns.iter().map(|&column| line[column].as_str());
        cells.collect::<Vec<_>>().join(" | ")
    };
    std::iter::once(&lines[0])
        .chain(&lines[2..])
        .map(kept)
        .collect()
}

/// Returns the tables of a section.
pub(crate) fn tables(blocks: &[Block]) -> Vec<Vec<String>> {
    let tables = blocks.iter().filter_map(|block| match block {
        Block::Table(table) => Some(rows(table)),
        _ => None,
    });
    tables.collect()
}

/// Compares cards with quantity, value and further information of each.
#[track_caller]
pub(crate) fn assert_cards<const COUNT: usize>(found: &[Card], expected: [[&str; 3]; COUNT]) {
    let expected = expected.map(|[what, value, more]| Card::new(what, value, more));
    assert_eq!(format!("{found:?}"), format!("{expected:?}"));
}
