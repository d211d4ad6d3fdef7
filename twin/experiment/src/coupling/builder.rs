//! Rigs of a study of coupling, built from a scenario.

use std::path::Path;

use twinrig_kernel::signal;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_runtime::Rig;
use twinrig_scenario::Setting;

use crate::error::{Error, first_line};
use crate::plants::selection::of_plant;
use crate::{CouplingInput, CouplingStudy, RigFactory, RigVariant};

/// Reason for refusing a plant of which nothing could be compared.
const NO_POSITIONS: &str = "a study of coupling compares the positions of trunk and feet, body/position and leg/*/foot/position, and this plant has none of these outputs";

/// Builds the rigs of a study from a scenario.
pub(crate) struct RigStudyBuilder<'r> {
    scene: CouplingInput,
    plants: Vec<String>,
    /// The scenario with each plant; otherwise the reason why it cannot be built.
    assemblies: Vec<Result<Assembly<'r>, String>>,
    /// Unselected plants that cannot be in the scene, with the reason.
    left_out: Vec<String>,
    /// Panics of plants that were built to check them.
    panics: Vec<String>,
}

impl<'r> RigStudyBuilder<'r> {
    /// Selects the plants called `names`, or the scenario's own and all others that can simulate
    /// it, in the scenario at `path` with `settings`.
    ///
    /// # Errors
    /// Errors of the scenario, or of a plant selected by name.
    pub(crate) fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        names: &[String],
    ) -> Result<Self, Error> {
        let own = Assembly::builder(registry).settings(settings).file(path)?;
        let scenario = own.scenario();
        if compared(&own).is_empty() {
            let model = &scenario.plant.model;
            return Err(RigError::not_built(scenario, "plant", model, NO_POSITIONS.into()).into());
        }
        let buses = scenario.buses.iter().map(|bus| bus.name.value.clone());
        let model = scenario.plant.model.as_str();
        let others = registry.plants_on_robots().filter(|name| *name != model);
        let mut builder = Self {
            scene: CouplingInput {
                name: scenario.name.clone(),
                file: scenario.file.clone(),
                duration: scenario.duration,
                period: own.period(),
                buses: buses.collect(),
            },
            plants: Vec::new(),
            assemblies: Vec::new(),
            left_out: Vec::new(),
            panics: Vec::new(),
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
            let assembly = match of_plant(registry, path, settings, &name) {
                Ok(assembly) => Ok(assembly),
                // Each of its rows reports the panic.
                Err(RigError::Panic { source, .. }) => {
                    builder.panics.push(source.to_string());
                    Err(source.to_string())
                }
                Err(error) if !names.is_empty() => return Err(error.into()),
                Err(error) => {
                    let why = first_line(&error.to_string());
                    builder.left_out.push(format!("{name}: {why}"));
                    continue;
                }
            };
            builder.assemblies.push(assembly);
            builder.plants.push(name);
        }
        Ok(builder)
    }

    /// Adds the panics from before the study.
    pub(crate) fn with_panics(&self, mut study: CouplingStudy) -> CouplingStudy {
        study.panics.splice(..0, self.panics.iter().cloned());
        study
    }
}

/// The outputs that are compared: positions of trunk and feet.
fn compared(assembly: &Assembly<'_>) -> Vec<String> {
    let names = assembly.plant_outputs().iter().map(|port| &port.name);
    let names = names.filter(|name| {
        let of_leg = signal::parse_leg(name);
        *name == signal::BODY_POSITION || of_leg.is_some_and(|(_, it)| it == signal::FOOT_POSITION)
    });
    names.cloned().collect()
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

    fn rig(&self, variant: &RigVariant<'_>) -> Result<Rig, String> {
        let place = self.plants.iter().position(|name| name == variant.plant);
        let assembly = place.and_then(|place| self.assemblies.get(place));
        let assembly = assembly.ok_or_else(|| format!("there is no plant `{}`", variant.plant))?;
        let assembly = assembly.as_ref().map_err(Clone::clone)?;
        let mut scenario = assembly.scenario().without_expectations();
        scenario.plant.step = Some(variant.step);
        scenario.plant.coupling = variant.coupling;
        scenario.observe.period = variant.observe;
        scenario.record.signals = Some(Vec::new());
        scenario.record.frames = None;
        let rig = assembly
            .with_scenario(&scenario, &compared(assembly))
            .and_then(|assembly| assembly.rig());
        rig.map_err(|error| first_line(&error.to_string()))
    }
}
