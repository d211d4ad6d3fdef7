//! Text forms of reports: the table, the `JUnit` file, and what all tables are made of.

mod against;
mod error_bar;
pub(crate) mod junit;
pub(crate) mod left_out;
pub(crate) mod table;
mod tracking;

use anstream::adapter::strip_str;
use twinrig_rig::report::Report;

/// Returns the table of a report that `twin run` prints, without styles.
pub fn text(report: &Report) -> String {
    let text = strip_str(&table::report(report)).to_string();
    text.trim_end().to_owned()
}
