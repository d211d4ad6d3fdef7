//! Contexts for building plants, and the models of plants without a robot file.

use std::path::Path;

use twinrig_document::{Overrides, Warning};
use twinrig_kernel::{Direction, Port, SimDuration};
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_scenario::{ActuatorSpec, LegFact, PlantSpec, PushSpec};

use crate::error::BuildError;
use crate::parts::accuracy::Accuracy;

/// Context for building a plant.
#[derive(Clone, Copy)]
pub struct PlantContext<'a> {
    /// Robot, including overrides of the scenario.
    pub robot: &'a Robot,
    /// Legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// `[plant]` table of the scenario.
    pub plant: &'a PlantSpec,
    /// `[actuator]` table of the scenario.
    pub actuator: &'a ActuatorSpec,
    /// Pushes of the scenario; none where the kind takes none.
    pub pushes: &'a [PushSpec],
    /// First commands of the controller by signal name; all elements of a vector have its name.
    pub first_commands: &'a [(String, f64)],
    /// Period of the commands.
    pub command_period: SimDuration,
    /// Seed of the run.
    pub seed: u64,
    /// Whether the output of that name is requested; other outputs need not be computed.
    pub wanted: &'a dyn Fn(&str) -> bool,
}

/// Context for loading the model of a standalone plant.
#[derive(Clone, Copy, Debug)]
pub struct ModelContext<'a> {
    /// `[plant]` table of the scenario.
    pub plant: &'a PlantSpec,
    /// Folder that paths are relative to.
    pub folder: &'a Path,
    /// Values that the scenario replaces in a robot file or in the file of the plant.
    pub overrides: &'a Overrides,
    /// Seed of the run.
    pub seed: u64,
    /// Files of [`StandaloneModel::files`] stored in a recording; set when a recording is replayed,
    /// where no other files are available.
    pub kept: Option<&'a [(String, Vec<u8>)]>,
}

/// Model of a plant that is not based on a robot file.
pub trait StandaloneModel: Send + Sync {
    /// Returns the name of the model, for reports.
    fn name(&self) -> &str;

    /// Returns the legs, as named in the signals (`leg/LF/…`); none if the model does not know
    /// them: they are then those of the scenario's robot or, without one, of the signals.
    fn legs(&self) -> Option<Vec<LegFact>>;

    /// Returns the weight \[N\]; none if the model does not know it: it is then that of the
    /// scenario's robot.
    fn weight(&self) -> Option<f64>;

    /// Returns the ports, including all outputs.
    fn ports(&self) -> Vec<Port>;

    /// Returns the names of the inputs.
    fn inputs(&self) -> Vec<String> {
        let ports = self.ports().into_iter();
        let inputs = ports.filter(|port| port.direction == Direction::Input);
        inputs.map(|port| port.name).collect()
    }

    /// Returns the default step, if the model defines one.
    fn step(&self) -> Option<SimDuration>;

    /// Returns the settings of its numerical error: by default a step, if there is one.
    fn accuracy(&self, plant: &PlantSpec) -> Accuracy {
        let step = plant.step.or_else(|| self.step());
        step.map_or(Accuracy::Unknown, |step| Accuracy::Set {
            step,
            tolerance: None,
        })
    }

    /// Returns warnings about its values.
    fn warnings(&self) -> Vec<Warning> {
        Vec::new()
    }

    /// Returns the files, by name, that a recording must store for replay.
    fn files(&self) -> Vec<(String, Vec<u8>)>;

    /// Builds the plant, which computes the outputs for which `wanted` holds.
    ///
    /// # Errors
    /// If the model does not support the settings of the scenario.
    fn build(
        &self,
        plant: &PlantSpec,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Box<dyn Plant>, BuildError>;
}
