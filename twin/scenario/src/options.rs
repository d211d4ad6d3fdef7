//! Keys that a kind of part declares, and their values.

use twinrig_document::{Placed, declaration};
use twinrig_kernel::SimDuration;
use twinrig_runtime::Timing;

/// A key that a kind accepts.
#[derive(Clone, Debug, PartialEq)]
pub struct OptionSpec {
    /// The key.
    pub name: String,
    /// One-line description for display.
    pub about: String,
    /// Accepted values.
    pub accepts: Accepts,
    /// Default value; none if the key may be absent.
    pub default: Option<OptionValue>,
}

/// Accepted values of an option.
pub type Accepts = declaration::Accepts<OptionSpec>;

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
    /// Names and their positions.
    Names(Vec<Placed<String>>),
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

    /// Returns the names of the list `name` and their positions; none if it is absent.
    pub fn names(&self, name: &str) -> &[Placed<String>] {
        match self.get(name) {
            Some(OptionValue::Names(names)) => names,
            _ => &[],
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

    /// Returns the members of the set `name` that are tables, in the order of the file.
    pub fn tables(&self, name: &str) -> impl Iterator<Item = (&Placed<String>, &Self)> {
        let members = self.named(name).iter();
        members.filter_map(|(key, value)| match value {
            OptionValue::Group(table) => Some((key, table)),
            _ => None,
        })
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

    pub(crate) fn from_pairs(pairs: Vec<(String, OptionValue)>) -> Self {
        Options(pairs)
    }

    /// Returns the defaults of `specs`.
    pub fn defaults(specs: &[OptionSpec]) -> Self {
        let default = |spec: &OptionSpec| Some((spec.name.clone(), spec.default.clone()?));
        Options(specs.iter().filter_map(default).collect())
    }
}
