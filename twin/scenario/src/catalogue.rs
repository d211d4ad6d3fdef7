//! Kinds of plants, controllers and buses of a build, and the keys that each of them accepts.

use twinrig_document::Range;
use twinrig_kernel::Unit;

use crate::options::OptionSpec;

/// Kinds of parts in a build. The program that links the parts fills it; this crate knows no kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Catalogue {
    /// Accepted as `[plant] model`.
    pub plants: Vec<Kind>,
    /// Accepted as `[controller] kind`.
    pub controllers: Vec<Kind>,
    /// Accepted as `[bus] kind`.
    pub buses: Vec<Kind>,
}

impl Catalogue {
    /// Adds the options of these names, of any plant, to each plant that has none of that name,
    /// without defaults: a plant can then take the place of another in a scenario.
    pub fn share_plant_options(&mut self, names: &[&str]) {
        let all = self.plants.iter().flat_map(|kind| kind.options.clone());
        let all = all.filter(|option| names.contains(&option.name.as_str()));
        let all: Vec<OptionSpec> = all
            .map(|option| OptionSpec {
                default: None,
                ..option
            })
            .collect();
        for kind in &mut self.plants {
            for option in &all {
                if kind.options.iter().all(|known| known.name != option.name) {
                    kind.options.push(option.clone());
                }
            }
        }
    }
}

/// Properties of a plant that is a standalone model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standalone {
    /// Whether it accepts the keys of plants on robots nevertheless, since it can take the place of
    /// one. The ground and the legs then serve the judge; base, start and actuators are those of
    /// the model.
    pub takes_robot_keys: bool,
    /// Whether it has a file whose values a scenario overrides, as those of a robot file.
    pub is_overridable: bool,
}

/// A kind of part.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// Name in a scenario.
    pub name: String,
    /// One-line description for display.
    pub about: String,
    /// Remedy for a kind that this program lacks, such as the cargo feature to build it with; none
    /// if the kind is available.
    pub remedy: Option<String>,
    /// Properties of a plant that is a standalone model: a scenario then requires no robot and
    /// cannot set base, legs, ground, start and actuators. None of other plants.
    pub standalone: Option<Standalone>,
    /// Whether trunk and feet can be pushed. Plants only.
    pub takes_pushes: bool,
    /// Keys of its table besides those common to all parts of its sort.
    pub options: Vec<OptionSpec>,
    /// Process variables: keys of its table as well, which may change during a run. Controllers
    /// only.
    pub variables: Vec<VariableSpec>,
}

impl Kind {
    /// Returns an available kind without options or variables.
    pub fn new(name: impl Into<String>, about: impl Into<String>) -> Self {
        Kind {
            name: name.into(),
            about: about.into(),
            remedy: None,
            standalone: None,
            takes_pushes: false,
            options: Vec::new(),
            variables: Vec::new(),
        }
    }

    /// Returns whether a plant of this kind has the keys of plants on robots.
    pub(crate) fn has_robot_keys(&self) -> bool {
        self.standalone
            .is_none_or(|standalone| standalone.takes_robot_keys)
    }

    /// Returns the variable of that full name.
    pub fn variable(&self, name: &str) -> Option<&VariableSpec> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// Merges the variables of this kind for another robot: adds missing ones and extends the
    /// ranges of the others to the hull.
    pub fn unite_variables(&mut self, others: Vec<VariableSpec>) {
        for other in others {
            match self.variables.iter_mut().find(|one| one.name == other.name) {
                Some(one) => one.range = one.range.hull(&other.range),
                None => self.variables.push(other),
            }
        }
    }

    /// Returns the variables that the key `key` sets: the one of that name, or all of its groups
    /// (`key/fore`, `key/hind`).
    pub fn variables_of(&self, key: &str) -> Vec<&VariableSpec> {
        let is_set_by_key =
            |variable: &&VariableSpec| variable.name == key || variable.key() == key;
        self.variables.iter().filter(is_set_by_key).collect()
    }
}

/// Numeric process variable of a controller, which may be set during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct VariableSpec {
    /// Full name: `frequency`, or with a group of legs, `hip_height/fore`.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Its range, in that unit.
    pub range: Range,
    /// Default value.
    pub default: f64,
    /// One-line description for display.
    pub about: String,
    /// Whether its group is a leg: leg names, and thus groups, depend on the robot.
    pub of_leg: bool,
}

impl VariableSpec {
    /// Returns the key that sets it in a scenario: its name without the group.
    pub fn key(&self) -> &str {
        self.name.split('/').next().unwrap_or(&self.name)
    }

    /// Returns its group of legs, if any.
    pub fn group(&self) -> Option<&str> {
        self.name.split_once('/').map(|(_, group)| group)
    }
}
