//! Table of disturbances, and the expectations of the scenarios.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use twinrig::scenario::Setting;
use twinrig_tests::{scenarios, scenarios_in};

/// Tables and keys of a scenario that a disturbance may set: robot, plant, controller with its
/// sensors, buses and their faults. The other keys define expectations and observation.
const DISTURBABLE: [&str; 12] = [
    "override",
    "plant",
    "actuator",
    "bus",
    "controller",
    "io",
    "change",
    "fault",
    "sensor",
    "push",
    "payload",
    "surface",
];

/// A disturbance of a scenario, and the expectations that detect it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Scenario file, relative to `scenarios/`.
    file: String,
    /// Duration of the run, if different from that of the scenario.
    pub duration: Option<String>,
    /// Settings, as of `--set`.
    set: Vec<String>,
    /// Names of the expectations that fail.
    pub fails: Vec<String>,
}

/// An expectation without a disturbance.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exception {
    file: String,
    expectation: String,
    /// Reason.
    reason: String,
}

/// Contents of the table.
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
    /// Plants to which it applies; `None` for all.
    plants: Option<Vec<String>>,
}

impl Table {
    /// Reads the table from the folder of this file.
    pub fn read() -> Self {
        toml::from_str(include_str!("table.toml")).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Returns the invalid entries: of unknown expectations, with settings other than of the
    /// scenario's physics, or without a reason.
    pub fn invalid_entries(&self) -> Vec<String> {
        let expectations = expectations();
        let mut invalid_entries = Vec::new();
        for disturbance in &self.disturbances {
            let keys = disturbance
                .set
                .iter()
                .map(|set| set.split(['.', '=']).next().unwrap_or(set));
            let beyond = keys.filter(|key| !DISTURBABLE.contains(key));
            invalid_entries
                .extend(beyond.map(|key| format!("{disturbance}: `{key}` is not a disturbance")));
            let known = |name: &str| {
                let mut named = expectations.iter().filter(|known| known.name == name);
                named.any(|known| disturbance.applies_to(known))
            };
            let unknown = disturbance.fails.iter().filter(|name| !known(name));
            invalid_entries
                .extend(unknown.map(|name| format!("{disturbance}: no expectation `{name}`")));
            if disturbance.fails.is_empty() {
                invalid_entries.push(format!("{disturbance}: no expectation fails"));
            }
        }
        for exception in &self.exceptions {
            let Exception {
                file,
                expectation,
                reason,
            } = exception;
            if !expectations.iter().any(|known| exception.covers(known)) {
                invalid_entries.push(format!("{file}: no expectation `{expectation}`"));
            }
            if reason.is_empty() {
                invalid_entries.push(format!(
                    "{file}: exception of `{expectation}` without a reason"
                ));
            }
        }
        invalid_entries
    }
}

impl Disturbance {
    /// Path of the scenario file.
    pub fn path(&self) -> PathBuf {
        scenarios().join(&self.file)
    }

    /// Settings of the disturbance.
    pub fn settings(&self) -> impl Iterator<Item = Setting> {
        let parts = self
            .set
            .iter()
            .map(|set| set.split_once('=').unwrap_or((set, "")));
        parts
            .map(|(key, value)| setting(key, value))
            .chain(self.length())
    }

    /// Setting of the duration.
    pub fn length(&self) -> Option<Setting> {
        self.duration
            .as_ref()
            .map(|duration| setting("duration", duration))
    }

    /// Plant of the run.
    pub fn plant(&self) -> String {
        let mut settings = self
            .settings()
            .filter(|setting| setting.key == "plant.model");
        let named = settings
            .next()
            .map(|setting| setting.value.trim_matches('"').to_owned());
        named.unwrap_or_else(|| text(&scenario(&self.path())["plant"]["model"]))
    }

    /// Whether `expectation` fails under the disturbance.
    pub fn is_detected_by(&self, expectation: &Expectation) -> bool {
        self.applies_to(expectation) && self.fails.contains(&expectation.name)
    }

    /// Whether the run evaluates `expectation`.
    fn applies_to(&self, expectation: &Expectation) -> bool {
        let about = |plants: &Vec<String>| plants.contains(&self.plant());
        expectation.file == self.file && expectation.plants.as_ref().is_none_or(about)
    }
}

impl Exception {
    pub fn covers(&self, expectation: &Expectation) -> bool {
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

/// Reads a scenario file without checking it.
fn scenario(path: &Path) -> toml::Table {
    let text =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn text(value: &toml::Value) -> String {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value:?} is not a string"))
        .to_owned()
}

fn setting(key: &str, value: &str) -> Setting {
    Setting {
        origin: "the table".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    }
}

/// Returns the expectations of all scenarios of the repository.
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
