//! Contents of the files of a run, for its key and for workers elsewhere.

use std::path::Path;

use serde::{Deserialize, Serialize};
use twinrig_document::Document;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::assembly::body::Body;
use twinrig_rig::assembly::sources::Sources;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_scenario::{Scenario, Setting};

use super::parts::UsedParts;

/// Returns the bytes of job data, whose types have lists, texts and numbers only, which can be
/// serialised.
pub(crate) fn encoded(data: &(impl Serialize + ?Sized)) -> Vec<u8> {
    postcard::to_stdvec(data).unwrap_or_default()
}

/// Contents of the files of [`Sources`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SharedSources {
    file: String,
    text: String,
    folder: String,
    robot: Option<String>,
    kept: Option<Vec<(String, Vec<u8>)>>,
}

impl SharedSources {
    pub(crate) fn of(sources: &Sources) -> Self {
        Self {
            file: sources.document.file().to_owned(),
            text: sources.document.text().to_owned(),
            folder: sources.folder.display().to_string(),
            robot: sources.robot.clone(),
            kept: sources.kept.clone(),
        }
    }

    /// Returns sources that need no files.
    pub(crate) fn sources(self) -> Result<Sources, RigError> {
        let document = Document::parse(&self.file, &self.text)?;
        Ok(Sources {
            robot: self.robot,
            kept: self.kept,
            ..Sources::of(document, Path::new(&self.folder))
        })
    }
}

/// Origin, key and value of settings.
pub(crate) type SharedSettings = Vec<(String, String, String)>;

/// Returns origin, key and value of settings.
pub(crate) fn shared_settings(settings: &[Setting]) -> SharedSettings {
    let settings = settings.iter().cloned();
    settings.map(|it| (it.origin, it.key, it.value)).collect()
}

/// Returns settings by origin, key and value.
pub(crate) fn settings(shared: SharedSettings) -> Vec<Setting> {
    let setting = |(origin, key, value)| Setting { origin, key, value };
    shared.into_iter().map(setting).collect()
}

/// Returns the contents of all files that a run depends on.
pub(crate) fn bytes_of_files(scenario: &Scenario, body: &Body) -> Vec<Vec<u8>> {
    let robot = body.robot_file().map_or("", |(_, text)| text);
    let mut bytes = vec![
        scenario.text.clone().into_bytes(),
        robot.as_bytes().to_vec(),
    ];
    for (name, content) in body.files() {
        bytes.extend([name.into_bytes(), content]);
    }
    bytes
}

/// Returns the same sources without files.
pub(crate) fn in_memory(on_disk: &Sources, body: &Body) -> Sources {
    Sources {
        robot: body.robot_file().map(|(_, text)| text.to_owned()),
        kept: Some(body.files()),
        ..Sources::of(on_disk.document.clone(), &on_disk.folder)
    }
}

/// A scenario with settings, on its own plant or on another one, and the contents of its files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct RunScene {
    sources: SharedSources,
    settings: SharedSettings,
    on_another_plant: bool,
    parts: UsedParts,
}

impl RunScene {
    /// Reads the scenario at `path` with `settings`, on the plant `plant` or on its own.
    ///
    /// # Errors
    /// Errors of the scenario.
    pub(crate) fn read<'r>(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        plant: Option<&str>,
    ) -> Result<(Self, Assembly<'r>), RigError> {
        let on_disk = Sources::of(
            Document::read(path)?,
            path.parent().unwrap_or(Path::new("")),
        );
        let on_disk = match plant {
            Some(_) => on_disk.on_another_plant(),
            None => on_disk,
        };
        let plant = plant.map(Setting::plant);
        let settings: Vec<Setting> = settings.iter().cloned().chain(plant.clone()).collect();
        let assembly = Assembly::builder(registry)
            .settings(&settings)
            .sources(&on_disk)?;
        let scene = Self {
            sources: SharedSources::of(&in_memory(&on_disk, assembly.body())),
            settings: shared_settings(&settings),
            on_another_plant: plant.is_some(),
            parts: UsedParts::of(assembly.scenario()),
        };
        Ok((scene, assembly))
    }

    /// Returns the name of the scenario's file.
    pub(crate) fn file(&self) -> &str {
        &self.sources.file
    }

    /// Returns the kinds of parts.
    pub(crate) fn parts(&self) -> &UsedParts {
        &self.parts
    }

    /// Returns everything that a run depends on: contents, not names of files and folders, which
    /// may be others on another machine.
    pub(crate) fn contents(&self) -> Vec<u8> {
        let SharedSources {
            text, robot, kept, ..
        } = &self.sources;
        let settings = self.settings.iter();
        let settings: Vec<_> = settings.map(|(_, key, value)| (key, value)).collect();
        encoded(&(text, robot, kept, settings, self.on_another_plant))
    }

    /// Assembles the scene without files, with `further` settings.
    ///
    /// # Errors
    /// Errors of the scenario, on a machine with other parts, and of the further settings.
    pub(crate) fn assembly<'r>(
        &self,
        registry: &'r Registry,
        further: &[Setting],
    ) -> Result<Assembly<'r>, RigError> {
        let sources = self.sources.clone().sources()?;
        let sources = if self.on_another_plant {
            sources.on_another_plant()
        } else {
            sources
        };
        let settings = settings(self.settings.clone()).into_iter();
        let settings: Vec<Setting> = settings.chain(further.iter().cloned()).collect();
        Assembly::builder(registry)
            .settings(&settings)
            .sources(&sources)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Reads the trot with this duration.
    pub(crate) fn trot(registry: &Registry, duration: &str, plant: Option<&str>) -> RunScene {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
        let settings = [
            setting("duration", duration),
            setting("expect", "[{ body = { fall = false } }]"),
        ];
        let read = RunScene::read(registry, Path::new(path), &settings, plant);
        read.unwrap().0
    }

    fn setting(key: &str, value: &str) -> Setting {
        Setting {
            origin: "--set".to_owned(),
            key: key.to_owned(),
            value: value.to_owned(),
        }
    }

    #[test]
    fn contents_have_the_files_of_the_body() {
        let scene = trot(&Registry::standard(), "'2 s'", None);
        let mut other = scene.clone();
        other.sources.kept = Some(vec![("mesh.stl".to_owned(), vec![1])]);
        assert_ne!(scene.contents(), other.contents());
    }

    #[test]
    fn further_settings_replace_those_of_the_scene_on_another_plant() {
        let registry = Registry::standard();
        let scene = trot(&registry, "'2 s'", Some("lcp"));
        let longer = setting("duration", "'3 s'");
        let assembly = scene.assembly(&registry, &[longer]).unwrap();
        assert_eq!(assembly.scenario().duration.as_secs_f64(), 3.0);
        assert_eq!(assembly.scenario().plant.model, "lcp");
    }
}
