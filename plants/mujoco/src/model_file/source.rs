//! What a signal is of a model: where its numbers are, how many, in which unit.

use std::ops::Range;

use mujoco_rs::prelude::{MjData, MjModel, MjtJoint};
use nalgebra::Matrix3;
use twinrig_kernel::Unit;

use crate::model_file::contact::Mean;
use crate::model_file::error::{Place, SignalError};
use crate::model_file::signals::{ElementKind, Output};
use crate::model_file::unit;

/// Where the numbers of a signal come from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    Qpos(Range<usize>),
    Qvel(Range<usize>),
    Qacc(Range<usize>),
    /// Of actuators on a joint.
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
    /// World velocity of the point that `Position` is of.
    LinearVelocity(ElementKind, usize),
    /// In the thing's own axes.
    AngularVelocity(ElementKind, usize),
    /// The mean, over the window of observation, of what comes so.
    Mean(Mean),
}

/// What a signal is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SignalSource {
    pub(crate) source: Source,
    pub(crate) size: usize,
    /// None where the model leaves it open.
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
    /// What the output `wish` is.
    pub(crate) fn of(model: &MjModel, wish: &Output) -> Result<Self, (Place, SignalError)> {
        let id = found(model, wish.thing, &wish.name)?;
        let last = wish.signal.rsplit('/').next().unwrap_or_default();
        let word = wish.word.as_deref().unwrap_or(last);
        let (meaning, what, known) = match wish.thing {
            ElementKind::Joint if model.jnt_type()[id] == MjtJoint::mjJNT_FREE => {
                (None, "free joint (its body has it all)", OF_FREE)
            }
            ElementKind::Joint => (of_joint(model, id, word), "joint", OF_JOINT),
            ElementKind::Actuator => (of_actuator(model, id, word), "actuator", OF_ACTUATOR),
            ElementKind::Body => (
                of_placed(model, ElementKind::Body, id, word),
                "body",
                OF_BODY,
            ),
            ElementKind::Site => (
                of_placed(model, ElementKind::Site, id, word),
                "site",
                OF_SITE,
            ),
            ElementKind::Geom => (
                of_placed(model, ElementKind::Geom, id, word),
                "geom",
                OF_GEOM,
            ),
            ElementKind::Sensor => (Some(of_sensor(model, id, word)), "sensor", OF_FREE),
        };
        meaning.ok_or_else(|| {
            let word = word.to_owned();
            let place = match wish.word {
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

/// The number of the thing called `name`.
pub(crate) fn found(
    model: &MjModel,
    thing: ElementKind,
    name: &str,
) -> Result<usize, (Place, SignalError)> {
    thing.find(model, name).ok_or_else(|| {
        let known = thing.named(model).map(|(_, known)| known.to_owned());
        let mut others = ElementKind::ALL.into_iter();
        let unknown = SignalError::Unknown {
            thing,
            name: name.to_owned(),
            known: known.collect(),
            other: others.find(|other| other.find(model, name).is_some()),
        };
        (Place::ElementKind, unknown)
    })
}

/// `length` numbers from an address of MuJoCo's.
pub(crate) fn range(start: i32, length: usize) -> Range<usize> {
    let start = usize::try_from(start).unwrap_or(0);
    start..start + length
}

fn of_joint(model: &MjModel, joint: usize, word: &str) -> Option<SignalSource> {
    let along = unit::of_joint(model, joint)?;
    let ball = model.jnt_type()[joint] == MjtJoint::mjJNT_BALL;
    // A ball joint is where a quaternion says, and turns about three axes.
    let (places, dofs, place) = if ball {
        (4, 3, Unit::One)
    } else {
        (1, 1, along.place)
    };
    let moved = range(model.jnt_qposadr()[joint], places);
    let moving = range(model.jnt_dofadr()[joint], dofs);
    Some(match word {
        "position" => SignalSource::new(Source::Qpos(moved), places, place),
        "rate" | "velocity" => SignalSource::new(Source::Qvel(moving), dofs, along.rate),
        "acceleration" => SignalSource::new(Source::Qacc(moving), dofs, along.acceleration),
        "torque" | "force" => SignalSource::new(Source::JointForce(moving), dofs, along.force),
        _ => return None,
    })
}

fn of_actuator(model: &MjModel, actuator: usize, word: &str) -> Option<SignalSource> {
    let along = unit::of_actuator(model, actuator);
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
        "position" => SignalSource::new(Source::Length(out), outs, along.map(|along| along.place)),
        "rate" | "velocity" => {
            SignalSource::new(Source::Velocity(out), outs, along.map(|along| along.rate))
        }
        "torque" | "force" => {
            SignalSource::new(Source::Force(out), outs, along.map(|along| along.force))
        }
        _ => return None,
    })
}

fn of_placed(model: &MjModel, thing: ElementKind, id: usize, word: &str) -> Option<SignalSource> {
    Some(match (word, thing) {
        ("position", _) => SignalSource::new(Source::Position(thing, id), 3, Unit::Meter),
        ("orientation", ElementKind::Body) => {
            SignalSource::new(Source::Orientation(id), 4, Unit::One)
        }
        ("rpy", _) => SignalSource::new(Source::Rpy(thing, id), 3, Unit::Radian),
        ("velocity", _) => {
            SignalSource::new(Source::LinearVelocity(thing, id), 3, Unit::MeterPerSecond)
        }
        ("angular_velocity", _) => {
            SignalSource::new(Source::AngularVelocity(thing, id), 3, Unit::RadianPerSecond)
        }
        ("load", ElementKind::Body | ElementKind::Geom) => {
            let mean = Mean::Load(geoms(model, thing, id));
            SignalSource::new(Source::Mean(mean), 1, Unit::Newton)
        }
        ("force", ElementKind::Body | ElementKind::Geom) => {
            let mean = Mean::Force(geoms(model, thing, id));
            SignalSource::new(Source::Mean(mean), 3, Unit::Newton)
        }
        _ => return None,
    })
}

/// A sensor as it is, but `load` and `force`: those are means, like everywhere.
fn of_sensor(model: &MjModel, sensor: usize, word: &str) -> SignalSource {
    let size = usize::try_from(model.sensor_dim()[sensor]).unwrap_or(0);
    let numbers = range(model.sensor_adr()[sensor], size);
    let source = match word {
        "load" | "force" => Source::Mean(Mean::Sensor(numbers)),
        _ => Source::Sensor(numbers),
    };
    SignalSource::new(source, size, unit::of_sensor(model, sensor))
}

/// A geom itself, or all of a body.
fn geoms(model: &MjModel, thing: ElementKind, id: usize) -> Vec<i32> {
    let wanted = |geom: &usize| match thing {
        ElementKind::Body => usize::try_from(model.geom_bodyid()[*geom]) == Ok(id),
        _ => *geom == id,
    };
    let all = (0..model.geom_bodyid().len()).filter(wanted);
    all.filter_map(|geom| i32::try_from(geom).ok()).collect()
}

impl Source {
    /// Writes the numbers; the means come from elsewhere.
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
            Self::Position(thing, id) => out.copy_from_slice(&position(data, *thing, *id)),
            Self::Orientation(body) => out.copy_from_slice(&data.xquat()[*body]),
            Self::Rpy(thing, id) => out.copy_from_slice(&rpy(&turned(data, *thing, *id))),
            Self::LinearVelocity(thing, id) => {
                let velocity = data.object_velocity(thing.object(), *id, false);
                out.copy_from_slice(&velocity[3..]);
            }
            Self::AngularVelocity(thing, id) => {
                let velocity = data.object_velocity(thing.object(), *id, false);
                let [x, y, z] = [0, 1, 2].map(|axis| velocity[axis]);
                let own = turned(data, *thing, *id).tr_mul(&nalgebra::Vector3::new(x, y, z));
                out.copy_from_slice(own.as_slice());
            }
            Self::Mean(_) => {}
        }
    }
}

/// World position of a body's centre of mass, or of a site or geom \[m\].
pub(crate) fn position(data: &MjData<Box<MjModel>>, thing: ElementKind, id: usize) -> [f64; 3] {
    match thing {
        ElementKind::Site => data.site_xpos()[id],
        ElementKind::Geom => data.geom_xpos()[id],
        _ => data.xipos()[id],
    }
}

/// From the thing's axes to the world's; those of a body are its own, not those of its inertia.
fn turned(data: &MjData<Box<MjModel>>, thing: ElementKind, id: usize) -> Matrix3<f64> {
    let rows = match thing {
        ElementKind::Site => data.site_xmat()[id],
        ElementKind::Geom => data.geom_xmat()[id],
        _ => data.xmat()[id],
    };
    Matrix3::from_row_slice(&rows)
}

/// Angles of the rotation about z, then y, then x (yaw, pitch, roll), in the order roll, pitch, yaw.
fn rpy(rotation: &Matrix3<f64>) -> [f64; 3] {
    [
        libm::atan2(rotation[(2, 1)], rotation[(2, 2)]),
        libm::asin((-rotation[(2, 0)]).clamp(-1.0, 1.0)),
        libm::atan2(rotation[(1, 0)], rotation[(0, 0)]),
    ]
}
