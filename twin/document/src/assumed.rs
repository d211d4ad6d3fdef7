//! Assumed values: `{ value = "2 N·m", from = "1 N·m", to = "4 N·m" }` in place of a value.

use twinrig_kernel::Unit;

use crate::document::Document;
use crate::error::DocumentError;
use crate::item::Item;
use crate::node::{Node, Value};
use crate::probe;
use crate::problems::{Problems, Reported};
use crate::range::Range;

const VALUE: &str = "value";

/// A value that is assumed, with the interval in which it is expected.
#[derive(Clone, Debug, PartialEq)]
pub struct AssumedValue {
    /// Dotted key; an element of a list has its name, or its index from 0.
    pub key: String,
    /// The value, in the SI unit.
    pub value: f64,
    /// Lower end of the interval.
    pub from: f64,
    /// Upper end, above the lower one.
    pub to: f64,
    /// Unit of all three.
    pub unit: Unit,
}

impl Document {
    /// Replaces each table with the key `value` by that value, and returns them with their
    /// intervals, in the order of the text.
    ///
    /// # Errors
    /// Every interval that lacks an end, has another unit than its value, is empty, or does not
    /// contain its value.
    pub fn take_assumed(&mut self) -> Result<Vec<AssumedValue>, DocumentError> {
        let (problems, mut found) = (Problems::default(), Vec::new());
        // A probe records numbers that a result depends on. Ends of intervals are none.
        probe::within(None, || take(&mut self.root, "", &problems, &mut found));
        let (errors, _) = problems.into_inner();
        if errors.is_empty() {
            Ok(found)
        } else {
            Err(DocumentError::of(errors))
        }
    }
}

fn take(node: &mut Node, path: &str, problems: &Problems, found: &mut Vec<AssumedValue>) {
    if let Some(value) = assumed(node) {
        let value = value.clone();
        // What is wrong has been reported.
        found.extend(read(&Item::new(node, path.to_owned(), problems)).ok());
        *node = value;
        return;
    }
    let below = |key: &str| match path {
        "" => key.to_owned(),
        _ => format!("{path}.{key}"),
    };
    match &mut node.value {
        Value::Table(entries) => {
            for entry in entries {
                take(&mut entry.node, &below(&entry.key), problems, found);
            }
        }
        Value::List(items) => {
            for (index, item) in items.iter_mut().enumerate() {
                let name = item.name().map(str::to_owned);
                let key = name.unwrap_or_else(|| index.to_string());
                take(item, &below(&key), problems, found);
            }
        }
        _ => {}
    }
}

/// Returns the value of a table that stands in place of one. A leg may have the name `value`.
fn assumed(node: &Node) -> Option<&Node> {
    let Value::Table(entries) = &node.value else {
        return None;
    };
    let value = &entries.iter().find(|entry| entry.key == VALUE)?.node;
    (!matches!(value.value, Value::Table(_))).then_some(value)
}

fn read(item: &Item<'_>) -> Result<AssumedValue, Reported> {
    let table = item.table()?;
    let value = table.required(VALUE, |item| {
        let unit = item.any_unit()?;
        Ok((item.quantity(unit, &Range::ANY)?, unit, item.place()))
    });
    if value.is_err() {
        table.give_up();
    }
    let (value, unit, place) = value?;
    let end = |key| table.required(key, |item| item.quantity(unit, &Range::ANY));
    let (from, to) = (end("from"), end("to"));
    let (from, to) = (from?, to?);
    if from >= to {
        return Err(table.report("from", "`from` is not below `to`", "exchange them"));
    }
    let interval = Range::between(from, to);
    if !interval.contains(value) {
        let message = format!("`{}` is outside of its interval", item.key());
        let help = format!(
            "it must be {}; or move `from` or `to`",
            interval.words(unit.symbol())
        );
        return Err(table.report_at(&place, message, help));
    }
    Ok(AssumedValue {
        key: item.path().to_owned(),
        value,
        from,
        to,
        unit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(text: &str) -> Result<(Document, Vec<AssumedValue>), String> {
        let mut document =
            Document::parse("robot.toml", text).map_err(|error| error.to_string())?;
        let found = document.take_assumed().map_err(|error| error.to_string())?;
        Ok((document, found))
    }

    /// What is read afterwards is the document with plain values.
    #[test]
    fn values_stay_and_intervals_have_their_keys() {
        let text = "[leg.value]\nl1 = { value = '44.2 mm', from = '4 cm', to = '0.05 m' }\n\
                    [[mount]]\nname = 'LF'\n\
                    hip = ['1 m', { value = '0 m', from = '-1 m', to = '1 m' }]\n\
                    [ground]\nfriction = { value = 0.6, from = 0.6, to = 0.9 }";
        let (document, found) = taken(text).unwrap();
        let keys: Vec<_> = found.iter().map(|one| one.key.as_str()).collect();
        assert_eq!(keys, ["leg.value.l1", "mount.LF.hip.1", "ground.friction"]);
        assert_eq!(
            (found[0].value, found[0].from, found[0].to),
            (0.0442, 0.04, 0.05)
        );
        let units: Vec<_> = found.iter().map(|one| one.unit).collect();
        assert_eq!(units, [Unit::Meter, Unit::Meter, Unit::One]);
        for (key, plain) in keys.iter().zip(["'44.2 mm'", "'0 m'", "0.6"]) {
            assert_eq!(document.place(key).unwrap().text(), plain);
        }
    }

    #[test]
    fn mistakes_have_a_place_and_a_remedy() {
        for (entry, message, help) in [
            (
                "value = 3, from = 1, to = 2",
                "`a` is outside of its interval",
                "it must be",
            ),
            (
                "value = 1, from = 2, to = 0",
                "`from` is not below `to`",
                "exchange them",
            ),
            (
                "value = 1, from = 1, to = 1",
                "`from` is not below `to`",
                "exchange them",
            ),
            (
                "value = '1 m', from = '1 s', to = '2 m'",
                "`1 s` is a duration",
                "units that fit",
            ),
            (
                "value = '1 m', from = '0 m', to = 2",
                "expected a length",
                "m",
            ),
            ("value = 1, from = 0", "`to` is missing in `a`", "add `to"),
            (
                "value = 1, from = 0, to = 2, by = 3",
                "unknown key `by` in `a`",
                "from",
            ),
            ("value = [1], from = 0, to = 2", "expected", ""),
        ] {
            let error = taken(&format!("\na = {{ {entry} }}")).unwrap_err();
            assert!(error.contains(message), "{entry}: {error}");
            assert!(error.contains(help), "{entry}: {error}");
            assert!(error.contains("robot.toml:2"), "{entry}: {error}");
        }
    }
}
