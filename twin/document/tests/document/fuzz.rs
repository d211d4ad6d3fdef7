//! Arbitrary file contents cause no panic.

use std::sync::Arc;

use proptest::prelude::*;
use twinrig_document::{
    Document, DocumentError, Item, Place, Problem, Range, Reported, Source, Table,
};
use twinrig_kernel::Unit;

/// Reads every key of a table and of the tables below it with every accessor.
fn read_all_keys(table: &Table<'_>) -> Result<(), Reported> {
    for key in table.keys() {
        if let Some(item) = table.get(key) {
            read_as_every_type(&item)?;
        }
    }
    Ok(())
}

fn read_as_every_type(item: &Item<'_>) -> Result<(), Reported> {
    let _ = item.quantity(Unit::Meter, &Range::POSITIVE);
    let _ = item.number(&Range::ANY);
    let _ = item.duration();
    let _ = item.natural();
    let _ = item.boolean();
    let _ = item.choice(&[("trot", 0), ("pace", 1)]);
    let _ = item.overrides();
    if let Ok(items) = item.list() {
        items.iter().try_for_each(read_as_every_type)?;
    }
    item.table().map_or(Ok(()), |table| read_all_keys(&table))
}

fn read(bytes: Vec<u8>) -> Result<(), DocumentError> {
    let document = Document::from_bytes("fuzz.toml", bytes)?;
    document.check(read_all_keys)
}

/// Text that resembles TOML: keys, values, brackets, in any order.
fn nearly_toml() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        "[a-c]{1,2}",
        Just(" = ".to_owned()),
        Just("\n".to_owned()),
        Just("[a]\n".to_owned()),
        Just("[[b]]\n".to_owned()),
        Just("{ ".to_owned()),
        Just(" }".to_owned()),
        Just("[".to_owned()),
        Just("]".to_owned()),
        Just(", ".to_owned()),
        Just("'3 cm'".to_owned()),
        Just("\"é\\u0000\"".to_owned()),
        Just("\"\"\"".to_owned()),
        Just("1979-05-27".to_owned()),
        Just("nan".to_owned()),
        Just("0x7fffffffffffffffffff".to_owned()),
        "[-+]?[0-9_.e]{1,8}",
        Just("a.b.c = 1\n".to_owned()),
        Just("\u{feff}\r".to_owned()),
    ];
    proptest::collection::vec(piece, 0..24).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn arbitrary_bytes_cause_no_panic(bytes: Vec<u8>) {
        if let Err(error) = read(bytes) {
            prop_assert!(!error.problems.is_empty());
            prop_assert!(error.to_string().contains("fuzz.toml"));
        }
    }

    #[test]
    fn nearly_toml_causes_no_panic(text in nearly_toml()) {
        if let Err(error) = read(text.into_bytes()) {
            prop_assert!(!error.problems.is_empty());
            prop_assert!(error.to_string().contains("fuzz.toml"));
        }
    }

    #[test]
    fn arbitrary_settings_cause_no_panic(key in nearly_toml(), value in ".*", text in nearly_toml()) {
        if let Ok(mut document) = Document::parse("fuzz.toml", &text) {
            let _ = document.set("--set", &key, &value);
            let _ = document.set("--set", "a.b", &value);
            let _ = document.check(read_all_keys);
        }
    }

    // An escape character of a file must not reach the terminal.
    #[test]
    fn excerpt_has_a_mark_and_no_control_character(
        text in "([a-z \\tµ漢\\x1b\\x07é]{0,200}\\r?\\r?\\n?){0,4}",
        start in 0_usize..800,
        length in 0_usize..400,
    ) {
        let source = Arc::new(Source::new("fuzz.toml", text));
        let place = Place::new(source, start..start + length);
        let line = place.line_text();
        let shown = Problem::at(&place, line, line).to_string();
        // The end of a line is before its carriage returns.
        let column = place.column().min(line.chars().count() + 1);
        let position = format!("--> fuzz.toml:{}:{column}\n", place.line());
        prop_assert!(shown.contains(&position) && shown.contains('^'), "{}", shown);
        prop_assert!(!shown.chars().any(|c| c.is_control() && c != '\n'), "{}", shown);
    }
}
