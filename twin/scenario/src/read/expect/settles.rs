//! Reading the settling to a final value.

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::{SimTime, Unit};

use crate::language::{Accepts, Key, Shape, TableSpec, contextual, table};

table! {
    /// Keys of `settles`.
    pub(super) settles_table = TableSpec::new("settles", "settling to the final value");
    WITHIN: () = "within", contextual(Shape::Measured(Range::NOT_NEGATIVE)),
        "greatest distance from the final value", r#"within = "2 mm""#, required();
    BY: () = "by", contextual(Shape::One(Accepts::Duration)), "time from which on it holds",
        r#"by = "4 s""#, required();
}

/// Reads `settles = { … }`, with the distance in `unit`.
pub(super) fn settles(item: &Item<'_>, unit: Unit) -> Result<(f64, SimTime), Reported> {
    use settles_table::{BY, WITHIN};
    let table = &item.table()?;
    let table = settles_table::TABLE.of(table);
    let within = table.read_with(&WITHIN, |item| item.quantity(unit, &Range::NOT_NEGATIVE));
    let by = table.read_with(&BY, Item::duration);
    Ok((within?, SimTime::ZERO + by?))
}
