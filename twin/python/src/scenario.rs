//! Scenarios as the package passes them: a file or a text, with settings.

use std::path::{Path, PathBuf};

use pyo3::FromPyObject;
use twinrig::scenario::Setting;
use twinrig::{Assembly, Error, Registry};

/// Scenario with settings.
#[derive(FromPyObject)]
pub(crate) struct ScenarioArgument(
    /// Path of the file, or name of the text in messages.
    PathBuf,
    /// Text, for a scenario without a file.
    Option<String>,
    /// Origin, key and value of each setting.
    Vec<(String, String, String)>,
);

impl ScenarioArgument {
    /// Reads and checks the scenario. Paths in a text are relative to the current folder.
    pub(crate) fn assembly<'r>(&self, registry: &'r Registry) -> Result<Assembly<'r>, Error> {
        let Self(path, text, settings) = self;
        let setting = |(origin, key, value): &(String, String, String)| Setting {
            origin: origin.clone(),
            key: key.clone(),
            value: value.clone(),
        };
        let settings: Vec<Setting> = settings.iter().map(setting).collect();
        match text {
            None => Assembly::builder(registry).settings(&settings).file(path),
            Some(text) => {
                let name = path.to_string_lossy();
                Assembly::builder(registry)
                    .settings(&settings)
                    .text(&name, text, Path::new(""))
            }
        }
    }
}
