//! The constant part of the plant: masses, geometry, drives, and what of it is simulated.

use nalgebra::Vector3;
use twinrig_actuator::{PositionServo, ServoError};
use twinrig_contact::Ground;
use twinrig_leg::{EnergyTable, LegCommand, LegError, Pantograph, Stop};
pub(crate) use twinrig_robot::GRAVITY;
use twinrig_robot::{JointFriction, Robot};

use crate::state::LEGS;

/// How the trunk may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// Freely in space.
    Free,
    /// In the vertical plane of x: forwards, up and in pitch.
    Planar,
    /// Not at all.
    Fixed,
}

/// Where the force of a leg comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Force {
    /// The closed form.
    Solve,
    /// A bicubic energy table with this many cells along each axis.
    Lookup {
        /// Cells along each axis.
        cells: usize,
    },
}

/// What turns commands into motion at the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drives {
    /// Servos without limits that lag by one control period \[s\].
    Ideal {
        /// The control period.
        period: f64,
    },
    /// These servos.
    Servos {
        /// At the hips.
        hip: twinrig_robot::Servo,
        /// At the knee cables.
        knee: twinrig_robot::Servo,
    },
}

/// What to simulate of a robot, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// How the trunk may move.
    pub base: Base,
    /// The legs that are there.
    pub legs: Vec<String>,
    /// The ground; without one, no contact is looked for.
    pub ground: Option<Ground>,
    /// Greatest integration step.
    pub step: twinrig_kernel::SimDuration,
    /// What turns commands into motion.
    pub drives: Drives,
    /// Where the force of a leg comes from.
    pub force: Force,
    /// Where the drives are at the start, by leg: a controller's first commands, say. A leg not named stands upright at
    /// 0.9 of its greatest length.
    pub start: Vec<(String, LegCommand)>,
}

/// Why a plant cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MasslessError {
    /// The robot has no such leg.
    #[error("the robot {robot} has no leg {leg:?}; it has {known}")]
    NoSuchLeg {
        /// Name of the robot.
        robot: String,
        /// The leg asked for.
        leg: String,
        /// The legs it has.
        known: String,
    },
    /// Too many legs, or one of them twice.
    #[error("{0}")]
    Legs(String),
    /// A leg makes no pantograph, or cannot stand at the start height.
    #[error("leg {leg}: {why}")]
    Leg {
        /// Name of the leg.
        leg: String,
        /// What is wrong.
        why: LegError,
    },
    /// The start has no pose.
    #[error("the start cannot be taken: {0}")]
    Start(String),
    /// A leg would start beyond one of its stops.
    #[error(
        "leg {leg}: the start is {by:.6} m beyond the stop {stop:?}; choose a start height between the two"
    )]
    StartBeyondStop {
        /// Name of the leg.
        leg: String,
        /// The stop.
        stop: Stop,
        /// How far beyond \[m\].
        by: f64,
    },
    /// A servo makes no servo.
    #[error("{drive} servo: {why}")]
    Servo {
        /// `hip` or `knee`.
        drive: &'static str,
        /// What is wrong.
        why: ServoError,
    },
    /// A mass or a moment of inertia that has to be positive is not.
    #[error("the {what} is {value} (SI units); it has to be positive")]
    Mass {
        /// Which mass.
        what: String,
        /// Its value.
        value: f64,
    },
    /// The integration step is zero.
    #[error("the step has to be longer than zero")]
    Step,
}

/// One leg.
#[derive(Debug, Clone)]
pub(crate) struct LegModel {
    pub(crate) name: String,
    /// Hip joint in the trunk frame, seen from the centre of mass \[m\].
    pub(crate) hip: Vector3<f64>,
    pub(crate) pantograph: Pantograph,
    pub(crate) table: Option<EnergyTable>,
    /// Mass at the foot \[kg\].
    pub(crate) mass: f64,
    pub(crate) friction: JointFriction,
}

/// The constant part of the plant.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) base: Base,
    /// Mass of the trunk with the parts of the legs that move with it \[kg\].
    pub(crate) mass: f64,
    /// Principal moments of inertia of the same \[kg·m²\].
    pub(crate) inertia: Vector3<f64>,
    pub(crate) legs: Vec<LegModel>,
    pub(crate) hip: PositionServo,
    pub(crate) knee: PositionServo,
    pub(crate) ground: Option<Ground>,
    /// Mobility given to redundant constraints \[1/kg\].
    pub(crate) compliance: f64,
    /// Weight times leg length: the energy by which others are measured \[J\].
    pub(crate) energy_scale: f64,
}

