//! The values of keys that a kind of part declares.

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
    /// A text, or one of several words.
    Text(String),
    /// A name, and where it stands.
    Name(Placed<String>),
    /// How long something takes.
    Time(Timing),
    /// Options of a table.
    Group(Options),
    /// The same for all members of a set.
    All(Box<OptionValue>),
    /// Values of those members of a set that are named.
    Named(Vec<(Placed<String>, OptionValue)>),
}

/// The options of one part: those that the scenario gives, and the defaults of the others, in the order of declaration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options(Vec<(String, OptionValue)>);

impl Options {
    /// The value of `name`; none if the scenario does not give it and it has no default.
    pub fn get(&self, name: &str) -> Option<&OptionValue> {
        let (_, value) = self.0.iter().find(|(known, _)| known == name)?;
        Some(value)
    }

    /// The quantity `name`; none if it is absent or no quantity.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.get(name)? {
            OptionValue::Number(value) => Some(*value),
            _ => None,
        }
    }

    /// The duration `name`; none if it is absent or no duration.
    pub fn duration(&self, name: &str) -> Option<SimDuration> {
        match self.get(name)? {
            OptionValue::Duration(value) => Some(*value),
            _ => None,
        }
    }

    /// The whole number `name`; none if it is absent or no whole number.
    pub fn natural(&self, name: &str) -> Option<u64> {
        match self.get(name)? {
            OptionValue::Natural(value) => Some(*value),
            _ => None,
        }
    }

    /// The truth of `name`; none if it is absent or neither true nor false.
    pub fn boolean(&self, name: &str) -> Option<bool> {
        match self.get(name)? {
            OptionValue::Boolean(value) => Some(*value),
            _ => None,
        }
    }

    /// The text or word `name`; none if it is absent or no text.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.get(name)? {
            OptionValue::Text(value) => Some(value),
            _ => None,
        }
    }

    /// The name `name` and its place; none if it is absent or no name.
    pub fn name(&self, name: &str) -> Option<&Placed<String>> {
        match self.get(name)? {
            OptionValue::Name(value) => Some(value),
            _ => None,
        }
    }

    /// The members of the set `name` that the scenario names, and their values, in the order of the file.
    pub fn named(&self, name: &str) -> &[(Placed<String>, OptionValue)] {
        match self.get(name) {
            Some(OptionValue::Named(values)) => values,
            _ => &[],
        }
    }

    /// How long `name` takes; none if it is absent or no time.
    pub fn time(&self, name: &str) -> Option<&Timing> {
        match self.get(name)? {
            OptionValue::Time(value) => Some(value),
            _ => None,
        }
    }

    /// The options of the table `name`; none if it is absent or no table.
    pub fn group(&self, name: &str) -> Option<&Options> {
        match self.get(name)? {
            OptionValue::Group(options) => Some(options),
            _ => None,
        }
    }

    /// The value of `name` for `member` of a set: its own, or that of all; none if it has none.
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

    /// The members that options of a set name, in the order of the file.
    pub fn members(&self) -> impl Iterator<Item = &Placed<String>> {
        let named = self.0.iter().filter_map(|(_, value)| match value {
            OptionValue::Named(values) => Some(values.iter().map(|(name, _)| name)),
            _ => None,
        });
        named.flatten()
    }

    /// Names and values, in the order of declaration.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &OptionValue)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }

    /// The same with `value` for `name`, whatever was there.
    #[must_use]
    pub fn with(mut self, name: &str, value: OptionValue) -> Self {
        self = self.without(name);
        self.0.push((name.to_owned(), value));
        self
    }

    /// The same without any value for `name`.
    #[must_use]
    pub fn without(mut self, name: &str) -> Self {
        self.0.retain(|(known, _)| known != name);
        self
    }

    /// The defaults of `specs`, where they have one.
    pub fn defaults(specs: &[OptionSpec]) -> Self {
        let default = |spec: &OptionSpec| Some((spec.name.clone(), spec.default.clone()?));
        Options(specs.iter().filter_map(default).collect())
    }

    /// Reads the options that `specs` declare out of `table`.
    pub(crate) fn read(table: &Table<'_>, specs: &[OptionSpec]) -> Result<Self, Reported> {
        let values: Vec<_> = specs
            .iter()
            .map(|spec| {
                let given = table.optional(&spec.name, |item| value(item, &spec.accepts))?;
                let value = given.or_else(|| spec.default.clone());
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
        Accepts::Choice(words) => {
            let choices: Vec<_> = words.iter().map(|word| (word.as_str(), word)).collect();
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
