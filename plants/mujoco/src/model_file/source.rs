//! Sources of output signals: location, size and unit of their values.

use std::ops::Range;

use mujoco_rs::prelude::{MjData, MjModel, MjtJoint};
use nalgebra::Matrix3;
use twinrig_kernel::Unit;

use crate::model_file::contact::Mean;
use crate::model_file::error::{Place, SignalError};
use crate::model_file::signals::{ElementKind, Output};
use crate::model_file::unit;

/// Location of a signal's values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    Qpos(Range<usize>),
    Qvel(Range<usize>),
    Qacc(Range<usize>),
    /// Force of the actuators on a joint.
    JointForce(Range<usize>),
    Length(Range<usize>),
    Velocity(Range<usize>),
    Force(Range<usize>),
    Control(Range<usize>),
    Sensor(Range<usize>),
    /// World position of a body's centre of mass, or of a site or geom.
    Position(ElementKind, usize),
    /// Quaternion w, x, y, z from body to world.
    Orientation(usize),
    /// Roll, pitch and yaw.
    Rpy(ElementKind, usize),
    /// World velocity of the point of `Position`.
    LinearVelocity(ElementKind, usize),
    /// In the element's axes.
    AngularVelocity(ElementKind, usize),
    /// Mean over the observation window.
    Mean(Mean),
}

/// Source, size and unit of a signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SignalSource {
    pub(crate) source: Source,
    pub(crate) size: usize,
    /// None if the model does not define it.
    pub(crate) unit: Option<Unit>,
}

const OF_JOINT: &[&str] = &[
    "position",
    "rate",
    "velocity",
    "acceleration",
    "torque",
    "force",
];
const OF_FREE: &[&str] = &[];
const OF_ACTUATOR: &[&str] = &["command", "position", "rate", "velocity", "torque", "force"];
const OF_BODY: &[&str] = &[
    "position",
    "orientation",
    "rpy",
    "velocity",
    "angular_velocity",
    "load",
    "force",
];
const OF_GEOM: &[&str] = &[
    "position",
    "rpy",
    "velocity",
    "angular_velocity",
    "load",
    "force",
];
const OF_SITE: &[&str] = &["position", "rpy", "velocity", "angular_velocity"];

impl SignalSource {
    /// Returns the source of an output.
    pub(crate) fn of(model: &MjModel, output: &Output) -> Result<Self, (Place, SignalError)> {
        let id = find_element(model, output.thing, &output.name)?;
        let last = output.signal.rsplit('/').next().unwrap_or_default();
        let word = output.word.as_deref().unwrap_or(last);
        let (source, what, known) = match output.thing {
            ElementKind::Joint if model.jnt_type()[id] == MjtJoint::mjJNT_FREE => {
                (None, "free joint (use its body)", OF_FREE)
            }
            ElementKind::Joint => (of_joint(model, id, word), "joint", OF_JOINT),
            ElementKind::Actuator => (of_actuator(model, id, word), "actuator", OF_ACTUATOR),
            ElementKind::Body => (
                of_located(model, ElementKind::Body, id, word),
                "body",
                OF_BODY,
            ),
            ElementKind::Site => (
                of_located(model, ElementKind::Site, id, word),
                "site",
                OF_SITE,
            ),
            ElementKind::Geom => (
                of_located(model, ElementKind::Geom, id, word),
                "geom",
                OF_GEOM,
            ),
            ElementKind::Sensor => (Some(of_sensor(model, id, word)), "sensor", OF_FREE),
        };
        source.ok_or_else(|| {
            let word = word.to_owned();
            let place = match output.word {
                Some(_) => Place::Word,
                None => Place::Signal,
            };
            (place, SignalError::Word { what, word, known })
        })
    }

    fn new(source: Source, size: usize, unit: impl Into<Option<Unit>>) -> Self {
        let unit = unit.into();
        Self { source, size, unit }
    }
}