impl Model {
    pub(crate) fn new(robot: &Robot, options: &Options) -> Result<Self, MasslessError> {
        let chosen = chosen_legs(robot, &options.legs)?;
        if options.step == twinrig_kernel::SimDuration::ZERO {
            return Err(MasslessError::Step);
        }
        // What a leg weighs beyond its lumped foot hangs at its hip and moves with the trunk.
        let hung: Vec<(f64, Vector3<f64>)> = chosen
            .iter()
            .map(|mount| {
                (
                    mount.leg.mass.total() - mount.leg.mass.lumped_foot,
                    Vector3::from(mount.hip),
                )
            })
            .collect();
        let mass = robot.trunk.mass + hung.iter().map(|(m, _)| m).sum::<f64>();
        positive("trunk", mass)?;
        // A trunk that does not move has no use for its centre of mass; its hips are where the file has them, whichever legs
        // are there.
        let centre = if options.base == Base::Fixed {
            Vector3::zeros()
        } else {
            hung.iter().map(|(m, r)| r * *m).sum::<Vector3<f64>>() / mass
        };
        let around = |m: f64, r: Vector3<f64>| {
            Vector3::new(
                r.y * r.y + r.z * r.z,
                r.x * r.x + r.z * r.z,
                r.x * r.x + r.y * r.y,
            ) * m
        };
        let mut inertia = Vector3::from(robot.trunk.inertia) + around(robot.trunk.mass, -centre);
        for (m, r) in &hung {
            inertia += around(*m, r - centre);
        }
        for (moment, axis) in inertia.iter().zip(["roll", "pitch", "yaw"]) {
            positive(&format!("trunk's moment of inertia in {axis}"), *moment)?;
        }
        let legs = chosen
            .iter()
            .map(|mount| LegModel::new(mount, Vector3::from(mount.hip) - centre, options.force))
            .collect::<Result<Vec<_>, _>>()?;
        let (hip, knee) = drives(robot, &options.drives)?;
        let lightest = legs
            .iter()
            .map(|leg| leg.mass)
            .fold(f64::INFINITY, f64::min);
        let total = mass + legs.iter().map(|leg| leg.mass).sum::<f64>();
        let reach = legs
            .iter()
            .map(|leg| leg.pantograph.length_max())
            .fold(0.0, f64::max);
        Ok(Self {
            base: options.base,
            energy_scale: total * GRAVITY * reach,
            mass,
            inertia,
            legs,
            hip,
            knee,
            ground: options.ground.clone(),
            // Nine digits below the mobility of a foot: invisible where constraints are independent, and enough to make
            // redundant ones share their load.
            compliance: 1e-9 / lightest.min(mass),
        })
    }
}

impl LegModel {
    fn new(
        mount: &twinrig_robot::LegMount,
        hip: Vector3<f64>,
        force: Force,
    ) -> Result<Self, MasslessError> {
        let wrong = |why| MasslessError::Leg {
            leg: mount.name.clone(),
            why,
        };
        let mass = mount.leg.mass.lumped_foot;
        positive(&format!("lumped foot of leg {}", mount.name), mass)?;
        let pantograph = Pantograph::new(&mount.leg).map_err(wrong)?;
        let table = match force {
            Force::Solve => None,
            Force::Lookup { cells } => Some(EnergyTable::new(&pantograph, cells).map_err(wrong)?),
        };
        Ok(Self {
            name: mount.name.clone(),
            hip,
            pantograph,
            table,
            mass,
            friction: mount.leg.joint_friction,
        })
    }
}

fn positive(what: &str, value: f64) -> Result<(), MasslessError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(MasslessError::Mass {
            what: what.to_owned(),
            value,
        })
    }
}

/// The robot's legs that are named, in the robot's order.
pub(crate) fn chosen_legs<'a>(
    robot: &'a Robot,
    names: &[String],
) -> Result<Vec<&'a twinrig_robot::LegMount>, MasslessError> {
    for (i, name) in names.iter().enumerate() {
        if !robot.legs.iter().any(|mount| mount.name == *name) {
            let known = robot
                .legs
                .iter()
                .map(|mount| mount.name.as_str())
                .collect::<Vec<_>>()
                .join(", ");
            return Err(MasslessError::NoSuchLeg {
                robot: robot.name.clone(),
                leg: name.clone(),
                known,
            });
        }
        if names[..i].contains(name) {
            return Err(MasslessError::Legs(format!("leg {name} is named twice")));
        }
    }
    if names.len() > LEGS {
        return Err(MasslessError::Legs(format!(
            "{} legs are more than the {LEGS} there is room for",
            names.len()
        )));
    }
    Ok(robot
        .legs
        .iter()
        .filter(|mount| names.contains(&mount.name))
        .collect())
}

fn drives(robot: &Robot, drives: &Drives) -> Result<(PositionServo, PositionServo), MasslessError> {
    let hip = |why| MasslessError::Servo { drive: "hip", why };
    let knee = |why| MasslessError::Servo { drive: "knee", why };
    match drives {
        Drives::Ideal { period } => Ok((
            PositionServo::ideal(*period, robot.actuators.hip.inertia).map_err(hip)?,
            PositionServo::ideal(*period, robot.actuators.knee.inertia).map_err(knee)?,
        )),
        Drives::Servos { hip: h, knee: k } => Ok((
            PositionServo::new(h).map_err(hip)?,
            PositionServo::new(k).map_err(knee)?,
        )),
    }
}
