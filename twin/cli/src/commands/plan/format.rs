//! Text of parts of a plan.

use twinrig_report::text::grid::Grid;
use twinrig_report::text::style::{BOLD, styled};

/// Formats a time in milliseconds.
pub(super) fn ms(seconds: f64) -> String {
    format!("{} ms", (1e9 * seconds).round() / 1e6)
}

/// Adds a table with its title, unless it is empty.
pub(super) fn section(lines: &mut Vec<String>, title: &str, grid: &Grid) {
    let rows = grid.lines(4);
    if !rows.is_empty() {
        lines.push(String::new());
        lines.push(format!("  {}", styled(BOLD, title)));
        lines.extend(rows);
    }
}
