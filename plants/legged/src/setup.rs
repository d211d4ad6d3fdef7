//! What to simulate of a robot, as far as it is the same for all plants.

use twinrig_actuator::{DcMotor, PositionServo};
use twinrig_contact::Ground;
use twinrig_kernel::SimDuration;
use twinrig_robot::{LegMount, Robot};

use crate::LEGS;
use crate::error::LeggedError;
use crate::start::Start;

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

/// What turns commands into motion at the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drives {
    /// Nothing: hips turn freely, and there is no cable.
    None,
    /// Servos without limits that lag by one control period.
    Ideal {
        /// The control period \[s\].
        period: f64,
    },
    /// These servos.
    Servos {
        /// At the hips.
        hip: twinrig_robot::Servo,
        /// At the knee cables.
        knee: twinrig_robot::Servo,
    },
    /// These motors, which are given a voltage: whoever gives it closes the loop.
    Motors {
        /// At the hips.
        hip: twinrig_robot::Motor,
        /// At the knee cables.
        knee: twinrig_robot::Motor,
    },
}

impl Drives {
    /// Inputs of a leg: a command for hip and knee each, or voltage and bridge for each.
    pub const fn inputs(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Ideal { .. } | Self::Servos { .. } => 2,
            Self::Motors { .. } => 4,
        }
    }
}

/// The servos of every leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servos {
    /// At the hips.
    pub hip: PositionServo,
    /// At the knee cables.
    pub knee: PositionServo,
}

impl Servos {
    /// Hip and knee, in the order of commands.
    pub fn both(&self) -> [&PositionServo; 2] {
        [&self.hip, &self.knee]
    }
}

/// The motors of every leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motors {
    /// At the hips.
    pub hip: DcMotor,
    /// At the knee cables.
    pub knee: DcMotor,
}

impl Motors {
    /// Hip and knee, in the order of inputs.
    pub fn both(&self) -> [&DcMotor; 2] {
        [&self.hip, &self.knee]
    }
}

/// What turns hips and pulleys, ready for use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fitted {
    /// Servos, which are given angles.
    Servos(Servos),
    /// Motors, which are given voltages.
    Motors(Motors),
}

impl Fitted {
    /// What hip and pulley carry around of their drives \[kg·m²\].
    pub fn inertias(&self) -> [f64; 2] {
        match self {
            Self::Servos(servos) => servos.both().map(PositionServo::inertia),
            Self::Motors(motors) => motors.both().map(DcMotor::inertia),
        }
    }
}

/// What to simulate of a robot. Plants add what is theirs alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// How the trunk may move.
    pub base: Base,
    /// The legs that are there.
    pub legs: Vec<String>,
    /// The ground; without one, no contact is looked for.
    pub ground: Option<Ground>,
    /// Greatest integration step.
    pub step: SimDuration,
    /// What turns commands into motion.
    pub drives: Drives,
    /// Where the legs are at the start.
    pub start: Start,
}

impl Setup {
    /// The robot's legs that are named, in the robot's order; and whether the step is one.
    ///
    /// # Errors
    /// [`LeggedError::NoSuchLeg`], [`LeggedError::Legs`], [`LeggedError::Step`].
    pub fn chosen<'r>(&self, robot: &'r Robot) -> Result<Vec<&'r LegMount>, LeggedError> {
        let names = &self.legs;
        for (i, name) in names.iter().enumerate() {
            if !robot.legs.iter().any(|mount| mount.name == *name) {
                let known = robot.legs.iter().map(|mount| mount.name.as_str());
                return Err(LeggedError::NoSuchLeg {
                    robot: robot.name.clone(),
                    leg: name.clone(),
                    known: known.collect::<Vec<_>>().join(", "),
                });
            }
            if names[..i].contains(name) {
                return Err(LeggedError::Legs(format!("leg {name} is named twice")));
            }
        }
        if names.len() > LEGS {
            return Err(LeggedError::Legs(format!(
                "{} legs are more than the {LEGS} there is room for",
                names.len()
            )));
        }
        if self.step == SimDuration::ZERO {
            return Err(LeggedError::Step);
        }
        let mounts = robot.legs.iter();
        Ok(mounts.filter(|mount| names.contains(&mount.name)).collect())
    }

    /// The drives, if there are any. Ideal ones have the inertia of the robot's servos.
    ///
    /// # Errors
    /// [`LeggedError::Servo`], [`LeggedError::Motor`].
    pub fn fitted(&self, robot: &Robot) -> Result<Option<Fitted>, LeggedError> {
        let of = |drive| move |why| LeggedError::Servo { drive, why };
        let (hip, knee) = match &self.drives {
            Drives::None => return Ok(None),
            Drives::Ideal { period } => (
                PositionServo::ideal(*period, robot.actuators.hip.inertia),
                PositionServo::ideal(*period, robot.actuators.knee.inertia),
            ),
            Drives::Servos { hip, knee } => (PositionServo::new(hip), PositionServo::new(knee)),
            Drives::Motors { hip, knee } => {
                let of = |drive| move |why| LeggedError::Motor { drive, why };
                return Ok(Some(Fitted::Motors(Motors {
                    hip: DcMotor::new(hip).map_err(of("hip"))?,
                    knee: DcMotor::new(knee).map_err(of("knee"))?,
                })));
            }
        };
        Ok(Some(Fitted::Servos(Servos {
            hip: hip.map_err(of("hip"))?,
            knee: knee.map_err(of("knee"))?,
        })))
    }
}
