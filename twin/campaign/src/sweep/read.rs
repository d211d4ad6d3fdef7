//! Reading of dimensions and of settings, for sweeps and for searches.

use twinrig_document::declaration::{Accepts, Key, Shape, TableSpec, Type, contextual, table};
use twinrig_document::{Document, DocumentError, Item, Placed, Problem, Range, Reported, Table};
use twinrig_kernel::Unit;

use super::dimension::{DimensionValues, SweepDimension, ValueInterval};
use super::value::{SweepValue, toml};
use dimension_table::{ALSO, COUNT, FROM, KEY, SCALE, TABLE, TO, VALUES, WHOLE};

/// Greatest number of points of a sweep, and of a generation of a search.
pub const POINTS_MOST: usize = 1_000_000;
/// Greatest number of dimensions.
pub(crate) const DIMENSIONS_MOST: usize = 100;
/// Key of a scenario whose values are whole numbers.
const SCENARIO_SEED: &str = "seed";

/// Key of the dimensions.
pub(crate) const DIMENSION: &str = "dimension";
/// End of an interval.
pub(crate) const END: Shape = Shape::Measured(Range::ANY);
/// Settings: keys and values in TOML.
pub(crate) const SETTINGS: Type<Vec<(String, String)>> =
    Type::new(Shape::Settings, |item, _| settings(item));
/// Whether ratios count instead of differences.
pub(crate) const LOGARITHMIC: Type<bool> = Type::new(
    Shape::Choice(|| vec!["linear", "logarithmic"]),
    |item, _| item.choice(&[("linear", false), ("logarithmic", true)]),
);

table! {
    /// Keys of `[[dimension]]`.
    pub(crate) dimension_table = TableSpec::new("[[dimension]]", "setting that is varied");
    KEY: Placed<String> = "key", Type::PLACED,
        "dotted key of the scenario, or name of a process variable", r#"key = "plant.ground.at""#,
        required();
    ALSO: Vec<Placed<String>> = "also", Type::NAMES,
        "further keys, which have the same value as the key in every run",
        r#"also = ["obstacle_distance"]"#, otherwise("none");
    VALUES: Vec<SweepValue> = "values",
        Type::new(Shape::set(&Shape::Any, 1), |item, _| listed(item)),
        "the values, in place of `from` and `to`",
        r#"values = ["trot", "walk"]"#;
    FROM: () = "from", contextual(END), "lower end", r#"from = "2.5 m""#;
    TO: () = "to", contextual(END), "upper end, above `from`", r#"to = "2.76 m""#;
    COUNT: usize = "count", count(2),
        "number of values in a grid, at equal distances with both ends", "count = 10";
    SCALE: bool = "scale", LOGARITHMIC, "whether differences or ratios count",
        r#"scale = "logarithmic""#, default("'linear'");
    WHOLE: bool = "whole", Type::BOOLEAN, "only whole numbers, in a grid all of them",
        "whole = true", otherwise("true for `seed`, otherwise false");
}

/// Returns a whole number from `least` to the greatest number of points.
pub(crate) const fn count(least: u64) -> Type<usize> {
    Type::new(
        Shape::One(Accepts::Natural(least..=POINTS_MOST as u64)),
        natural,
    )
}

/// Refuses a scenario in place of `expected`: the two files of a command were exchanged.
pub(crate) fn refuse_scenario(document: &Document, expected: &str) -> Result<(), DocumentError> {
    let has = |key: &str| document.keys().any(|known| known == key);
    if has(DIMENSION) || !has("plant") {
        return Ok(());
    }
    let message = format!("this is a scenario, not {expected}");
    let help =
        "`twin sweep SCENARIO SPEC` and `twin optimize SCENARIO --space FILE` take two files";
    Err(Problem::of_file(document.file(), message, help).into())
}

/// Checks the keys of the dimensions: there are some, not too many, and none sets the same as
/// another or a part of it.
pub(crate) fn check_dimensions<'k>(
    table: &Table<'_>,
    keys: impl IntoIterator<Item = &'k Placed<String>>,
) -> Result<(), Reported> {
    let keys: Vec<&Placed<String>> = keys.into_iter().collect();
    if keys.is_empty() {
        return Err(table.report(DIMENSION, "there is no dimension", "add a [[dimension]]"));
    }
    if keys.len() > DIMENSIONS_MOST {
        let message = format!("there are more than {DIMENSIONS_MOST} dimensions");
        return Err(table.report(DIMENSION, message, "leave some of them out"));
    }
    let mut checked = Ok(());
    for (index, later) in keys.iter().enumerate() {
        let (key, mut earlier) = (&later.value, keys[..index].iter());
        if let Some(other) = earlier.find(|other| overlap(key, &other.value)) {
            let message = format!("`{key}` is set by the dimension `{}` already", other.value);
            let help = "one dimension for each key";
            checked = Err(table.report_at(&later.place, message, help));
        }
    }
    checked
}

