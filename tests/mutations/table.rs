//! The table of disturbances, and what the scenarios expect.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use twinrig::scenario::Setting;
use twinrig_tests::{scenarios, scenarios_in};

/// The tables and keys of a scenario that are the scene: the robot, its plant, its controller, its buses and their faults. The
/// others say what is expected, and how it is looked at.
const SCENE: [&str; 8] = [
    "override",
    "plant",
    "actuator",
    "bus",
    "controller",
    "io",
    "change",
    "fault",
];

/// A disturbance of a scene, and the expectations that see it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// The scenario, below `scenarios/`.
    file: String,
    /// Length of its run, if it is not that of the scenario.
    pub duration: Option<String>,
    /// As of `--set`.
    set: Vec<String>,
    /// Names of the expectations that fail.
    pub fails: Vec<String>,
}

/// An expectation that no disturbance breaks.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exception {
    file: String,
    expectation: String,
    /// Why.
    reason: String,
}

/// All of them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    #[serde(rename = "disturbance")]
    pub disturbances: Vec<Disturbance>,
    #[serde(rename = "exception", default)]
    pub exceptions: Vec<Exception>,
}

/// An expectation of a scenario.
pub struct Expectation {
    file: String,
    name: String,
    /// The plants that it is about; none: any.
    plants: Option<Vec<String>>,
}

impl Table {
    /// The table beside this file.
    pub fn read() -> Self {
        toml::from_str(include_str!("table.toml")).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Entries that are about nothing that is there, that disturb anything but the scene, or that give no reason.
    pub fn misuses(&self) -> Vec<String> {
        let expectations = expectations();
        let mut misuses = Vec::new();
        for one in &self.disturbances {
            let keys = one
                .set
                .iter()
                .map(|set| set.split(['.', '=']).next().unwrap_or(set));
            let beyond = keys.filter(|key| !SCENE.contains(key));
            misuses.extend(beyond.map(|key| format!("{one}: `{key}` is not the scene")));
            let known = |name: &str| {
                let mut named = expectations.iter().filter(|known| known.name == name);
                named.any(|known| one.is_of(known))
            };
            let unknown = one.fails.iter().filter(|name| !known(name));
            misuses.extend(unknown.map(|name| format!("{one}: no expectation `{name}`")));
            if one.fails.is_empty() {
                misuses.push(format!("{one}: nothing fails"));
            }
        }
        for exception in &self.exceptions {
            let Exception {
                file,
                expectation,
                reason,
            } = exception;
            if !expectations.iter().any(|known| exception.is_about(known)) {
                misuses.push(format!("{file}: no expectation `{expectation}`"));
            }
            if reason.is_empty() {
                misuses.push(format!(
                    "{file}: `{expectation}` is excepted without a reason"
                ));
            }
        }
        misuses
    }
}

impl Disturbance {
    /// Where the scenario is.
    pub fn path(&self) -> PathBuf {
        scenarios().join(&self.file)
    }

    /// The settings that make it.
    pub fn settings(&self) -> impl Iterator<Item = Setting> {
        let parts = self
            .set
            .iter()
            .map(|set| set.split_once('=').unwrap_or((set, "")));
        parts
            .map(|(key, value)| setting(key, value))
            .chain(self.length())
    }

    /// The setting of its duration.
    pub fn length(&self) -> Option<Setting> {
        self.duration
            .as_ref()
            .map(|duration| setting("duration", duration))
    }

    /// The plant of its run.
    pub fn plant(&self) -> String {
        let mut settings = self
            .settings()
            .filter(|setting| setting.key == "plant.model");
        let named = settings
            .next()
            .map(|setting| setting.value.trim_matches('"').to_owned());
        named.unwrap_or_else(|| text(&scenario(&self.path())["plant"]["model"]))
    }

    /// Whether `expectation` fails under it.
    pub fn breaks(&self, expectation: &Expectation) -> bool {
        self.is_of(expectation) && self.fails.contains(&expectation.name)
    }

    /// Whether its run has `expectation`.
    fn is_of(&self, expectation: &Expectation) -> bool {
        let about = |plants: &Vec<String>| plants.contains(&self.plant());
        expectation.file == self.file && expectation.plants.as_ref().is_none_or(about)
    }
}

impl Exception {
    pub fn is_about(&self, expectation: &Expectation) -> bool {
        expectation.file == self.file && expectation.name == self.expectation
    }
}

impl fmt::Display for Disturbance {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} --set {}",
            self.file,
            self.set.join(" --set ")
        )
    }
}

impl fmt::Display for Expectation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plants = self
            .plants
            .as_ref()
            .map_or(String::new(), |plants| format!(" ({})", plants.join(", ")));
        write!(formatter, "{}: `{}`{plants}", self.file, self.name)
    }
}

/// What a scenario file says, not checked by anything.
fn scenario(path: &Path) -> toml::Table {
    let text =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn text(value: &toml::Value) -> String {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value:?} is no text"))
        .to_owned()
}

fn setting(key: &str, value: &str) -> Setting {
    Setting {
        origin: "the table".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    }
}

/// Those of all scenarios of the repository.
pub fn expectations() -> Vec<Expectation> {
    let mut expectations = Vec::new();
    for path in ["", "thesis", "models"].map(scenarios_in).concat() {
        let file = path
            .strip_prefix(scenarios())
            .unwrap()
            .display()
            .to_string();
        let scenario = scenario(&path);
        let expected = scenario["expect"].as_array().unwrap();
        expectations.extend(expected.iter().map(|entry| {
            Expectation {
                file: file.clone(),
                name: text(&entry["name"]),
                plants: (entry.get("plants"))
                    .map(|plants| plants.as_array().unwrap().iter().map(text).collect()),
            }
        }));
    }
    expectations
}
