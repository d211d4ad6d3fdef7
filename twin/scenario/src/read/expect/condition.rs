//! Reading conditions on elements of signals.

use twinrig_document::{Item, Placed, Reported};

use crate::language::{Key, Shape, TableSpec, Type, table};
use crate::read::limits::{either_centre_or_ends, limits_table, read_keys, unit_of};
use crate::sequence::Condition;

table! {
    /// Keys of a condition, besides limits.
    pub(super) condition_table = TableSpec::new("condition", "limits of an element of a signal")
        .with(limits_table::TABLE.keys)
        .refined(either_centre_or_ends);
    NAME: Placed<String> = "name", Type::PLACED, "name", r#"name = "energy/kinetic", max = "1 mJ""#,
        required();
    COMPONENT: usize = "component", Type::ELEMENT, "element of the signal, counted from 0",
        r#"name = "body/rpy", component = 2, max = "3 deg""#, default("0");
    ABSOLUTE: bool = "absolute", Type::BOOLEAN, "whether the magnitude is compared",
        r#"name = "body/rpy", absolute = true, max = "3 deg""#, default("false");
}

/// A condition as the value of a key.
pub(super) const CONDITION: Type<Condition> =
    Type::new(Shape::TableIn(None, condition_table::TABLE), |item, _| {
        condition(item)
    });

fn condition(item: &Item<'_>) -> Result<Condition, Reported> {
    use condition_table::{ABSOLUTE, COMPONENT, NAME};
    let table = &item.table()?;
    let table = condition_table::TABLE.of(table);
    let (name, component) = (table.read(&NAME), table.read(&COMPONENT));
    let absolute = table.read(&ABSOLUTE);
    let unit = unit_of(item)?;
    let limits = read_keys(table, item, unit);
    Ok(Condition {
        name: name?,
        component: component?,
        absolute: absolute?,
        unit,
        limits: limits?,
    })
}