/// Returns the index of the element called `name`.
pub(crate) fn find_element(
    model: &MjModel,
    kind: ElementKind,
    name: &str,
) -> Result<usize, (Place, SignalError)> {
    kind.find(model, name).ok_or_else(|| {
        let known = kind.named(model).map(|(_, known)| known.to_owned());
        let mut others = ElementKind::ALL.into_iter();
        let unknown = SignalError::Unknown {
            thing: kind,
            name: name.to_owned(),
            known: known.collect(),
            other: others.find(|other| other.find(model, name).is_some()),
        };
        (Place::ElementKind, unknown)
    })
}

/// Returns the range of `length` values from an address of MuJoCo's.
pub(crate) fn range(start: i32, length: usize) -> Range<usize> {
    let start = usize::try_from(start).unwrap_or(0);
    start..start + length
}

fn of_joint(model: &MjModel, joint: usize, word: &str) -> Option<SignalSource> {
    let units = unit::of_joint(model, joint)?;
    let ball = model.jnt_type()[joint] == MjtJoint::mjJNT_BALL;
    // A ball joint has a quaternion as position and three degrees of freedom.
    let (size, dofs, position_unit) = if ball {
        (4, 3, Unit::One)
    } else {
        (1, 1, units.position)
    };
    let positions = range(model.jnt_qposadr()[joint], size);
    let velocities = range(model.jnt_dofadr()[joint], dofs);
    Some(match word {
        "position" => SignalSource::new(Source::Qpos(positions), size, position_unit),
        "rate" | "velocity" => SignalSource::new(Source::Qvel(velocities), dofs, units.rate),
        "acceleration" => SignalSource::new(Source::Qacc(velocities), dofs, units.acceleration),
        "torque" | "force" => SignalSource::new(Source::JointForce(velocities), dofs, units.force),
        _ => return None,
    })
}

fn of_actuator(model: &MjModel, actuator: usize, word: &str) -> Option<SignalSource> {
    let units = unit::of_actuator(model, actuator);
    let count = |numbers: &[i32]| usize::try_from(numbers[actuator]).unwrap_or(0);
    let outs = count(model.actuator_outnum());
    let out = range(model.actuator_outadr()[actuator], outs);
    Some(match word {
        "command" => {
            let controls = count(model.actuator_ctrlnum());
            let control = range(model.actuator_ctrladr()[actuator], controls);
            let unit = unit::of_control(model, actuator);
            SignalSource::new(Source::Control(control), controls, unit)
        }
        "position" => {
            SignalSource::new(Source::Length(out), outs, units.map(|units| units.position))
        }
        "rate" | "velocity" => {
            SignalSource::new(Source::Velocity(out), outs, units.map(|units| units.rate))
        }
        "torque" | "force" => {
            SignalSource::new(Source::Force(out), outs, units.map(|units| units.force))
        }
        _ => return None,
    })
}

fn of_located(model: &MjModel, kind: ElementKind, id: usize, word: &str) -> Option<SignalSource> {
    Some(match (word, kind) {
        ("position", _) => SignalSource::new(Source::Position(kind, id), 3, Unit::Meter),
        ("orientation", ElementKind::Body) => {
            SignalSource::new(Source::Orientation(id), 4, Unit::One)
        }
        ("rpy", _) => SignalSource::new(Source::Rpy(kind, id), 3, Unit::Radian),
        ("velocity", _) => {
            SignalSource::new(Source::LinearVelocity(kind, id), 3, Unit::MeterPerSecond)
        }
        ("angular_velocity", _) => {
            SignalSource::new(Source::AngularVelocity(kind, id), 3, Unit::RadianPerSecond)
        }
        ("load", ElementKind::Body | ElementKind::Geom) => {
            let mean = Mean::Load(geoms(model, kind, id));
            SignalSource::new(Source::Mean(mean), 1, Unit::Newton)
        }
        ("force", ElementKind::Body | ElementKind::Geom) => {
            let mean = Mean::Force(geoms(model, kind, id));
            SignalSource::new(Source::Mean(mean), 3, Unit::Newton)
        }
        _ => return None,
    })
}

/// Returns the present values of a sensor, but the mean for `load` and `force`, as for all
/// elements.
fn of_sensor(model: &MjModel, sensor: usize, word: &str) -> SignalSource {
    let size = usize::try_from(model.sensor_dim()[sensor]).unwrap_or(0);
    let numbers = range(model.sensor_adr()[sensor], size);
    let source = match word {
        "load" | "force" => Source::Mean(Mean::Sensor(numbers)),
        _ => Source::Sensor(numbers),
    };
    SignalSource::new(source, size, unit::of_sensor(model, sensor))
}

