//! The twin that plays the commands of recordings.

use std::path::{Path, PathBuf};

use twinrig_campaign::identification::FitSpace;
use twinrig_document::Document;
use twinrig_kernel::{Direction, SimTime};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::playback::{Playback, TimedValues};
use twinrig_rig::registry::Registry;
use twinrig_runtime::{Plant, PlantState};
use twinrig_scenario::Setting;

use super::data::FitData;
use crate::error::{Error, FitError};
use crate::runs::scene::RunScene;

/// Table of the values of the file of robot or bench that a scenario replaces.
const OVERRIDE: &str = "override";

/// A scenario whose plant plays commands.
pub(super) struct Twin<'r> {
    registry: &'r Registry,
    file: String,
    text: String,
    path: PathBuf,
    settings: Vec<Setting>,
    /// Outputs that are compared.
    outputs: Vec<String>,
    /// Their components.
    components: Vec<Option<usize>>,
    origin: String,
}

impl<'r> Twin<'r> {
    pub(super) fn new(
        registry: &'r Registry,
        space: &FitSpace,
        settings: &[Setting],
    ) -> Result<Self, Error> {
        let path = PathBuf::from(&space.file);
        let beside = path.parent().unwrap_or(&path);
        let path = beside.join(&space.scenario.value);
        let document = Document::read(&path)?;
        let own = space.set.iter().map(|(key, value)| Setting {
            origin: space.file.clone(),
            key: key.clone(),
            value: value.clone(),
        });
        Ok(Self {
            registry,
            file: document.file().to_owned(),
            text: document.text().to_owned(),
            path,
            settings: own.chain(settings.iter().cloned()).collect(),
            outputs: space
                .residuals
                .iter()
                .map(|it| it.twin.value.clone())
                .collect(),
            components: space.residuals.iter().map(|it| it.component).collect(),
            origin: space.file.clone(),
        })
    }

    /// Returns everything that its runs depend on, but the values of a point.
    ///
    /// # Errors
    /// Errors of the scenario.
    pub(super) fn contents(&self) -> Result<Vec<u8>, Error> {
        let (scene, _) = RunScene::read(self.registry, &self.path, &self.settings, None)?;
        Ok(scene.contents())
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Returns the scenario file.
    pub(super) fn scenario(&self) -> &str {
        &self.file
    }

    /// Returns the twin of a recording: the scenario with the values that it states.
    ///
    /// # Errors
    /// Errors of the scenario, and values that its plant does not have.
    pub(super) fn of_recording(
        &self,
        recorded: &[(String, String)],
    ) -> Result<Assembly<'r>, Error> {
        let stated = recorded.iter().map(|(key, value)| Setting {
            origin: self.origin.clone(),
            key: format!("{OVERRIDE}.{key}"),
            value: value.clone(),
        });
        // The search space and the user know better than a log.
        let settings: Vec<Setting> = stated.chain(self.settings.iter().cloned()).collect();
        let builder = Assembly::builder(self.registry).settings(&settings);
        Ok(builder.text(&self.file, &self.text, self.folder())?)
    }

    /// Builds the plant of a recording at a point: keys and values in TOML.
    ///
    /// # Errors
    /// Values that the plant does not accept.
    pub(super) fn plant(
        &self,
        assembly: &Assembly<'r>,
        point: &[(&str, &str)],
    ) -> Result<Box<dyn Plant>, Error> {
        let mut overrides = Document::parse(&self.origin, "")?;
        let (mut others, prefix) = (Vec::new(), format!("{OVERRIDE}."));
        for (key, value) in point {
            match key.strip_prefix(&prefix) {
                Some(key) => overrides.set(&self.origin, key, value)?,
                None => others.push(Setting {
                    origin: self.origin.clone(),
                    key: (*key).to_owned(),
                    value: (*value).to_owned(),
                }),
            }
        }
        if others.is_empty() {
            return Ok(assembly.overridden_plant(&overrides.overrides(), &self.outputs)?);
        }
        // Keys of the scenario itself: all of it is read again.
        let settings = [assembly.scenario().settings.as_slice(), &others].concat();
        let builder = Assembly::builder(self.registry).settings(&settings);
        let assembly = builder.text(&self.file, &self.text, self.folder())?;
        Ok(assembly.overridden_plant(&overrides.overrides(), &self.outputs)?)
    }

    /// Returns the names of the inputs of a plant, in order.
    pub(super) fn inputs(plant: &dyn Plant) -> Vec<String> {
        let ports = plant.ports().into_iter();
        let inputs = ports.filter(|port| port.direction == Direction::Input);
        inputs.map(|port| port.name).collect()
    }

    /// Plays the commands of a recording on a plant; returns the outputs at the times of each
    /// compared signal, none where the plant has failed.
    ///
    /// # Errors
    /// [`FitError`] if the plant lacks a signal or does not start as the recording does.
    pub(super) fn play(
        &self,
        data: &FitData,
        plant: &mut dyn Plant,
    ) -> Result<Option<Vec<Vec<f64>>>, FitError> {
        let names = data.commands.iter().map(|(name, _)| name.as_str());
        let outputs = self.outputs.iter().map(String::as_str);
        let outputs = outputs.zip(self.components.iter().copied());
        let playback = Playback::new(plant, names, outputs)?;
        start(data, plant)?;
        let commands: Vec<&TimedValues> = data.commands.iter().map(|(_, it)| it).collect();
        let samples: Vec<_> = data.compared.iter().map(|it| it.times.as_slice()).collect();
        Ok(playback
            .play(plant, SimTime::ZERO, &commands, &samples)
            .ok())
    }
}

/// Starts the plant in the state of a recording.
fn start(data: &FitData, plant: &mut dyn Plant) -> Result<(), FitError> {
    if data.start.is_empty() {
        return Ok(());
    }
    let refused = |why: String| FitError::Start {
        recording: data.file.clone(),
        why,
    };
    let none = || refused("the plant has no named state".to_owned());
    let mut state: PlantState = plant.state().ok_or_else(none)?;
    for (name, value) in &data.start {
        if state.get(name).is_none_or(|known| known.len() != 1) {
            return Err(refused(format!("the plant has no state `{name}`")));
        }
        state = state.with(name.clone(), &[*value]);
    }
    let lines = plant.resume_from(&state);
    let lines = lines.map_err(|fault| refused(fault.why))?;
    match lines.first() {
        None => Ok(()),
        Some(line) => Err(refused(line.clone())),
    }
}
