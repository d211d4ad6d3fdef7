//! The rig of a scenario, for a study to couple in many ways.

use std::path::{Path, PathBuf};

use twinrig_kernel::SimDuration;
use twinrig_runtime::{GridInputs, Rig};
use twinrig_scenario::Setting;
use twinrig_study::{CouplingChoice, CouplingInput, RigFactory, RigVariant};

use crate::assembly::Assembly;
use crate::assembly::registry::Registry;
use crate::error::{TwinError, guarded};
use crate::study::builder::first_line;

/// Builds the rigs of a study out of a scenario.
pub(crate) struct RigStudyBuilder<'r> {
    registry: &'r Registry,
    path: PathBuf,
    settings: Vec<Setting>,
    scene: CouplingInput,
    plants: Vec<String>,
    /// Other plants, with the reason why they cannot be in the scene.
    left_out: Vec<String>,
    /// What of each plant is compared, as a scenario says it.
    compared: Vec<String>,
}

impl<'r> RigStudyBuilder<'r> {
    /// For the plants called `names`, the scenario's own and all others that fit it if none is, in the scenario at `path` with
    /// `settings`.
    ///
    /// # Errors
    /// Whatever is wrong with the scenario, or with a plant that is asked for by its name.
    pub(crate) fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        names: &[String],
    ) -> Result<Self, TwinError> {
        let own = Assembly::of_file(registry, path, settings)?;
        let scenario = own.scenario();
        let buses = scenario.buses.iter().map(|bus| bus.name.value.clone());
        let model = scenario.plant.model.as_str();
        let others = registry.plants_on_robots().filter(|name| *name != model);
        let mut builder = Self {
            registry,
            path: path.to_owned(),
            settings: settings.to_vec(),
            scene: CouplingInput {
                name: scenario.name.clone(),
                file: scenario.file.clone(),
                duration: scenario.duration,
                period: own.period(),
                buses: buses.collect(),
            },
            plants: Vec::new(),
            left_out: Vec::new(),
            compared: Vec::new(),
        };
        let candidates: Vec<String> = match names {
            [] => [model]
                .into_iter()
                .chain(others)
                .map(str::to_owned)
                .collect(),
            names => names.to_vec(),
        };
        for name in candidates {
            let file = path.display().to_string();
            match guarded(&file, || builder.assembly(&[model_is(&name)])) {
                Ok(assembly) => {
                    builder.compared.push(compared(&assembly));
                    builder.plants.push(name);
                }
                // Its rows are built anew, and say so.
                Err(TwinError::Panic { .. }) => {
                    builder.compared.push("[]".to_owned());
                    builder.plants.push(name);
                }
                Err(error) if !names.is_empty() => return Err(error),
                Err(error) => {
                    let why = first_line(&error.to_string());
                    builder.left_out.push(format!("{name}: {why}"));
                }
            }
        }
        Ok(builder)
    }

    /// The scenario with more settings.
    fn assembly(&self, more: &[Setting]) -> Result<Assembly<'r>, TwinError> {
        let settings = [&self.settings, more].concat();
        Assembly::of_file(self.registry, &self.path, &settings)
    }
}

fn setting(key: &str, value: String) -> Setting {
    Setting {
        origin: "--set".to_owned(),
        key: key.to_owned(),
        value,
    }
}

fn model_is(name: &str) -> Setting {
    Setting {
        origin: "--plant".to_owned(),
        ..setting("plant.model", format!("{name:?}"))
    }
}

/// The list of what the plant has of it.
fn compared(assembly: &Assembly<'_>) -> String {
    let names = assembly.plant_outputs().iter().map(|port| &port.name);
    let names = names.filter(|name| {
        *name == "body/position" || (name.starts_with("leg/") && name.ends_with("/foot/position"))
    });
    let names: Vec<String> = names.map(|name| format!("{name:?}")).collect();
    format!("[{}]", names.join(", "))
}

fn quantity(duration: SimDuration) -> String {
    format!("\"{} ns\"", duration.as_nanos())
}

/// What a scenario says for it.
fn coupled(way: CouplingChoice) -> String {
    let grid = |step: SimDuration, inputs: &str| {
        format!("{{ grid = {}, inputs = \"{inputs}\" }}", quantity(step))
    };
    match way {
        CouplingChoice::Exact => "\"exact\"".to_owned(),
        CouplingChoice::Grid(step, GridInputs::Mean) => grid(step, "mean"),
        CouplingChoice::Grid(step, GridInputs::Held) => grid(step, "held"),
    }
}

impl RigFactory for RigStudyBuilder<'_> {
    fn input(&self) -> &CouplingInput {
        &self.scene
    }

    fn plants(&self) -> &[String] {
        &self.plants
    }

    fn left_out(&self) -> &[String] {
        &self.left_out
    }

    fn rig(&self, make: &RigVariant<'_>) -> Result<Rig, String> {
        let place = self.plants.iter().position(|name| name == make.plant);
        let compared = place.and_then(|place| self.compared.get(place));
        let compared = compared.ok_or_else(|| format!("there is no plant `{}`", make.plant))?;
        let settings = [
            model_is(make.plant),
            setting("plant.step", quantity(make.step)),
            setting("plant.coupling", coupled(make.way)),
            setting("observe.period", quantity(make.observe)),
            setting("record.signals", compared.clone()),
            // Nothing is judged: what an expectation demands of the observation is of no concern
            // here.
            setting("expect", "[]".to_owned()),
        ];
        let assembly = self.assembly(&settings);
        let rig = assembly.and_then(|assembly| assembly.rig());
        rig.map_err(|error| {
            let text = error.to_string();
            let line = text.lines().next().unwrap_or_default();
            line.trim_start_matches("error: ").to_owned()
        })
    }
}