/// Returns a geom itself, or all geoms of a body.
fn geoms(model: &MjModel, kind: ElementKind, id: usize) -> Vec<i32> {
    let included = |geom: &usize| match kind {
        ElementKind::Body => usize::try_from(model.geom_bodyid()[*geom]) == Ok(id),
        _ => *geom == id,
    };
    let all = (0..model.geom_bodyid().len()).filter(included);
    all.filter_map(|geom| i32::try_from(geom).ok()).collect()
}

impl Source {
    /// Writes the values, except for means.
    pub(crate) fn write(&self, data: &MjData<Box<MjModel>>, out: &mut [f64]) {
        match self {
            Self::Qpos(range) => out.copy_from_slice(&data.qpos()[range.clone()]),
            Self::Qvel(range) => out.copy_from_slice(&data.qvel()[range.clone()]),
            Self::Qacc(range) => out.copy_from_slice(&data.qacc()[range.clone()]),
            Self::JointForce(range) => out.copy_from_slice(&data.qfrc_actuator()[range.clone()]),
            Self::Length(range) => out.copy_from_slice(&data.actuator_length()[range.clone()]),
            Self::Velocity(range) => {
                out.copy_from_slice(&data.actuator_velocity()[range.clone()]);
            }
            Self::Force(range) => out.copy_from_slice(&data.actuator_force()[range.clone()]),
            Self::Control(range) => out.copy_from_slice(&data.ctrl()[range.clone()]),
            Self::Sensor(range) => out.copy_from_slice(&data.sensordata()[range.clone()]),
            Self::Position(kind, id) => out.copy_from_slice(&position(data, *kind, *id)),
            Self::Orientation(body) => out.copy_from_slice(&data.xquat()[*body]),
            Self::Rpy(kind, id) => out.copy_from_slice(&rpy(&rotation_of(data, *kind, *id))),
            Self::LinearVelocity(kind, id) => {
                let velocity = data.object_velocity(kind.object(), *id, false);
                out.copy_from_slice(&velocity[3..]);
            }
            Self::AngularVelocity(kind, id) => {
                let velocity = data.object_velocity(kind.object(), *id, false);
                let [x, y, z] = [0, 1, 2].map(|axis| velocity[axis]);
                let angular_velocity =
                    rotation_of(data, *kind, *id).tr_mul(&nalgebra::Vector3::new(x, y, z));
                out.copy_from_slice(angular_velocity.as_slice());
            }
            Self::Mean(_) => {}
        }
    }
}

/// Returns the world position of a body's centre of mass, or of a site or geom \[m\].
pub(crate) fn position(data: &MjData<Box<MjModel>>, kind: ElementKind, id: usize) -> [f64; 3] {
    match kind {
        ElementKind::Site => data.site_xpos()[id],
        ElementKind::Geom => data.geom_xpos()[id],
        _ => data.xipos()[id],
    }
}

/// Returns the rotation from the element's axes to the world's; axes of a body are those of its
/// frame, not of its inertia.
fn rotation_of(data: &MjData<Box<MjModel>>, kind: ElementKind, id: usize) -> Matrix3<f64> {
    let rows = match kind {
        ElementKind::Site => data.site_xmat()[id],
        ElementKind::Geom => data.geom_xmat()[id],
        _ => data.xmat()[id],
    };
    Matrix3::from_row_slice(&rows)
}

/// Returns the angles of the rotation about z, then y, then x (yaw, pitch, roll), in the order
/// roll, pitch, yaw.
fn rpy(rotation: &Matrix3<f64>) -> [f64; 3] {
    [
        libm::atan2(rotation[(2, 1)], rotation[(2, 2)]),
        libm::asin((-rotation[(2, 0)]).clamp(-1.0, 1.0)),
        libm::atan2(rotation[(1, 0)], rotation[(0, 0)]),
    ]
}

/// Source of an output.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum OutputSource {
    Model(Source),
    /// With the index in [`signal::ENERGY`].
    Energy(usize),
}
