//! Simulation setup common to all plants of a robot.

use twinrig_actuator::{DcMotor, LegMotor, PositionServo, SetPoint};
use twinrig_contact::Ground;
use twinrig_kernel::SimDuration;
use twinrig_robot::serial::SerialServo;
use twinrig_robot::{Compliance, Contact, LegMount, Robot};

use crate::LEGS;
use crate::error::LeggedError;
use crate::start::Start;

/// Degrees of freedom of the trunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// Six degrees of freedom.
    Free,
    /// Motion in the vertical plane of x: forwards, up and in pitch.
    Planar,
    /// Fixed in the world.
    Fixed,
}

/// Drives of the joints.
#[derive(Debug, Clone, PartialEq)]
pub enum Drives {
    /// No drives: hips rotate freely, and there is no cable.
    None,
    /// Servos without limits, which lag by one control period.
    Ideal {
        /// The control period \[s\].
        period: f64,
    },
    /// Servos with these parameters.
    Servos {
        /// Hip drives.
        hip: twinrig_robot::Servo,
        /// Knee cable drives.
        knee: twinrig_robot::Servo,
    },
    /// Motors with these parameters, with voltages as inputs: the controller closes the loop.
    Motors {
        /// Hip drives.
        hip: twinrig_robot::Motor,
        /// Knee cable drives.
        knee: twinrig_robot::Motor,
    },
    /// Serial servos with these parameters: their firmware closes the loop.
    Serial {
        /// Servo of each joint.
        servo: Box<SerialServo>,
        /// Place of the firmware.
        firmware: FirmwarePlace,
    },
}

/// Place of the firmware of serial servos.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirmwarePlace {
    /// In the plant, whose inputs are the commands of the joints.
    Plant,
    /// In servos on an emulated bus, which command the bridges: inputs are duty cycles, −1 to 1,
    /// and whether the bridge is closed, 1 or 0.
    Bus,
}

impl Drives {
    /// Returns whether the drives are motors, also those of serial servos.
    pub const fn have_motors(&self) -> bool {
        matches!(self, Self::Motors { .. } | Self::Serial { .. })
    }

    /// Returns the number of inputs of a leg in its dynamics: a command for each of hip and knee,
    /// or two for each motor.
    pub const fn inputs(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Ideal { .. } | Self::Servos { .. } => 2,
            Self::Motors { .. } | Self::Serial { .. } => 4,
        }
    }
}

/// Joints of hip abduction.
#[derive(Debug, Clone, PartialEq)]
pub enum Abduction {
    /// Locked at zero: legs move in planes along the trunk.
    Locked,
    /// Joints without drives.
    Passive,
    /// Joints with servos without limits, which lag by one control period.
    Ideal {
        /// The control period \[s\].
        period: f64,
    },
    /// Joints with servos of these parameters.
    Servos(twinrig_robot::Servo),
    /// Joints with serial servos, those of [`Drives::Serial`].
    Serial,
}

impl Abduction {
    /// Returns whether the joints have servos.
    pub const fn is_driven(&self) -> bool {
        matches!(self, Self::Ideal { .. } | Self::Servos(_) | Self::Serial)
    }
}

/// Parts of the robot that have contact with the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contacts {
    /// The feet.
    Feet,
    /// The feet, and the corners of the trunk's box.
    Trunk,
    /// The feet, the corners of the trunk's box, knees and ankles.
    All,
}

/// Servos of each leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servos {
    /// Hip drives.
    pub hip: PositionServo,
    /// Knee cable drives.
    pub knee: PositionServo,
}

impl Servos {
    /// Returns the servos of hip and knee, in the order of the commands.
    pub fn both(&self) -> [&PositionServo; 2] {
        [&self.hip, &self.knee]
    }
}

/// Motors of each leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motors {
    /// Hip drives.
    pub hip: LegMotor,
    /// Knee cable drives.
    pub knee: LegMotor,
    /// Drives of abduction, where these are motors, too. Their inputs follow those of all legs.
    pub abduction: Option<LegMotor>,
}

impl Motors {
    /// Returns the motors of hip and knee, in the order of their inputs.
    pub fn both(&self) -> [&LegMotor; 2] {
        [&self.hip, &self.knee]
    }

    /// Returns the motors of hip, knee and abduction, if the last has one.
    pub fn each(&self) -> [Option<&LegMotor>; 3] {
        [Some(&self.hip), Some(&self.knee), self.abduction.as_ref()]
    }
}

