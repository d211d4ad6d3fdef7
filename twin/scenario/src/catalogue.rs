//! What a build offers: the kinds of plants, controllers and buses, and the keys that each of them accepts.

use std::ops::RangeInclusive;

use twinrig_document::Range;
use twinrig_kernel::Unit;

use crate::options::OptionValue;

/// Every kind of part that a build has. The program that knows them all fills it; this crate knows none of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Catalogue {
    /// Accepted as `[plant] model`.
    pub plants: Vec<Kind>,
    /// Accepted as `[controller] kind`.
    pub controllers: Vec<Kind>,
    /// Accepted as `[bus] kind`.
    pub buses: Vec<Kind>,
}

/// A kind of part.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// The word that a scenario uses.
    pub name: String,
    /// One line for a person.
    pub about: String,
    /// The cargo feature without which this build does not have it; none if it has it.
    pub missing_feature: Option<String>,
    /// The command without which a build with that feature fails; none if it needs none.
    pub build_needs: Option<String>,
    /// It brings a model of its own: a scenario needs no robot for it, and has no say in its base, legs, ground, start and
    /// actuators. Plants only.
    pub is_standalone: bool,
    /// Keys of its table beside those that every part of its sort has.
    pub options: Vec<OptionSpec>,
    /// Process variables, which are keys of its table too, and may be changed while it runs. Controllers only.
    pub variables: Vec<VariableSpec>,
}

impl Kind {
    /// A kind that this build has, without options or variables.
    pub fn new(name: impl Into<String>, about: impl Into<String>) -> Self {
        Kind {
            name: name.into(),
            about: about.into(),
            missing_feature: None,
            build_needs: None,
            is_standalone: false,
            options: Vec::new(),
            variables: Vec::new(),
        }
    }

    /// A variable by its full name.
    pub fn variable(&self, name: &str) -> Option<&VariableSpec> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// Adds the variables that this kind has on another robot: those that it lacks, and the ranges of the others.
    pub fn unite_variables(&mut self, others: Vec<VariableSpec>) {
        for other in others {
            match self.variables.iter_mut().find(|one| one.name == other.name) {
                Some(one) => one.range = one.range.hull(&other.range),
                None => self.variables.push(other),
            }
        }
    }

    /// The variables that the key `key` sets: the one of that name, or all of its groups (`key/fore`, `key/hind`).
    pub fn variables_of(&self, key: &str) -> Vec<&VariableSpec> {
        let meant = |variable: &&VariableSpec| variable.name == key || variable.key() == key;
        self.variables.iter().filter(meant).collect()
    }
}

/// A key that a kind accepts.
#[derive(Clone, Debug, PartialEq)]
pub struct OptionSpec {
    /// The key.
    pub name: String,
    /// One line for a person.
    pub about: String,
    /// What its value may be.
    pub accepts: Accepts,
    /// Its value where a scenario does not give it; none if it may be absent.
    pub default: Option<OptionValue>,
}

/// What the value of an option may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Accepts {
    /// A quantity with a unit; a bare number where the unit is [`Unit::One`].
    Quantity {
        /// Its unit.
        unit: Unit,
        /// Its range, in that unit.
        range: Range,
    },
    /// A duration, in whole nanoseconds.
    Duration,
    /// A whole number within a range.
    Natural(RangeInclusive<u64>),
    /// True or false.
    Boolean,
    /// Any text.
    Text,
    /// The name of something that only the part itself knows, or of a file: it keeps its place, for the part to say there
    /// what is wrong with it.
    Name,
    /// One of these words.
    Choice(Vec<String>),
    /// How long something takes: a duration, a distribution, or a recorded trace.
    Time,
    /// A table of options.
    Group(Vec<OptionSpec>),
    /// A table with a value for each of the names that it chooses itself.
    Table(Box<Accepts>),
    /// One value for all members of a set (boards, legs), or a table with a value for each that is named.
    Each(Box<Accepts>),
}

/// A number of a controller that may be set while it runs.
#[derive(Clone, Debug, PartialEq)]
pub struct VariableSpec {
    /// Full name: `frequency`, or with a group of legs, `hip_height/fore`.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Its range, in that unit.
    pub range: Range,
    /// Its value where a scenario does not give it.
    pub default: f64,
    /// One line for a person.
    pub about: String,
    /// Its group is a leg, whose name is the robot's: another robot has other groups.
    pub of_leg: bool,
}

impl VariableSpec {
    /// The key that sets it in a scenario: its name without the group.
    pub fn key(&self) -> &str {
        self.name.split('/').next().unwrap_or(&self.name)
    }

    /// Its group of legs, if it has one.
    pub fn group(&self) -> Option<&str> {
        self.name.split_once('/').map(|(_, group)| group)
    }
}
