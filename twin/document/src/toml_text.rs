//! Texts of TOML.

use toml::de::{DeTable, DeValue};

/// Whether `text` is TOML with exactly one entry.
pub(crate) fn is_entry(text: &str) -> bool {
    DeTable::parse(text).is_ok_and(|table| table.get_ref().len() == 1) && !text.contains('\n')
}

/// Returns `value` as a quoted TOML string; control characters become blanks.
pub fn quoted(value: &str) -> String {
    let mut out = String::from("\"");
    for c in value.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
    debug_assert!(DeValue::parse(&out).is_ok());
    out
}
