//! Reading limits.

use serde_json::json;
use twinrig_document::{Item, Range, Reported, print_quantity};
use twinrig_kernel::Unit;

use crate::domain::Domain;
use crate::language::{Declared, Key, KeySpec, Shape, Special, TableSpec, Type, contextual, table};
use crate::limits::Limits;

table! {
    /// Keys of limits.
    pub(crate) limits_table = TableSpec::new("limits", "limits of a measured value")
        .refined(either_centre_or_ends);
    MIN: () = "min", contextual(Shape::Measured(Range::ANY)), "least accepted value",
        "min = 1, max = 2";
    MAX: () = "max", contextual(Shape::Measured(Range::ANY)), "greatest accepted value", "max = 2";
    NEAR: () = "near", contextual(Shape::Measured(Range::ANY)), "centre of the accepted values",
        r#"near = 54.5, within = "3 %""#, needs("within");
    WITHIN: () = "within", contextual(Shape::Tolerance), "greatest distance from it",
        "near = 54.5, within = 2.5", needs("near");
}

/// Adds the condition that limits have a centre, or at least one end.
pub(super) fn either_centre_or_ends(schema: &mut serde_json::Value) {
    use limits_table::{MAX, MIN, NEAR};
    schema["oneOf"] = json!([
        { "required": [NEAR.name] },
        { "anyOf": [{ "required": [MIN.name] }, { "required": [MAX.name] }] },
    ]);
}

/// Returns limits of a measure.
pub(super) const fn limits(unit: Unit, domain: Domain) -> Type<Limits> {
    Type::new(Shape::Other(Special::Limits(unit, domain)), read_shape)
}

/// Reads limits of the shape [`Special::Limits`].
pub(super) fn read_shape(item: &Item<'_>, shape: &Shape) -> Result<Limits, Reported> {
    let Shape::Other(Special::Limits(unit, domain)) = shape else {
        unreachable!("limits");
    };
    read(item, *unit, domain)
}

/// Returns limits of a measure, of which `$make` makes the value.
macro_rules! limits_of {
    ($unit:expr, $domain:expr, $make:expr) => {
        Type::new(
            $crate::language::Shape::Other($crate::language::Special::Limits($unit, $domain)),
            |item, shape| $crate::read::limits::read_shape(item, shape).map($make),
        )
    };
}

pub(super) use limits_of;

/// Reads a table of limits, `{ min = …, max = … }` or `{ near = …, within = … }`, of a measure with
/// the values `domain`.
pub(super) fn read(item: &Item<'_>, unit: Unit, domain: &Domain) -> Result<Limits, Reported> {
    if !item.is_table() {
        let example = if unit == Unit::One {
            "0.5".to_owned()
        } else {
            format!("\"{}\"", print_quantity(0.5, unit))
        };
        let message = format!("`{}` requires limits", item.key());
        let help = format!(
            "write {{ max = {example} }}, {{ min = …, max = … }} or {{ near = …, within = … }}"
        );
        return Err(item.report(message, help));
    }
    let table = &item.table()?;
    let limits = read_keys(limits_table::TABLE.of(table), item, unit)?;
    let key = item.key();
    let message = if domain.is_within(&limits) {
        format!("no value of `{key}` violates these limits")
    } else if domain.is_outside(&limits) {
        format!("no value of `{key}` is within these limits")
    } else {
        return Ok(limits);
    };
    let help = format!("`{key}` is always {}", domain.describe(unit));
    Err(item.report(message, help))
}

/// Reads `min`, `max`, `near` and `within` from the table `item`, which may have other keys.
pub(super) fn read_keys(
    table: Declared<'_, '_>,
    item: &Item<'_>,
    unit: Unit,
) -> Result<Limits, Reported> {
    use limits_table::{MAX, MIN, NEAR, WITHIN};
    let quantity = |key: &Key<()>| table.get_with(key, |item| item.quantity(unit, &Range::ANY));
    let (min, max, near) = (quantity(&MIN), quantity(&MAX), quantity(&NEAR));
    let centre = near.as_ref().map_or(0.0, |near| near.unwrap_or(0.0));
    let within = table.get_with(&WITHIN, |item| within(item, unit, centre));
    let (min, max, near, within) = (min?, max?, near?, within?);
    match (min, max, near, within) {
        (None, None, Some(near), Some(within)) => Ok(Limits {
            min: Some(near - within),
            max: Some(near + within),
        }),
        (Some(min), Some(max), None, None) if min > max => {
            Err(item.report("`min` is greater than `max`", "no value lies between them"))
        }
        (None, None, None, None) => Err(item.report(
            "there is no limit",
            "give `min`, `max` or both, or `near` and `within`",
        )),
        (min, max, None, None) => Ok(Limits { min, max }),
        _ => {
            let help = "give `min`, `max` or both, or `near` and `within`";
            Err(item.report("these limits cannot be combined", help))
        }
    }
}

/// Returns the unit of the first limit of a table of limits.
pub(super) fn unit_of(item: &Item<'_>) -> Result<Unit, Reported> {
    let keys = (limits_table::TABLE.keys)().into_iter();
    let mut present = keys.filter_map(|key: KeySpec| item.peek(key.name));
    present
        .next()
        .map_or(Ok(Unit::One), |first| first.any_unit())
}

/// Reads a distance from `centre`: a quantity, or a percentage of `centre`.
fn within(item: &Item<'_>, unit: Unit, centre: f64) -> Result<f64, Reported> {
    if item.is_text() && item.text()?.trim_end().ends_with('%') {
        let share = item.number(&Range::NOT_NEGATIVE)?;
        return Ok(share * centre.abs());
    }
    item.quantity(unit, &Range::NOT_NEGATIVE)
}
