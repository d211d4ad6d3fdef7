//! Reading of dimensions and of settings, for sweeps and for searches.

use twinrig_document::{Document, DocumentError, Item, Placed, Problem, Reported, Table};
use twinrig_kernel::Unit;

use super::dimension::{DimensionValues, SweepDimension, ValueInterval};
use super::keys::{ALSO, COUNT, DIMENSION, FROM, KEY, SCALE, TO, VALUES, WHOLE};
use super::value::{SweepValue, toml};

/// Greatest number of points of a sweep, and of a generation of a search.
pub const POINTS_MOST: usize = 1_000_000;
/// Greatest number of dimensions.
pub(crate) const DIMENSIONS_MOST: usize = 100;
/// Key of a scenario whose values are whole numbers.
const SCENARIO_SEED: &str = "seed";

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

/// Reads a whole number from `least` to the greatest number of points.
pub(crate) fn natural(item: &Item<'_>, least: usize) -> Result<usize, Reported> {
    let number = usize::try_from(item.natural()?).unwrap_or(usize::MAX);
    if (least..=POINTS_MOST).contains(&number) {
        return Ok(number);
    }
    let message = format!("`{}` is {number}", item.key());
    Err(item.report(message, format!("expected {least} to {POINTS_MOST}")))
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

/// Reads whether ratios count instead of differences.
pub(crate) fn scale(item: &Item<'_>) -> Result<bool, Reported> {
    item.choice(&[("linear", false), ("logarithmic", true)])
}

pub(super) fn dimension(item: &Item<'_>, is_grid: bool) -> Result<SweepDimension, Reported> {
    let table = &item.table()?;
    // All keys are read before the first return: a dimension shows all its problems.
    let key = table.required(KEY, Item::placed_text);
    let also = table.optional(ALSO, |item| item.each(Item::placed_text));
    let is_listed = table.keys().any(|known| known == VALUES);
    let listed = table.optional(VALUES, listed);
    let is_seed = key.as_ref().is_ok_and(|key| key.value == SCENARIO_SEED);
    let whole = table.optional(WHOLE, Item::boolean);
    let logarithmic = table.optional(SCALE, scale);
    let count = table.optional(COUNT, |item| natural(item, 2));
    table.expect([FROM, TO]);
    let values = match whole {
        _ if is_listed => beside_values(table)
            .and(listed)
            .map(|values| DimensionValues::Listed(values.unwrap_or_default())),
        Err(reported) => Err(reported),
        Ok(_) if !table.keys().any(|known| [FROM, TO].contains(&known)) => {
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
    refuse(table, &[FROM, TO, COUNT, SCALE, WHOLE], |key| {
        let message = format!("`{key}` has no meaning beside `{VALUES}`");
        (message, "leave one of them out".to_owned())
    })
}

/// Reads an interval of quantities, which has a number of values in a grid only.
fn quantities(
    table: &Table<'_>,
    count: Result<Option<usize>, Reported>,
    logarithmic: Result<Option<bool>, Reported>,
    is_grid: bool,
) -> Result<DimensionValues, Reported> {
    let is_logarithmic = logarithmic.is_ok_and(Option::unwrap_or_default);
    let interval = interval(table, count.unwrap_or(None), is_logarithmic);
    match count? {
        None if is_grid => return Err(table.missing(COUNT)),
        Some(_) if !is_grid => {
            let message = format!("`{COUNT}` has no meaning where values are drawn");
            let help = "leave it out; `points` counts the draws";
            return Err(table.report(COUNT, message, help));
        }
        _ => {}
    }
    logarithmic.and(interval.map(DimensionValues::Interval))
}

fn listed(item: &Item<'_>) -> Result<Vec<SweepValue>, Reported> {
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
    let from = table.required(FROM, Item::natural);
    let to = table.required(TO, Item::natural);
    let refused = refuse(table, &[COUNT, SCALE], |key| {
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
    table.report(TO, message, "exchange them")
}

/// Reads the ends of an interval.
pub(crate) fn interval(
    table: &Table<'_>,
    count: Option<usize>,
    logarithmic: bool,
) -> Result<ValueInterval, Reported> {
    let from = table.required(FROM, |item| {
        let unit = item.any_unit()?;
        Ok((item.quantity(unit, &SweepValue::RANGE)?, unit))
    });
    let unit = from.as_ref().map_or(Unit::One, |(_, unit)| *unit);
    let to = table.required(TO, |item| item.quantity(unit, &SweepValue::RANGE));
    let ((from, unit), to) = (from?, to?);
    if from >= to {
        return Err(not_ascending(table));
    }
    if logarithmic && from <= 0.0 {
        let message = format!("`{FROM}` is {from}; a logarithmic scale has positive values only");
        return Err(table.report(FROM, message, "take a linear scale"));
    }
    Ok(ValueInterval {
        from,
        to,
        unit,
        count,
        logarithmic,
    })
}
