//! Lines of the input files in which two runs differ.

use twinrig_record::Recording;
use twinrig_report::table::{Cell, Column, Table};

/// Lines shown of a file.
const SHOWN: usize = 40;

/// Returns the lines of attached files and settings that only one of two runs has.
pub(crate) fn differing_lines([a, b]: [&Recording; 2]) -> Table {
    let mut table = Table::new([
        Column::label("file"),
        Column::text("only in A"),
        Column::text("only in B"),
    ]);
    let text = |recording: &Recording, name: &str| {
        let bytes = recording.attachment(name).unwrap_or_default();
        String::from_utf8_lossy(bytes).into_owned()
    };
    let settings = |recording: &Recording| recording.note("settings").unwrap_or("[]").to_owned();
    let files = b.attachments().map(|(name, _)| name);
    let files = files.map(|name| (name, text(a, name), text(b, name)));
    for (name, a_text, b_text) in files.chain([("settings", settings(a), settings(b))]) {
        let only = |of: &str, other: &str| -> Vec<String> {
            let other: Vec<&str> = other.lines().map(str::trim).collect();
            let lines = of.lines().map(str::trim);
            let lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
            let only = lines.filter(|line| !other.contains(line));
            only.take(SHOWN).map(str::to_owned).collect()
        };
        let (in_a, in_b) = (only(&a_text, &b_text), only(&b_text, &a_text));
        for n in 0..in_a.len().max(in_b.len()) {
            let line = |of: &[String]| of.get(n).map_or_else(Cell::empty, Cell::code);
            table.row([name.into(), line(&in_a), line(&in_b)]);
        }
    }
    table
}