/// Returns whether one of two dotted keys is the other, or a table that contains it.
pub fn overlap(one: &str, other: &str) -> bool {
    let contains = |table: &str, key: &str| {
        let rest = key.strip_prefix(table);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    contains(one, other) || contains(other, one)
}

/// Reads a whole number of the shape `Accepts::Natural`.
pub(super) fn natural(item: &Item<'_>, shape: &Shape) -> Result<usize, Reported> {
    let Shape::One(Accepts::Natural(range)) = shape else {
        unreachable!("a whole number");
    };
    let number = item.natural()?;
    if range.contains(&number) {
        return Ok(usize::try_from(number).unwrap_or(usize::MAX));
    }
    let message = format!("`{}` is {number}", item.key());
    let (least, most) = (range.start(), range.end());
    Err(item.report(message, format!("expected {least} to {most}")))
}

/// Reads a number of levels.
pub(super) fn levels(item: &Item<'_>, shape: &Shape) -> Result<usize, Reported> {
    let levels = natural(item, shape)?;
    if levels % 2 == 1 {
        let message = format!("`{}` is {levels}, which is odd", item.key());
        return Err(item.report(message, "take an even number: a change is of half of them"));
    }
    Ok(levels)
}

/// Reads a table of settings: keys and values in TOML.
pub(crate) fn settings(item: &Item<'_>) -> Result<Vec<(String, String)>, Reported> {
    let settings = placed_settings(item)?.into_iter();
    Ok(settings.map(|(key, value)| (key.value, value)).collect())
}

/// Reads a table of settings: keys with the places of their values, and values in TOML.
pub(crate) fn placed_settings(item: &Item<'_>) -> Result<Vec<(Placed<String>, String)>, Reported> {
    let mut settings = Vec::new();
    leaves(item, &mut Vec::new(), &mut settings)?;
    Ok(settings)
}

/// Collects the values below a table with their dotted keys.
fn leaves(
    item: &Item<'_>,
    path: &mut Vec<String>,
    settings: &mut Vec<(Placed<String>, String)>,
) -> Result<(), Reported> {
    let Some(keys) = item.keys() else {
        if path.is_empty() {
            return item.table().map(drop);
        }
        check_line(item)?;
        let key = Placed {
            value: path.join("."),
            place: item.place(),
        };
        settings.push((key, toml(item)));
        return Ok(());
    };
    let mut read = Ok(());
    for key in keys {
        if let Some(value) = item.peek(key) {
            path.push(key.to_owned());
            read = leaves(&value, path, settings).and(read);
            path.pop();
        }
    }
    read
}

/// Checks that a value is written in one line, which a setting requires.
fn check_line(item: &Item<'_>) -> Result<(), Reported> {
    if !item.is_text() && item.toml().contains('\n') {
        return Err(item.report("a value of a setting is one line", "write it in one line"));
    }
    Ok(())
}

pub(super) fn dimension(item: &Item<'_>, is_grid: bool) -> Result<SweepDimension, Reported> {
    let table = &item.table()?;
    let keys = TABLE.of(table);
    // All keys are read before the first return: a dimension shows all its problems.
    let (key, also) = (keys.read(&KEY), keys.get(&ALSO));
    let listed = keys.get(&VALUES);
    let is_seed = key.as_ref().is_ok_and(|key| key.value == SCENARIO_SEED);
    let whole = keys.get(&WHOLE);
    let logarithmic = keys.read(&SCALE);
    let count = keys.get(&COUNT);
    keys.expect(&FROM);
    keys.expect(&TO);
    let values = match whole {
        _ if keys.has(&VALUES) => beside_values(table)
            .and(listed)
            .map(|values| DimensionValues::Listed(values.unwrap_or_default())),
        Err(reported) => Err(reported),
        Ok(_) if !keys.has(&FROM) && !keys.has(&TO) => {
            let help = "add `values = [ … ]`, or `from` and `to`";
            Err(item.report("the dimension has no values", help))
        }
        Ok(whole) if whole.unwrap_or(is_seed) => whole_numbers(table),
        Ok(_) => quantities(table, count, logarithmic, is_grid),
    };
    Ok(SweepDimension {
        key: key?,
        also: also?.unwrap_or_default(),
        values: values?,
    })
}

/// Reports each of `keys` that is present, as it has no meaning here.
pub(crate) fn refuse(
    table: &Table<'_>,
    keys: &[&str],
    message: impl Fn(&str) -> (String, String),
) -> Result<(), Reported> {
    let mut refused = Ok(());
    for key in keys {
        if table.keys().any(|known| known == *key) {
            let (message, help) = message(key);
            refused = Err(table.report(key, message, help));
        }
    }
    refused
}

/// Refuses the keys of intervals beside a list of values.
fn beside_values(table: &Table<'_>) -> Result<(), Reported> {
    let keys = [FROM.name, TO.name, COUNT.name, SCALE.name, WHOLE.name];
    refuse(table, &keys, |key| {
        let message = format!("`{key}` has no meaning beside `{VALUES}`");
        (message, "leave one of them out".to_owned())
    })
}

/// Reads an interval of quantities, which has a number of values in a grid only.
fn quantities(
    table: &Table<'_>,
    count: Result<Option<usize>, Reported>,
    logarithmic: Result<bool, Reported>,
    is_grid: bool,
) -> Result<DimensionValues, Reported> {
    let is_logarithmic = logarithmic.unwrap_or_default();
    let interval = interval(table, count.unwrap_or(None), is_logarithmic);
    match count? {
        None if is_grid => return Err(table.missing(COUNT.name)),
        Some(_) if !is_grid => {
            let message = format!("`{COUNT}` has no meaning where values are drawn");
            let help = "leave it out; `points` counts the draws";
            return Err(table.report(COUNT.name, message, help));
        }
        _ => {}
    }
    logarithmic.and(interval.map(DimensionValues::Interval))
}

pub(super) fn listed(item: &Item<'_>) -> Result<Vec<SweepValue>, Reported> {
    let values = item.each(|item| {
        check_line(item)?;
        Ok((SweepValue::of(item), item.place()))
    })?;
    if values.is_empty() {
        return Err(item.report("the list has no values", "add one"));
    }
    let mut distinct = Ok(());
    for (index, (value, place)) in values.iter().enumerate() {
        if values[..index].iter().any(|(other, _)| other == value) {
            let message = format!("{} is listed twice", value.toml);
            distinct = Err(item.report_at(place, message, "leave one of them out"));
        }
    }
    distinct?;
    Ok(values.into_iter().map(|(value, _)| value).collect())
}

fn whole_numbers(table: &Table<'_>) -> Result<DimensionValues, Reported> {
    let from = table.required(FROM.name, Item::natural);
    let to = table.required(TO.name, Item::natural);
    let refused = refuse(table, &[COUNT.name, SCALE.name], |key| {
        let message = format!("`{key}` has no meaning for whole numbers, all of which count");
        let help = format!("leave it out, or list the numbers in `{VALUES}`");
        (message, help)
    });
    let (from, to, ()) = (from?, to?, refused?);
    if from > to {
        return Err(not_ascending(table));
    }
    Ok(DimensionValues::Whole { from, to })
}

fn not_ascending(table: &Table<'_>) -> Reported {
    let message = format!("`{TO}` has to be above `{FROM}`");
    table.report(TO.name, message, "exchange them")
}

/// Reads the ends of an interval.
pub(crate) fn interval(
    table: &Table<'_>,
    count: Option<usize>,
    logarithmic: bool,
) -> Result<ValueInterval, Reported> {
    let from = table.required(FROM.name, |item| {
        let unit = item.any_unit()?;
        Ok((item.quantity(unit, &SweepValue::RANGE)?, unit))
    });
    let unit = from.as_ref().map_or(Unit::One, |(_, unit)| *unit);
    let to = table.required(TO.name, |item| item.quantity(unit, &SweepValue::RANGE));
    let ((from, unit), to) = (from?, to?);
    if from >= to {
        return Err(not_ascending(table));
    }
    if logarithmic && from <= 0.0 {
        let message = format!("`{FROM}` is {from}; a logarithmic scale has positive values only");
        return Err(table.report(FROM.name, message, "take a linear scale"));
    }
    Ok(ValueInterval {
        from,
        to,
        unit,
        count,
        logarithmic,
    })
}
