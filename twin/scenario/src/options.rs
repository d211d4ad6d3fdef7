//! Values of the keys that a kind of part declares.

use std::ops::RangeInclusive;

use twinrig_document::{Item, Reported, Table};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

use crate::catalogue::{Accepts, OptionSpec};
use crate::expect::placed_text;
use crate::read::time_model;
use crate::scenario::Placed;

/// The value of an option.
#[derive(Clone, Debug, PartialEq)]
pub enum OptionValue {
    /// A quantity, in the unit that the option declares.
    Number(f64),
    /// A duration.
    Duration(SimDuration),
    /// A whole number.
    Natural(u64),
    /// True or false.
    Boolean(bool),
    /// A text, or one of several choices.
    Text(String),
    /// A name and its position.
    Name(Placed<String>),
    /// A time model.
    Time(Timing),
    /// Options of a table.
    Group(Options),
    /// One value for all members of a set.
    All(Box<OptionValue>),
    /// Values of the named members of a set.
    Named(Vec<(Placed<String>, OptionValue)>),
}

/// Options of one part, in the order of declaration: the values of the scenario, and the defaults
/// of the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options(Vec<(String, OptionValue)>);

impl Options {
    /// Returns the value of `name`; none if the scenario does not set it and it has no default.
    pub fn get(&self, name: &str) -> Option<&OptionValue> {
        let (_, value) = self.0.iter().find(|(known, _)| known == name)?;
        Some(value)
    }

    /// Returns the quantity `name`; none if it is absent or not a quantity.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.get(name)? {
            OptionValue::Number(value) => Some(*value),
            _ => None,
        }
    }

    /// Returns the duration `name`; none if it is absent or not a duration.
    pub fn duration(&self, name: &str) -> Option<SimDuration> {
        match self.get(name)? {
            OptionValue::Duration(value) => Some(*value),
            _ => None,
        }
    }

    /// Returns the whole number `name`; none if it is absent or not a whole number.
    pub fn natural(&self, name: &str) -> Option<u64> {
        match self.get(name)? {
            OptionValue::Natural(value) => Some(*value),
            _ => None,
        }
    }

    /// Returns the boolean `name`; none if it is absent or not a boolean.
    pub fn boolean(&self, name: &str) -> Option<bool> {
        match self.get(name)? {
            OptionValue::Boolean(value) => Some(*value),
            _ => None,
        }
    }

    /// Returns the text or choice `name`; none if it is absent or not a text.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.get(name)? {
            OptionValue::Text(value) => Some(value),
            _ => None,
        }
    }

    /// Returns the name `name` and its position; none if it is absent or not a name.
    pub fn name(&self, name: &str) -> Option<&Placed<String>> {
        match self.get(name)? {
            OptionValue::Name(value) => Some(value),
            _ => None,
        }
    }

    /// Returns the members of the set `name` that the scenario names, and their values, in the
    /// order of the file.
    pub fn named(&self, name: &str) -> &[(Placed<String>, OptionValue)] {
        match self.get(name) {
            Some(OptionValue::Named(values)) => values,
            _ => &[],
        }
    }

    /// Returns the time model `name`; none if it is absent or not a time model.
    pub fn time(&self, name: &str) -> Option<&Timing> {
        match self.get(name)? {
            OptionValue::Time(value) => Some(value),
            _ => None,
        }
    }

    /// Returns the options of the table `name`; none if it is absent or not a table.
    pub fn group(&self, name: &str) -> Option<&Options> {
        match self.get(name)? {
            OptionValue::Group(options) => Some(options),
            _ => None,
        }
    }

    /// Returns the value of `name` for `member` of a set: that of the member, or that of all
    /// members; none if there is neither.
    pub fn of_member(&self, name: &str, member: &str) -> Option<&OptionValue> {
        match self.get(name)? {
            OptionValue::All(value) => Some(value),
            OptionValue::Named(values) => {
                let (_, value) = values.iter().find(|(known, _)| known.value == member)?;
                Some(value)
            }
            _ => None,
        }
    }

    /// Returns the members that options of a set name, in the order of the file.
    pub fn members(&self) -> impl Iterator<Item = &Placed<String>> {
        let named = self.0.iter().filter_map(|(_, value)| match value {
            OptionValue::Named(values) => Some(values.iter().map(|(name, _)| name)),
            _ => None,
        });
        named.flatten()
    }

    /// Returns names and values, in the order of declaration.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &OptionValue)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// Returns the options with `value` for `name`, replacing any other value of it.
    #[must_use]
    pub fn with(mut self, name: &str, value: OptionValue) -> Self {
        self = self.without(name);
        self.0.push((name.to_owned(), value));
        self
    }

    /// Returns the options without `name`.
    #[must_use]
    pub fn without(mut self, name: &str) -> Self {
        self.0.retain(|(known, _)| known != name);
        self
    }

    /// Returns the defaults of `specs`.
    pub fn defaults(specs: &[OptionSpec]) -> Self {
        let default = |spec: &OptionSpec| Some((spec.name.clone(), spec.default.clone()?));
        Options(specs.iter().filter_map(default).collect())
    }

    /// Reads the options that `specs` declare from `table`.
    pub(crate) fn read(table: &Table<'_>, specs: &[OptionSpec]) -> Result<Self, Reported> {
        let values: Vec<_> = specs
            .iter()
            .map(|spec| {
                let set = table.optional(&spec.name, |item| value(item, &spec.accepts))?;
                let value = set.or_else(|| spec.default.clone());
                Ok(value.map(|value| (spec.name.clone(), value)))
            })
            .collect();
        let values: Result<Vec<_>, Reported> = values.into_iter().collect();
        Ok(Options(values?.into_iter().flatten().collect()))
    }
}

