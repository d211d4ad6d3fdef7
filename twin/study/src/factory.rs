//! What a study is told, and what it asks for.

use serde::Serialize;
use twinrig_kernel::SimDuration;
use twinrig_runtime::Plant;

use crate::commands::Commands;

/// Builds the variants of one scene. Whoever knows the plants implements it; a study knows none.
pub trait PlantFactory {
    /// The scene.
    fn scene(&self) -> &Scene;

    /// The plants to compare. The first whose segments have mass is the model that others are measured against.
    fn plants(&self) -> &[PlantOffer];

    /// Plants that are not compared, but can be built: one of these is the reference of a plant that solves its model.
    fn bystanders(&self) -> &[PlantOffer] {
        &[]
    }

    /// The plants that were not asked for and cannot be in the scene, each with the reason.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// Builds a plant at the start of the scene. Its outputs are `leg/*/foot/position` and `body/position` \[m\].
    ///
    /// # Errors
    /// Why there is none, for a person: it becomes a row of the study.
    fn build(&self, variant: &Variant) -> Result<Box<dyn Plant>, String>;

    /// The same, telling of its drives, too, if it has any: `leg/*/{hip,knee}/position` \[rad\], and `torque` \[N·m\] as the mean
    /// over its last step.
    ///
    /// # Errors
    /// As above.
    fn build_with_drives(&self, variant: &Variant) -> Result<Box<dyn Plant>, String> {
        self.build(variant)
    }
}

/// What is simulated, whichever plant does it.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the scenario calls itself.
    pub name: String,
    /// Its file.
    pub file: String,
    /// How long it lasts.
    pub duration: SimDuration,
    /// The feet can touch ground, so friction and restitution matter.
    pub ground: bool,
    /// The legs are driven by servos, so the gain of their position loop matters.
    pub servos: bool,
    /// What the plants are commanded.
    pub commands: Commands,
    /// The step of the plant that the scenario has.
    pub step: SimDuration,
    /// Weight of the robot, legs and all \[N\].
    pub weight: f64,
}

/// A plant, and the ways to integrate it.
#[derive(Clone, Debug)]
pub struct PlantOffer {
    /// Name, as scenarios have it.
    pub name: String,
    /// A line on it.
    pub about: String,
    /// Whether the segments of its legs have mass. Of one without, the limit of vanishing segments is the same model.
    pub segment_masses: bool,
    /// The plant whose model it solves by other means, if there is one: what that one is measured against is its reference, too,
    /// since what an engine does alike at every step shows against no reference of its own.
    pub model_of: Option<String>,
    /// Its methods.
    pub methods: Vec<MethodOffer>,
}

/// A way to integrate a plant.
#[derive(Clone, Debug)]
pub struct MethodOffer {
    /// Name, as scenarios have it.
    pub name: String,
    /// A line on it.
    pub about: String,
    /// What it is set by.
    pub set_by: SetBy,
    /// The setting at which it is trusted as a reference; the first method that has one is the reference and the second its
    /// check.
    pub reference: Option<MethodSetting>,
}

/// What the accuracy of a method is set by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetBy {
    /// The length of its steps.
    Step,
    /// A tolerance, by which it chooses its steps itself.
    Tolerance,
}

/// A setting of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MethodSetting {
    /// Steps of this length.
    Step(SimDuration),
    /// Steps as long as this tolerance allows.
    Tolerance(f64),
}

impl MethodSetting {
    /// The step \[s\], if it is one.
    pub fn step_s(self) -> Option<f64> {
        match self {
            Self::Step(step) => Some(step.as_nanos() as f64 / 1e9),
            Self::Tolerance(_) => None,
        }
    }

    /// The tolerance, if it is one.
    pub fn tolerance(self) -> Option<f64> {
        match self {
            Self::Step(_) => None,
            Self::Tolerance(tolerance) => Some(tolerance),
        }
    }

    /// What it is set by.
    pub fn set_by(self) -> SetBy {
        match self {
            Self::Step(_) => SetBy::Step,
            Self::Tolerance(_) => SetBy::Tolerance,
        }
    }

    /// A setting that is still good where an error of a millimetre matters and one of a nanometre does not.
    #[must_use]
    pub(crate) fn relaxed(self) -> Self {
        match self {
            Self::Step(step) => Self::Step(step * 8),
            Self::Tolerance(tolerance) => Self::Tolerance(tolerance * 1e3),
        }
    }

    /// A setting that is clearly coarser: for a method that has to be its own check.
    #[must_use]
    pub fn coarser(self) -> Self {
        match self {
            Self::Step(step) => Self::Step(step * 2),
            Self::Tolerance(tolerance) => Self::Tolerance(tolerance * 10.0),
        }
    }
}

/// A plant with its method, its setting, and what is changed of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// Name of the plant.
    pub plant: String,
    /// Name of its method.
    pub method: String,
    /// How the method is set.
    pub setting: MethodSetting,
    /// What is changed of robot and scene.
    pub scales: Scales,
}

/// What is changed of robot and scene: factors, and values where a factor says nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scales {
    /// Of all springs of the legs.
    pub stiffness: f64,
    /// Of the masses of the legs' segments, their feet excepted.
    pub mass: f64,
    /// Of the viscous friction of the joints.
    pub damping: f64,
    /// Of the gain of the servos' position loop.
    pub gain: f64,
    /// Coulomb's coefficient of the ground; none: the scene's.
    pub friction: Option<f64>,
    /// Coefficient of restitution of the ground; none: the scene's.
    pub restitution: Option<f64>,
    /// A leg without mass carries no more in its foot than that foot's own mass: what segments tend to as they vanish.
    #[serde(skip)]
    pub bare_foot: bool,
}

impl Scales {
    /// The scene as it is.
    pub const AS_IS: Self = Self {
        stiffness: 1.0,
        mass: 1.0,
        damping: 1.0,
        gain: 1.0,
        friction: None,
        restitution: None,
        bare_foot: false,
    };
}

impl Default for Scales {
    fn default() -> Self {
        Self::AS_IS
    }
}
