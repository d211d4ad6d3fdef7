//! Drives of four legs, in lanes.

use twinrig_actuator::PositionServo;
use twinrig_legged::DriveModels;

use crate::lanes::Lanes;

/// Servo of all legs: the cascade of [`PositionServo`] with its torque–speed line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoLaw {
    speed: f64,
    per_speed: f64,
    per_lag: f64,
    gain: f64,
    dead_band: f64,
    torque: f64,
    inertia: f64,
}

impl From<&PositionServo> for ServoLaw {
    fn from(servo: &PositionServo) -> Self {
        Self {
            speed: servo.speed(),
            per_speed: 1.0 / servo.speed(),
            per_lag: 1.0 / servo.lag(),
            gain: servo.stiffness(),
            dead_band: servo.dead_band(),
            torque: servo.torque(),
            inertia: servo.inertia(),
        }
    }
}

impl ServoLaw {
    /// Returns the inertia at the output \[kg·m²\].
    #[inline(always)]
    pub const fn inertia(&self) -> f64 {
        self.inertia
    }

    /// Returns whether the torque has a limit.
    #[inline(always)]
    pub fn is_limited(&self) -> bool {
        self.torque.is_finite()
    }

    /// Returns the commanded acceleration \[rad/s²\], for a set-point and a position \[rad\] and a
    /// rate \[rad/s\].
    #[inline(always)]
    pub fn acceleration<L: Lanes>(&self, set_point: L, position: L, rate: L) -> L {
        let mut error = set_point - position;
        if self.dead_band > 0.0 {
            error = error.or(error.abs().gt(error.like(self.dead_band)), error.zero());
        }
        let speed = error.like(self.speed);
        ((error * self.per_lag).clamp(-speed, speed) - rate) * self.gain
    }

    /// Returns a torque limited by the torque–speed line of a direct-current motor at a rate: by τ
    /// clamp(1 ∓ q̇/q̇₀, 0, 1) \[N·m\].
    #[inline(always)]
    pub fn limited<L: Lanes>(&self, torque: L, rate: L) -> L {
        if !self.is_limited() {
            return torque;
        }
        let (zero, stall) = (rate.zero(), rate.like(self.torque));
        let lost = rate * (self.torque * self.per_speed);
        let most = (stall - lost).clamp(zero, stall);
        let least = (-stall - lost).clamp(-stall, zero);
        torque.clamp(least, most)
    }

    /// Returns the acceleration of a drive that has no inertia but its own, under a load \[N·m\]:
    /// the commanded one, within the limit of the torque \[rad/s²\].
    #[inline(always)]
    pub fn acceleration_under<L: Lanes>(&self, load: L, wanted: L, rate: L) -> L {
        let torque = self.limited(wanted * self.inertia + load, rate);
        (torque - load) * (1.0 / self.inertia)
    }
}

/// Laws of the drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveLaws {
    /// No drives, and no cable.
    None,
    /// Servos of hip and pulley.
    Servos {
        /// Servo of the hip.
        hip: ServoLaw,
        /// Servo of the pulley.
        knee: ServoLaw,
    },
    /// Inertias of hip and pulley \[kg·m²\].
    Motors([f64; 2]),
}

impl From<Option<&DriveModels>> for DriveLaws {
    fn from(drives: Option<&DriveModels>) -> Self {
        match drives {
            None => Self::None,
            Some(DriveModels::Servos(servos)) => Self::Servos {
                hip: ServoLaw::from(&servos.hip),
                knee: ServoLaw::from(&servos.knee),
            },
            Some(drives @ DriveModels::Motors(_)) => Self::Motors(drives.inertias()),
        }
    }
}

impl DriveLaws {
    /// Returns the inertias of the drives of hip and pulley \[kg·m²\].
    pub fn inertias(&self) -> [f64; 2] {
        match self {
            Self::None => [0.0; 2],
            Self::Servos { hip, knee } => [hip.inertia(), knee.inertia()],
            Self::Motors(inertias) => *inertias,
        }
    }
}
