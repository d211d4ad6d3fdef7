//! The one key of a table of which it has exactly one.

use twinrig_document::{Item, Reported};

use crate::language::{Declared, Presence};

/// Returns the name of the one key present of those of which the table has exactly one. The
/// table is the value `item`; `missing` is the error if there is none.
pub(super) fn one_of(
    table: Declared<'_, '_>,
    item: &Item<'_>,
    missing: &str,
) -> Result<&'static str, Reported> {
    let keys = table.spec().all_keys().into_iter();
    let keys = keys.filter(|key| key.presence == Presence::OneOf);
    let keys: Vec<&'static str> = keys.map(|key| key.name).collect();
    (*table).expect(keys.iter().copied());
    let is_present = |key: &&&'static str| table.keys().any(|known| known == **key);
    let present: Vec<_> = keys.iter().filter(is_present).collect();
    match present[..] {
        [key] => {
            check_needs(table, key, &keys)?;
            Ok(key)
        }
        [] => {
            table.give_up();
            Err(item.report(missing, format!("give one of {}", keys.join(", "))))
        }
        [first, second, ..] => {
            table.give_up();
            let message = format!("`{first}` and `{second}` are two expectations");
            Err((*table).report(second, message, "write a second [[expect]]"))
        }
    }
}

/// Reports a present key that belongs to another than `key` of those that exclude each other.
fn check_needs(table: Declared<'_, '_>, key: &str, exclusive: &[&str]) -> Result<(), Reported> {
    for other in table.spec().all_keys() {
        let Some(needs) = other.needs.filter(|needs| exclusive.contains(needs)) else {
            continue;
        };
        let is_present = table.keys().any(|known| known == other.name);
        if is_present && needs != key {
            table.give_up();
            let message = format!("`{}` has no meaning with `{key}`", other.name);
            let help = format!("`{}` requires `{needs}`", other.name);
            return Err((*table).report(other.name, message, help));
        }
    }
    Ok(())
}
