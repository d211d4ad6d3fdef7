//! Inputs of a study, and the interface by which it builds plants.

use serde::Serialize;
use twinrig_kernel::SimDuration;
use twinrig_runtime::Plant;

use crate::commands::Commands;
use crate::plant_id::PlantId;

/// Builds the plant variants of one scenario. The caller, who knows the plants, implements it.
pub trait PlantFactory {
    /// Returns the properties of the scenario.
    fn input(&self) -> &StudyInput;

    /// Returns the plants to compare. The first whose segments have mass is the base model that
    /// other models are compared with.
    fn plants(&self) -> &[PlantOffer];

    /// Returns plants that are not compared but can be built, as the reference of a plant that
    /// solves their model.
    fn bystanders(&self) -> &[PlantOffer] {
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

/// A plant and its integration methods.
#[derive(Clone, Debug)]
pub struct PlantOffer {
    /// Name and constraints.
    pub plant: PlantId,
    /// One-line description.
    pub about: String,
    /// Whether the leg segments have mass. A plant without segment masses is the limit model for
    /// vanishing masses.
    pub segment_masses: bool,
    /// The plant whose model this one solves by a different engine, if any. Both share one
    /// reference: an error that an engine makes alike at every step would not show against its own
    /// reference.
    pub model_of: Option<String>,
    /// Label of the plant with a similar model with whose errors those of this plant are compared,
    /// each against its own reference.
    pub peer: Option<String>,
    /// Integration methods.
    pub methods: Vec<MethodOffer>,
}

/// An integration method of a plant.
#[derive(Clone, Debug)]
pub struct MethodOffer {
    /// Name used in scenarios.
    pub name: String,
    /// One-line description.
    pub about: String,
    /// Quantity that sets the accuracy.
    pub set_by: SettingKind,
    /// Setting at which the method qualifies as a reference. The first method with such a setting
    /// is the reference, the second its check.
    pub reference: Option<MethodSetting>,
    /// Whether the steps are those of an engine alone, without energy balance, forces and checks:
    /// the method is measured for its error and run time only.
    pub step_only: bool,
    /// Whether forces come from a table, so that its spacing has an effect.
    pub tabulated: bool,
}

impl PlantOffer {
    /// Returns the methods that are complete plants.
    pub(crate) fn complete_methods(&self) -> impl Iterator<Item = &MethodOffer> + Clone {
        self.methods.iter().filter(|method| !method.step_only)
    }
}

/// Quantity that sets the accuracy of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingKind {
    /// Fixed step size.
    Step,
    /// Error tolerance of an adaptive step-size control.
    Tolerance,
}

/// Step size or tolerance of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MethodSetting {
    /// Fixed step size.
    Step(SimDuration),
    /// Error tolerance of an adaptive step-size control.
    Tolerance(f64),
}

impl MethodSetting {
    /// Returns the step size, if it is one \[s\].
    pub fn step_s(self) -> Option<f64> {
        match self {
            Self::Step(step) => Some(step.as_nanos() as f64 / 1e9),
            Self::Tolerance(_) => None,
        }
    }

    /// Returns the tolerance, if it is one.
    pub fn tolerance(self) -> Option<f64> {
        match self {
            Self::Step(_) => None,
            Self::Tolerance(tolerance) => Some(tolerance),
        }
    }

    /// Returns the quantity that sets the accuracy.
    pub fn set_by(self) -> SettingKind {
        match self {
            Self::Step(_) => SettingKind::Step,
            Self::Tolerance(_) => SettingKind::Tolerance,
        }
    }

    /// Returns a coarser setting, sufficient where errors of a millimetre matter and errors of a
    /// nanometre do not.
    #[must_use]
    pub fn relaxed(self) -> Self {
        match self {
            Self::Step(step) => Self::Step(step * 8),
            Self::Tolerance(tolerance) => Self::Tolerance(tolerance / 1e-3),
        }
    }

    /// Returns a clearly finer setting.
    #[must_use]
    pub(crate) fn finer(self) -> Self {
        match self {
            Self::Step(step) => Self::Step(SimDuration::from_nanos((step.as_nanos() / 2).max(1))),
            Self::Tolerance(tolerance) => Self::Tolerance(tolerance / 10.0),
        }
    }

    /// Returns a clearly coarser setting, for a method that is its own check.
    #[must_use]
    pub fn coarser(self) -> Self {
        match self {
            Self::Step(step) => Self::Step(step * 2),
            Self::Tolerance(tolerance) => Self::Tolerance(tolerance * 10.0),
        }
    }
}

/// A plant with its method, the setting, and the changes of robot and ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// Plant.
    pub plant: PlantId,
    /// Name of the method.
    pub method: String,
    /// Setting of the method.
    pub setting: MethodSetting,
    /// Changes of robot and ground.
    pub scales: Scales,
}

/// Changes of robot and ground: factors of the robot's values, and absolute values for the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scales {
    /// Factor of all leg springs.
    pub stiffness: f64,
    /// Factor of the masses of the leg segments, feet excepted.
    pub mass: f64,
    /// Factor of the viscous friction of the joints.
    pub damping: f64,
    /// Factor of the gain of the servos' position loop.
    pub gain: f64,
    /// Factor of the stiffness of compliant stops, cables and soles.
    pub compliance: f64,
    /// Factor of the damping of compliant stops, cables and soles.
    pub compliance_damping: f64,
    /// Coefficient of Coulomb friction of the ground; `None`: as in the scenario.
    pub friction: Option<f64>,
    /// Coefficient of restitution of the ground; `None`: as in the scenario.
    pub restitution: Option<f64>,
    /// Longest step of a method with error control \[s\]; `None`: the default of the plant.
    pub longest_step_s: Option<f64>,
    /// Cells along each axis of a table of forces; `None`: as in the scenario.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<f64>,
    /// Factor of the speed at which the commands are played.
    pub speed: f64,
    /// The lumped foot mass of a leg without segment masses is the foot's own mass: the limit for
    /// vanishing segments.
    #[serde(skip)]
    pub bare_foot: bool,
}

impl Scales {
    /// No change.
    pub const AS_IS: Self = Self {
        stiffness: 1.0,
        mass: 1.0,
        damping: 1.0,
        gain: 1.0,
        compliance: 1.0,
        compliance_damping: 1.0,
        friction: None,
        restitution: None,
        longest_step_s: None,
        cells: None,
        speed: 1.0,
        bare_foot: false,
    };
}

impl Scales {
    /// Returns whether plants without compliant constraints are not run with these changes.
    pub(crate) fn only_compliant(&self) -> bool {
        let unchanged = Self {
            stiffness: self.stiffness,
            mass: self.mass,
            damping: self.damping,
            gain: self.gain,
            friction: self.friction,
            restitution: self.restitution,
            cells: self.cells,
            bare_foot: self.bare_foot,
            ..Self::AS_IS
        };
        *self != unchanged
    }
}

impl Default for Scales {
    fn default() -> Self {
        Self::AS_IS
    }
}
