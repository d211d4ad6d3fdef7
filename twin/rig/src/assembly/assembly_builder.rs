//! Builder of assemblies: from a file, a text or a recording.

use std::path::Path;

use twinrig_document::Document;
use twinrig_scenario::Setting;

use super::Assembly;
use super::sources::{SCENARIO_FILE, Sources};
use crate::error::Error;
use crate::parts::constraints::DefaultRules;
use crate::registry::Registry;

/// Builder of an [`Assembly`]; the last call names the scenario.
///
/// ```no_run
/// use std::path::Path;
/// use twinrig_rig::{Assembly, Registry};
///
/// let registry = Registry::standard();
/// let trot = Path::new("scenarios/trot.toml");
/// let assembly = Assembly::builder(&registry).plant("lcp").file(trot)?;
/// # Ok::<(), twinrig_rig::Error>(())
/// ```
#[must_use]
pub struct AssemblyBuilder<'r, 's> {
    registry: &'r Registry,
    settings: &'s [Setting],
    plant: Option<&'s str>,
    robot: Option<String>,
    files: Option<Vec<(String, Vec<u8>)>>,
    rules: DefaultRules,
}

impl<'r> Assembly<'r> {
    /// Begins an assembly with the parts of `registry`.
    pub fn builder<'s>(registry: &'r Registry) -> AssemblyBuilder<'r, 's> {
        AssemblyBuilder {
            registry,
            settings: &[],
            plant: None,
            robot: None,
            files: None,
            rules: DefaultRules::Present,
        }
    }
}

impl<'r, 's> AssemblyBuilder<'r, 's> {
    /// Applies settings on top of the scenario.
    pub fn settings(self, settings: &'s [Setting]) -> Self {
        Self { settings, ..self }
    }

    /// Takes the plant `name` in place of that of the scenario. A plant without constraints or a
    /// tolerance ignores those of the scenario.
    pub fn plant(self, name: &'s str) -> Self {
        let plant = Some(name);
        Self { plant, ..self }
    }

    /// Takes the text of a robot file: no such file is searched.
    pub fn robot(self, text: impl Into<String>) -> Self {
        let robot = Some(text.into());
        Self { robot, ..self }
    }

    /// Takes the files of a standalone plant, by name: none are read from disk.
    pub fn files(self, files: Vec<(String, Vec<u8>)>) -> Self {
        let files = Some(files);
        Self { files, ..self }
    }

    /// Takes other rules for values that the scenario leaves open.
    pub fn rules(self, rules: DefaultRules) -> Self {
        Self { rules, ..self }
    }

    /// Reads the scenario file at `path`.
    ///
    /// # Errors
    /// Errors of the scenario, of its robot, or of their parts.
    pub fn file(self, path: &Path) -> Result<Assembly<'r>, Error> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let sources = Sources::of(Document::read(path)?, folder);
        self.assembled(sources)
    }

    /// Reads a scenario from `text`; messages and the report call it `file`, and paths and robots
    /// are relative to `folder`.
    ///
    /// # Errors
    /// As [`Self::file`].
    pub fn text(self, file: &str, text: &str, folder: &Path) -> Result<Assembly<'r>, Error> {
        let sources = Sources::of(Document::parse(file, text)?, folder);
        self.assembled(sources)
    }

    /// Reads a scenario as a recording keeps it, from texts alone.
    ///
    /// # Errors
    /// As [`Self::file`].
    pub fn recorded(self, scenario: &str) -> Result<Assembly<'r>, Error> {
        let files = self.files.clone().unwrap_or_default();
        self.files(files)
            .text(SCENARIO_FILE, scenario, Path::new(""))
    }

    /// Reads a scenario from sources, which replace robot, files and rules of this builder.
    ///
    /// # Errors
    /// As [`Self::file`].
    pub fn sources(self, sources: &Sources) -> Result<Assembly<'r>, Error> {
        Assembly::of(self.registry, sources, self.settings)
    }

    fn assembled(self, sources: Sources) -> Result<Assembly<'r>, Error> {
        let sources = Sources {
            robot: self.robot,
            kept: self.files,
            rules: self.rules,
            ..sources
        };
        match self.plant {
            None => Assembly::of(self.registry, &sources, self.settings),
            Some(plant) => {
                let settings = self.settings.iter().cloned().chain([Setting::plant(plant)]);
                let settings: Vec<Setting> = settings.collect();
                Assembly::of(self.registry, &sources.on_another_plant(), &settings)
            }
        }
    }
}
