//! Inputs of a study, and the interface by which it builds plants.

use twinrig_kernel::SimDuration;
use twinrig_rig::{PlantOffer, Variant};
use twinrig_runtime::Plant;

use crate::plants::commands::Commands;

/// Builds the plant variants of one scenario. The caller, who knows the plants, implements it.
pub trait PlantFactory {
    /// Returns the properties of the scenario.
    fn input(&self) -> &StudyInput;

    /// Returns the plants to compare. The first whose segments have mass is the base model that
    /// other models are compared with.
    fn plants(&self) -> &[PlantOffer];

    /// Returns plants that are not compared but can be built, as the reference of a plant that
    /// solves their model.
    fn reference_plants(&self) -> &[PlantOffer] {
        &[]
    }

    /// Returns the plants that were not selected by name and cannot simulate the scenario, each
    /// with the reason.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// Builds a plant at time zero. Its outputs are `leg/*/foot/position`, `body/position`
    /// \[m\] and `body/orientation`.
    ///
    /// # Errors
    /// The reason in plain text; it becomes a row of the study.
    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String>;

    /// Builds a plant whose outputs include its drives, if it has any: `leg/*/{hip,knee}/position`
    /// \[rad\], and `torque` \[N·m\] as the mean over the last step.
    ///
    /// # Errors
    /// As for [`Self::build`].
    fn build_with_drives(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.build(variant)
    }

    /// Builds a plant whose outputs include `leg/*/foot/{load,force,clearance}`, if it has them.
    ///
    /// # Errors
    /// As for [`Self::build`].
    fn build_with_contacts(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.build(variant)
    }
}

/// Properties of the simulated scenario that do not depend on the plant.
#[derive(Clone, Debug)]
pub struct StudyInput {
    /// Name of the scenario.
    pub name: String,
    /// Path of the scenario file.
    pub file: String,
    /// Duration of the scenario.
    pub duration: SimDuration,
    /// The feet can touch ground: friction and restitution are effective.
    pub ground: bool,
    /// The legs are driven by servos: the gain of the position loop is effective.
    pub servos: bool,
    /// Commands applied to every plant.
    pub commands: Commands,
    /// Step of the plant in the scenario.
    pub step: SimDuration,
    /// Coefficient of friction of the ground, if there is one.
    pub friction: Option<f64>,
    /// Stiffness of the soles in the robot file, if known \[N/m\].
    pub sole_stiffness: Option<f64>,
    /// Weight of the robot, legs included \[N\].
    pub weight: f64,
}
