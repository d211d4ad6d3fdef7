//! Plants and methods on offer to studies, and the settings and changes of a run.

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimDuration;

use crate::plant_id::PlantId;

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
    pub fn complete_methods(&self) -> impl Iterator<Item = &MethodOffer> + Clone {
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    pub fn finer(self) -> Self {
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    pub fn only_compliant(&self) -> bool {
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