/// Validated drives of hips and pulleys.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveModels {
    /// Servos, with angles as inputs.
    Servos(Servos),
    /// Motors, with voltages or torque–rate lines as inputs.
    Motors(Motors),
}

impl DriveModels {
    /// Returns the number of inputs of a leg.
    pub const fn inputs(&self) -> usize {
        match self {
            Self::Servos(_) => 2,
            Self::Motors(_) => 4,
        }
    }

    /// Returns the motors of abduction, if there are any.
    pub const fn abduction(&self) -> Option<&LegMotor> {
        match self {
            Self::Servos(_) => None,
            Self::Motors(motors) => motors.abduction.as_ref(),
        }
    }

    /// Returns the inertias of the drives about hip and pulley \[kg·m²\].
    pub fn inertias(&self) -> [f64; 2] {
        match self {
            Self::Servos(servos) => servos.both().map(PositionServo::inertia),
            Self::Motors(motors) => motors.both().map(LegMotor::inertia),
        }
    }
}

/// Selection of what to simulate of a robot. Plants add their specific options.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Degrees of freedom of the trunk.
    pub base: Base,
    /// Names of the simulated legs.
    pub legs: Vec<String>,
    /// Ground; `None` disables contact.
    pub ground: Option<Ground>,
    /// Maximum integration step.
    pub step: SimDuration,
    /// Drives of the joints.
    pub drives: Drives,
    /// Joints of hip abduction.
    pub abduction: Abduction,
    /// Parts that have contact with the ground.
    pub contacts: Contacts,
    /// Course of the set-points of servos between commands; without effect on motors.
    pub set_point: SetPoint,
    /// Initial state of the legs.
    pub start: Start,
}

