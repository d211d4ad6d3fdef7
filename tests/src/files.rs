//! Scenario files of the repository.

use std::path::{Path, PathBuf};

use twinrig::scenario::Setting;
use twinrig::{Assembly, Error, Registry};

/// Folder of the scenarios.
pub fn scenarios() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios")
}

/// Returns the scenario files in the subfolder `below`, sorted by name.
///
/// # Panics
/// If the folder does not exist.
pub fn scenarios_in(below: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(scenarios().join(below)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| {
        path.extension()
            .is_some_and(|extension| extension == "toml")
    });
    paths.sort();
    paths
}

/// Returns settings of a scenario: keys and values in TOML.
pub fn settings(settings: &[(&str, &str)]) -> Vec<Setting> {
    let setting = |(key, value): &(&str, &str)| Setting {
        origin: "the test".to_owned(),
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    };
    settings.iter().map(setting).collect()
}

/// Assembles a shipped scenario with settings.
///
/// # Errors
/// As of the scenario, if it or a setting is invalid.
pub fn shipped<'r>(
    registry: &'r Registry,
    file: &str,
    changes: &[(&str, &str)],
) -> Result<Assembly<'r>, Error> {
    let settings = settings(changes);
    let builder = Assembly::builder(registry).settings(&settings);
    builder.file(&scenarios().join(file))
}
