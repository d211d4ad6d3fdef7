//! Declarations of the signals of a model.

use std::fmt;

use mujoco_rs::prelude::{MjModel, MjtObjBase};
use twinrig_kernel::Unit;

/// Signals of a model.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ModelSignals {
    /// Initial keyframe; none: the reference pose.
    pub keyframe: Option<String>,
    /// Signals that control actuators.
    pub inputs: Vec<Input>,
    /// Measured signals.
    pub outputs: Vec<Output>,
}

/// A signal that controls an actuator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// The signal.
    pub signal: String,
    /// The actuator.
    pub actuator: String,
    /// Its unit; none: that of the model, or a plain number if the model does not define one.
    pub unit: Option<Unit>,
}

/// A signal that measures a quantity of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// The signal.
    pub signal: String,
    /// Kind of the element.
    pub thing: ElementKind,
    /// Name of the element.
    pub name: String,
    /// Measured quantity; none: the last part of the signal's name.
    pub word: Option<String>,
    /// Its unit; none: that of the model, or a plain number if the model does not define one.
    pub unit: Option<Unit>,
}

/// Kind of a named element of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementKind {
    /// A joint.
    Joint,
    /// An actuator.
    Actuator,
    /// A body.
    Body,
    /// A site.
    Site,
    /// A geom.
    Geom,
    /// A sensor.
    Sensor,
}

impl ElementKind {
    /// All kinds.
    pub const ALL: [Self; 6] = [
        Self::Joint,
        Self::Actuator,
        Self::Body,
        Self::Site,
        Self::Geom,
        Self::Sensor,
    ];

    /// Returns the name of the kind.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Actuator => "actuator",
            Self::Body => "body",
            Self::Site => "site",
            Self::Geom => "geom",
            Self::Sensor => "sensor",
        }
    }

    pub(crate) const fn object(self) -> MjtObjBase {
        match self {
            Self::Joint => MjtObjBase::mjOBJ_JOINT,
            Self::Actuator => MjtObjBase::mjOBJ_ACTUATOR,
            Self::Body => MjtObjBase::mjOBJ_BODY,
            Self::Site => MjtObjBase::mjOBJ_SITE,
            Self::Geom => MjtObjBase::mjOBJ_GEOM,
            Self::Sensor => MjtObjBase::mjOBJ_SENSOR,
        }
    }

    /// Returns the number of elements of this kind in a model.
    pub(crate) fn count(self, model: &MjModel) -> usize {
        match self {
            Self::Joint => model.jnt_type().len(),
            Self::Actuator => model.actuator_trntype().len(),
            Self::Body => model.body_rootid().len(),
            Self::Site => model.site_bodyid().len(),
            Self::Geom => model.geom_bodyid().len(),
            Self::Sensor => model.sensor_type().len(),
        }
    }

    /// Returns the named elements with their indices.
    pub(crate) fn named(self, model: &MjModel) -> impl Iterator<Item = (usize, &str)> {
        let all = 0..self.count(model);
        all.filter_map(move |id| {
            let name = model.id_to_name(self.object(), id)?;
            (!name.is_empty()).then_some((id, name))
        })
    }

    /// Returns the index of the element of that name.
    pub(crate) fn find(self, model: &MjModel, name: &str) -> Option<usize> {
        let mut named = self.named(model);
        named.find(|(_, known)| *known == name).map(|(id, _)| id)
    }
}

impl fmt::Display for ElementKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