impl Setup {
    /// Returns the selected legs in the order of the robot, after checking the names, their number
    /// and the step.
    ///
    /// # Errors
    /// [`LeggedError::NoSuchLeg`], [`LeggedError::Legs`], [`LeggedError::Step`].
    pub fn selected_mounts<'r>(&self, robot: &'r Robot) -> Result<Vec<&'r LegMount>, LeggedError> {
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
                "{} legs exceed the maximum of {LEGS}",
                names.len()
            )));
        }
        if self.step == SimDuration::ZERO {
            return Err(LeggedError::Step);
        }
        let mounts = robot.legs.iter();
        Ok(mounts.filter(|mount| names.contains(&mount.name)).collect())
    }

    /// Returns the compliances of the selected legs.
    ///
    /// # Errors
    /// As [`Self::selected_mounts`], and [`LeggedError::Compliance`],
    /// [`LeggedError::Restitution`].
    pub fn compliances(&self, robot: &Robot) -> Result<Vec<Compliance>, LeggedError> {
        let restitution = self
            .ground
            .as_ref()
            .map_or(0.0, |ground| ground.restitution);
        if restitution > 0.0 {
            return Err(LeggedError::Restitution { restitution });
        }
        let mounts = self.selected_mounts(robot)?.into_iter();
        let compliance = |mount: &LegMount| {
            let leg = mount.name.clone();
            mount.leg.compliance.ok_or(LeggedError::Compliance { leg })
        };
        mounts.map(compliance).collect()
    }

    /// Returns the parts that have contact with the ground and that neither a fixed trunk nor the
    /// lengths of the legs keep from it.
    ///
    /// # Errors
    /// As [`Self::posture`].
    pub fn reaching_contacts(&self, robot: &Robot) -> Result<Contacts, LeggedError> {
        let Some(ground) = self
            .ground
            .as_ref()
            .filter(|_| self.contacts != Contacts::Feet)
        else {
            return Ok(Contacts::Feet);
        };
        if self.base != Base::Fixed {
            return Ok(self.contacts);
        }
        let height = self.posture(robot)?.position.z;
        let lowest_ankle = |mount: &LegMount| {
            let leg = &mount.leg;
            let beside = leg
                .abduction
                .map_or(0.0, |joint| 2.0 * (joint.offset.abs() + joint.height.abs()));
            height + mount.hip[2] - leg.l1 - leg.l2 - beside
        };
        let mounts = self.selected_mounts(robot)?;
        let reaches = |mount: &&LegMount| lowest_ankle(mount) < ground.greatest_height();
        let reach = self.contacts == Contacts::All && mounts.iter().any(reaches);
        Ok(if reach { Contacts::All } else { Contacts::Feet })
    }

    /// Returns the contact of the parts beyond the feet, of a robot that has one.
    ///
    /// # Errors
    /// [`LeggedError::NoContact`].
    pub fn contact(&self, robot: &Robot) -> Result<Contact, LeggedError> {
        let name = || robot.name.clone();
        let missing = || LeggedError::NoContact { robot: name() };
        robot.contact.ok_or_else(missing)
    }

    /// Checks that only the feet have contact with the ground, as `plant` requires.
    ///
    /// # Errors
    /// [`LeggedError::FeetOnly`].
    pub fn check_feet_only(&self, plant: &'static str) -> Result<(), LeggedError> {
        match self.contacts {
            Contacts::Feet => Ok(()),
            _ => Err(LeggedError::FeetOnly { plant }),
        }
    }

    /// Returns the selected legs, which have joints of abduction.
    ///
    /// # Errors
    /// As [`Self::selected_mounts`], and [`LeggedError::NoAbduction`].
    pub fn abducting_mounts<'r>(&self, robot: &'r Robot) -> Result<Vec<&'r LegMount>, LeggedError> {
        let mounts = self.selected_mounts(robot)?;
        match mounts.iter().find(|mount| mount.leg.abduction.is_none()) {
            Some(mount) => Err(LeggedError::NoAbduction {
                leg: mount.name.clone(),
            }),
            None => Ok(mounts),
        }
    }

    /// Returns the selected legs, with joints of abduction where these are not locked.
    ///
    /// # Errors
    /// As [`Self::abducting_mounts`].
    pub fn mounts<'r>(&self, robot: &'r Robot) -> Result<Vec<&'r LegMount>, LeggedError> {
        match self.abduction {
            Abduction::Locked => self.selected_mounts(robot),
            _ => self.abducting_mounts(robot),
        }
    }

    /// Checks that the joints of abduction are locked, as `plant` requires.
    ///
    /// # Errors
    /// [`LeggedError::AbductionLocked`].
    pub fn check_locked(&self, plant: &'static str) -> Result<(), LeggedError> {
        match self.abduction {
            Abduction::Locked => Ok(()),
            _ => Err(LeggedError::AbductionLocked { plant }),
        }
    }

    /// Returns the validated position servos of abduction, if any. Ideal ones have the inertia of
    /// the robot's servos.
    ///
    /// # Errors
    /// [`LeggedError::Servo`].
    pub fn abduction_servo(&self, robot: &Robot) -> Result<Option<PositionServo>, LeggedError> {
        let servo = match &self.abduction {
            Abduction::Locked | Abduction::Passive | Abduction::Serial => return Ok(None),
            Abduction::Ideal { period } => {
                let inertia = robot.actuators.abduction.map_or(0.0, |servo| servo.inertia);
                PositionServo::ideal(*period, inertia)
            }
            Abduction::Servos(servo) => PositionServo::new(servo),
        };
        let drive = "abduction";
        servo
            .map(Some)
            .map_err(|why| LeggedError::Servo { drive, why })
    }

    /// Returns the validated drives, if any. Ideal ones have the inertia of the robot's servos.
    ///
    /// # Errors
    /// [`LeggedError::Servo`], [`LeggedError::Motor`].
    pub fn drive_models(&self, robot: &Robot) -> Result<Option<DriveModels>, LeggedError> {
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
                return Ok(Some(DriveModels::Motors(Motors {
                    hip: LegMotor::Voltage(DcMotor::new(hip).map_err(of("hip"))?),
                    knee: LegMotor::Voltage(DcMotor::new(knee).map_err(of("knee"))?),
                    abduction: None,
                })));
            }
            Drives::Serial { servo, .. } => {
                let inertia = servo.motor.inertia;
                let [hip, knee] = [LegMotor::Line { inertia }; 2];
                let abduction = (self.abduction == Abduction::Serial).then_some(hip);
                return Ok(Some(DriveModels::Motors(Motors {
                    hip,
                    knee,
                    abduction,
                })));
            }
        };
        Ok(Some(DriveModels::Servos(Servos {
            hip: hip.map_err(of("hip"))?,
            knee: knee.map_err(of("knee"))?,
        })))
    }
}
