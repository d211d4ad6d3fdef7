//! What to simulate of a robot, as far as it is the same for all plants.

use twinrig_actuator::PositionServo;
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

    /// The servos, if there are any. Ideal ones have the inertia of the robot's.
    ///
    /// # Errors
    /// [`LeggedError::Servo`].
    pub fn servos(&self, robot: &Robot) -> Result<Option<Servos>, LeggedError> {
        let of = |drive| move |why| LeggedError::Servo { drive, why };
        let (hip, knee) = match &self.drives {
            Drives::None => return Ok(None),
            Drives::Ideal { period } => (
                PositionServo::ideal(*period, robot.actuators.hip.inertia),
                PositionServo::ideal(*period, robot.actuators.knee.inertia),
            ),
            Drives::Servos { hip, knee } => (PositionServo::new(hip), PositionServo::new(knee)),
        };
        Ok(Some(Servos {
            hip: hip.map_err(of("hip"))?,
            knee: knee.map_err(of("knee"))?,
        }))
    }
}
