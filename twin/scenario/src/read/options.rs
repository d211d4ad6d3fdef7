//! Reading the options that a kind of part declares.

use std::ops::RangeInclusive;

use twinrig_document::{Item, Placed, Range, Reported, Table};

use super::time::time_model;
use crate::options::{Accepts, OptionSpec, OptionValue, Options};

/// Reads the options that `specs` declare from `table`.
pub(super) fn options(table: &Table<'_>, specs: &[OptionSpec]) -> Result<Options, Reported> {
    let values: Vec<_> = specs
        .iter()
        .map(|spec| {
            let set = table.optional(&spec.name, |item| value(item, &spec.accepts))?;
            let value = set.or_else(|| spec.default.clone());
            Ok(value.map(|value| (spec.name.clone(), value)))
        })
        .collect();
    let values: Result<Vec<_>, Reported> = values.into_iter().collect();
    Ok(Options::from_pairs(values?.into_iter().flatten().collect()))
}

fn value(item: &Item<'_>, accepts: &Accepts) -> Result<OptionValue, Reported> {
    Ok(match accepts {
        Accepts::Quantity { unit, range } => OptionValue::Number(item.quantity(*unit, range)?),
        Accepts::Duration => OptionValue::Duration(item.duration()?),
        Accepts::PositiveDuration => OptionValue::Duration(item.positive_duration()?),
        Accepts::Natural(range) => OptionValue::Natural(natural(item, range)?),
        Accepts::Boolean => OptionValue::Boolean(item.boolean()?),
        Accepts::Scalar => scalar(item)?,
        Accepts::Text => OptionValue::Text(item.text()?.to_owned()),
        Accepts::Name => OptionValue::Name(item.placed_text()?),
        Accepts::Names => OptionValue::Names(names(item)?),
        Accepts::Choice(names) => {
            let choices: Vec<_> = names.iter().map(|name| (name.as_str(), name)).collect();
            OptionValue::Text(item.choice(&choices)?.clone())
        }
        Accepts::Time => OptionValue::Time(time_model(item)?),
        Accepts::Group(specs) => OptionValue::Group(options(&item.table()?, specs)?),
        Accepts::Table(accepts) => OptionValue::Named(item.by_name(|item| value(item, accepts))?),
        Accepts::Each(accepts) if item.is_table() => {
            OptionValue::Named(item.by_name(|item| value(item, accepts))?)
        }
        Accepts::Each(accepts) => OptionValue::All(Box::new(value(item, accepts)?)),
    })
}

fn scalar(item: &Item<'_>) -> Result<OptionValue, Reported> {
    Ok(if item.is_boolean() {
        OptionValue::Boolean(item.boolean()?)
    } else if item.is_text() {
        OptionValue::Text(item.text()?.to_owned())
    } else {
        OptionValue::Number(item.number(&Range::ANY)?)
    })
}

fn names(item: &Item<'_>) -> Result<Vec<Placed<String>>, Reported> {
    let names = item.each(Item::placed_text)?;
    if names.is_empty() {
        return Err(item.report("the list is empty", "leave it out, or name an element"));
    }
    Ok(names)
}

pub(super) fn natural(item: &Item<'_>, range: &RangeInclusive<u64>) -> Result<u64, Reported> {
    let value = item.natural()?;
    if range.contains(&value) {
        return Ok(value);
    }
    let message = format!("`{}` is {value}, which is out of range", item.key());
    let (start, end) = (range.start(), range.end());
    Err(item.report(
        message,
        format!("it must be at least {start}, at most {end}"),
    ))
}