fn value(item: &Item<'_>, accepts: &Accepts) -> Result<OptionValue, Reported> {
    Ok(match accepts {
        Accepts::Quantity { unit, range } => OptionValue::Number(item.quantity(*unit, range)?),
        Accepts::Duration => OptionValue::Duration(item.duration()?),
        Accepts::Natural(range) => OptionValue::Natural(natural(item, range)?),
        Accepts::Boolean => OptionValue::Boolean(item.boolean()?),
        Accepts::Text => OptionValue::Text(item.text()?.to_owned()),
        Accepts::Name => OptionValue::Name(placed_text(item)?),
        Accepts::Choice(names) => {
            let choices: Vec<_> = names.iter().map(|name| (name.as_str(), name)).collect();
            OptionValue::Text(item.choice(&choices)?.clone())
        }
        Accepts::Time => OptionValue::Time(time_model(item)?),
        Accepts::Group(specs) => OptionValue::Group(Options::read(&item.table()?, specs)?),
        Accepts::Table(accepts) => OptionValue::Named(named(item, accepts)?),
        Accepts::Each(accepts) if item.is_table() => OptionValue::Named(named(item, accepts)?),
        Accepts::Each(accepts) => OptionValue::All(Box::new(value(item, accepts)?)),
    })
}

fn named(
    item: &Item<'_>,
    accepts: &Accepts,
) -> Result<Vec<(Placed<String>, OptionValue)>, Reported> {
    let table = item.table()?;
    let named: Vec<_> = table
        .keys()
        .map(|name| {
            let place = table.key_place(name);
            let value = table.required(name, |item| value(item, accepts))?;
            let name = Placed {
                value: name.to_owned(),
                place,
            };
            Ok((name, value))
        })
        .collect();
    named.into_iter().collect()
}

fn natural(item: &Item<'_>, range: &RangeInclusive<u64>) -> Result<u64, Reported> {
    let value = item.natural()?;
    if range.contains(&value) {
        return Ok(value);
    }
    let message = format!("`{}` is {value}, which is out of range", item.key());
    let help = format!(
        "it must be at least {}, at most {}",
        range.start(),
        range.end()
    );
    Err(item.report(message, help))
}
