//! Cheetah-cub's springs, friction and drives at another size.

use twinrig_robot::{Compliance, Contact, OneSided, Robot, RobotError, RobotFile, Servo, Spring};

use crate::quadruped::{Leg, Quadruped};

/// Robot whose values are scaled.
const BASE: &str = "cheetah-cub";

/// Greatest opening of the rod, and greatest preload, as shares of what the geometry allows.
const SHARE: f64 = 0.5;

/// Ratio of a robot to Cheetah-cub. With masses r times and lengths s times as large, stiffness is
/// r/s times as large: the static deflection under the weight, relative to the leg, is the same.
/// Time scales with √s.
pub(super) struct Scale {
    mass: f64,
    length: f64,
    /// Cheetah-cub's leg.
    pub(super) base: twinrig_robot::Leg,
    robot: Robot,
}

/// Springs of a leg, and its lengths that depend on them.
pub(super) struct Springs {
    pub(super) diagonal: Spring,
    pub(super) parallel: Spring,
    pub(super) parallel_travel: f64,
    pub(super) diagonal_min: f64,
}

impl Scale {
    /// # Errors
    /// None: every build contains the file of Cheetah-cub.
    pub(super) fn of(quadruped: &Quadruped) -> Result<Self, RobotError> {
        let mut texts = RobotFile::embedded().iter();
        let cheetah_cub = texts.find(|(name, _)| *name == BASE);
        let (_, text) = cheetah_cub.ok_or_else(|| RobotError::NotFound {
            name: BASE.to_owned(),
            help: "this build does not contain it".to_owned(),
        })?;
        let robot = RobotFile::parse(BASE, text)?.robot()?;
        let base = robot.legs[0].leg.clone();
        let legs = quadruped.legs.iter();
        let mass = |leg: &Leg| leg.masses.iter().sum::<f64>() + leg.foot.unwrap_or(0.0);
        let total = quadruped.trunk.mass + legs.clone().map(mass).sum::<f64>();
        let lengths = legs.clone().map(|leg| leg.lengths.iter().sum::<f64>());
        let length = lengths.sum::<f64>() / legs.count().max(1) as f64;
        Ok(Self {
            mass: total / robot.mass(),
            length: length / (base.l1 + base.l2 + base.l3 - base.l_delta),
            base,
            robot,
        })
    }

    pub(super) fn length(&self, length: f64) -> f64 {
        self.length * length
    }

    fn stiffness(&self, stiffness: f64) -> f64 {
        stiffness * self.mass / self.length
    }

    /// Returns springs and lengths that make a pantograph.
    pub(super) fn springs(&self, leg: &Leg) -> Springs {
        let l2 = leg.lengths[1];
        let offset = leg.l_delta;
        let diagonal = |angle: f64| {
            let product = 2.0 * l2 * offset * libm::cos(angle);
            (l2 * l2 + offset * offset + product).sqrt()
        };
        let stretched = diagonal(leg.bend.stretched);
        let spring = |spring: Spring, most: f64| Spring {
            stiffness: self.stiffness(spring.stiffness),
            preload: self.length(spring.preload).min(SHARE * most),
        };
        let travel = self.length(self.base.parallel_travel);
        Springs {
            diagonal: spring(self.base.diagonal, l2),
            parallel: spring(self.base.parallel, l2),
            parallel_travel: travel.min(SHARE * (stretched + offset - l2)),
            diagonal_min: diagonal(leg.bend.bottomed),
        }
    }

    /// Returns the viscous friction of hip, knee and ankle \[N·m·s/rad\].
    pub(super) fn friction(&self) -> [f64; 3] {
        let friction = self.base.joint_friction;
        let scale = self.mass * self.length * self.length.sqrt();
        [friction.hip, friction.knee, friction.ankle].map(|friction| friction * scale)
    }

    /// Returns the contact of trunk, knees and ankles.
    pub(super) fn contact(&self) -> Option<Contact> {
        let base = self.robot.contact?;
        let element = self.side(base.element());
        Some(Contact {
            stiffness: element.stiffness,
            damping: element.damping,
            toe_region: element.toe_region,
            slip_deflection: self.length(base.slip_deflection),
        })
    }

    fn side(&self, side: OneSided) -> OneSided {
        OneSided {
            stiffness: self.stiffness(side.stiffness),
            damping: side.damping * self.mass / self.length.sqrt(),
            toe_region: self.length(side.toe_region),
        }
    }

    pub(super) fn compliance(&self) -> Option<Compliance> {
        let base = self.base.compliance?;
        Some(Compliance {
            stops: self.side(base.stops),
            cable: self.side(base.cable),
            sole: self.side(base.sole),
            slip_deflection: self.length(base.slip_deflection),
        })
    }

    /// Returns the servo of the hip (0) or of the knee.
    pub(super) fn servo(&self, index: usize) -> Servo {
        let actuators = &self.robot.actuators;
        let servo = if index == 0 {
            actuators.hip
        } else {
            actuators.knee
        };
        let time = self.length.sqrt();
        Servo {
            torque: servo.torque * self.mass * self.length,
            speed: servo.speed / time,
            lag: servo.lag * time,
            dead_band: servo.dead_band,
            inertia: servo.inertia * self.mass * self.length * self.length,
        }
    }
}
