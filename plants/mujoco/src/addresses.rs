//! Addresses of the robot's coordinates and elements in MuJoCo's arrays.

use mujoco_rs::prelude::{MjModel, MjtObjBase};
use twinrig_legged::Base;

use crate::engine::EngineError;
use crate::inputs::{DRIVE_NAMES, DRIVES};
use crate::model::Model;
use crate::options::Coordinates;

/// Address of a joint: its first index among the positions, and among the velocities.
pub(crate) type Address = [usize; 2];

/// Addresses of a robot.
#[derive(Debug, Clone)]
pub(crate) struct Addresses {
    /// First joint of the trunk, if it has joints.
    pub(crate) trunk: Address,
    /// Body of the trunk.
    pub(crate) trunk_body: usize,
    pub(crate) legs: Vec<LegAddresses>,
    /// Contact points of trunk, knees and ankles, if they have contact.
    pub(crate) body: Vec<BodyPoint>,
}

/// Place of a contact point.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Place {
    /// Lower end of the first or the second segment of a leg.
    Joint { leg: usize, segment: usize },
    /// Corner of the trunk, trunk axes \[m\].
    Corner([f64; 3]),
}

/// Contact point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BodyPoint {
    /// Its geom.
    pub(crate) geom: usize,
    pub(crate) place: Place,
}

/// Clutch of a servo.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clutch {
    /// Joint of its flywheel.
    pub(crate) flywheel: Address,
    pub(crate) tendon: usize,
}

/// Addresses of a leg.
#[derive(Debug, Clone)]
pub(crate) struct LegAddresses {
    /// Of each segment: x, z and turn in maximal coordinates; the hinge, three times, in minimal
    /// ones.
    pub(crate) segments: [[Address; 3]; 3],
    /// Joint of abduction.
    pub(crate) abduction: Option<Address>,
    pub(crate) pulley: Option<Address>,
    /// Clutches of the servos of hip, knee and abduction.
    pub(crate) clutches: [Option<Clutch>; DRIVES],
    /// Actuators of the same drives: motors, or servos as position actuators.
    pub(crate) actuators: [Option<usize>; DRIVES],
    /// Geom of the foot.
    pub(crate) foot: Option<usize>,
    /// Body at whose end the foot is.
    pub(crate) foot_body: usize,
}

impl Addresses {
    pub(crate) fn new(model: &Model, compiled: &MjModel) -> Result<Self, EngineError> {
        let trunk = match model.base {
            Base::Free => joint(compiled, "trunk")?,
            Base::Planar => joint(compiled, "trunk_x")?,
            Base::Fixed => [0; 2],
        };
        let legs = model.legs.iter().map(|leg| {
            let name = &leg.name;
            let named = |joint_name: &str| joint(compiled, &format!("{name}_{joint_name}"));
            let segments = match model.coordinates {
                Coordinates::Minimal => [
                    [named("hip")?; 3],
                    [named("knee")?; 3],
                    [named("ankle")?; 3],
                ],
                Coordinates::Maximal => {
                    let of = |segment: &str| -> Result<[Address; 3], EngineError> {
                        let one = |axis: &str| named(&format!("{segment}_{axis}"));
                        Ok([one("x")?, one("z")?, one("turn")?])
                    };
                    [of("upper")?, of("middle")?, of("lower")?]
                }
            };
            let motors = model.motors();
            let (mut clutches, mut actuators) = ([None; DRIVES], [None; DRIVES]);
            for (drive, drive_name) in DRIVE_NAMES.into_iter().enumerate() {
                let of_drive =
                    |kind, suffix| find(compiled, kind, &format!("{name}_{drive_name}{suffix}"));
                let is_servo = model.servos[drive].is_some();
                let is_motor = motors[drive].is_some();
                if is_servo && !model.position_actuators {
                    clutches[drive] = Some(Clutch {
                        flywheel: named(&format!("{drive_name}_flywheel"))?,
                        tendon: of_drive(MjtObjBase::mjOBJ_TENDON, "_clutch")?,
                    });
                } else if is_servo || is_motor {
                    actuators[drive] = Some(of_drive(MjtObjBase::mjOBJ_ACTUATOR, "")?);
                }
            }
            let foot = || find(compiled, MjtObjBase::mjOBJ_GEOM, &format!("{name}_foot"));
            Ok(LegAddresses {
                segments,
                abduction: leg.abduction.map(|_| named("abduction")).transpose()?,
                pulley: model.drives.map(|_| named("pulley")).transpose()?,
                clutches,
                actuators,
                foot: model.ground.as_ref().map(|_| foot()).transpose()?,
                foot_body: find(compiled, MjtObjBase::mjOBJ_BODY, &format!("{name}_lower"))?,
            })
        });
        Ok(Self {
            trunk,
            trunk_body: find(compiled, MjtObjBase::mjOBJ_BODY, "trunk")?,
            legs: legs.collect::<Result<_, EngineError>>()?,
            body: body(model, compiled)?,
        })
    }
}

/// Returns the contact points of trunk, knees and ankles.
fn body(model: &Model, compiled: &MjModel) -> Result<Vec<BodyPoint>, EngineError> {
    let point = |name: &str, place| {
        let geom = find(compiled, MjtObjBase::mjOBJ_GEOM, name)?;
        Ok(BodyPoint { geom, place })
    };
    let mut points = Vec::new();
    for (index, corner) in model.corners.iter().enumerate() {
        points.push(point(&corner_name(index), Place::Corner(*corner))?);
    }
    for (leg, leg_model) in model.legs.iter().enumerate() {
        for (segment, joint) in ["knee", "ankle"].into_iter().enumerate() {
            if leg_model.has_segment_contact {
                let name = format!("{}_{joint}", leg_model.name);
                points.push(point(&name, Place::Joint { leg, segment })?);
            }
        }
    }
    Ok(points)
}

/// Returns the name of the geom of a corner of the trunk.
pub(crate) fn corner_name(index: usize) -> String {
    format!("corner_{}", index + 1)
}

fn find(compiled: &MjModel, kind: MjtObjBase, name: &str) -> Result<usize, EngineError> {
    let id = compiled.name_to_id(kind, name);
    id.ok_or_else(|| EngineError::Model(format!("it has no element {name}")))
}

fn joint(compiled: &MjModel, name: &str) -> Result<Address, EngineError> {
    let id = find(compiled, MjtObjBase::mjOBJ_JOINT, name)?;
    let address = |all: &[i32]| usize::try_from(all[id]).unwrap_or(0);
    Ok([
        address(compiled.jnt_qposadr()),
        address(compiled.jnt_dofadr()),
    ])
}
