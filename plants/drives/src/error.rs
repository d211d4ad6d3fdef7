//! What is wrong with a bench.

use twinrig_actuator::{MotorError, ServoError};

/// Why a bench cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DrivesError {
    /// A leg twice: its signals would be, too.
    #[error("leg {0} is named twice")]
    Twice(String),
    /// A motor makes no motor.
    #[error("{drive} motor: {why}")]
    Motor {
        /// `hip` or `knee`.
        drive: &'static str,
        /// What is wrong.
        why: MotorError,
    },
    /// What hangs at a shaft cannot be.
    #[error("the {what} at the {drive} is {value} (SI units); it has to be zero or more")]
    Load {
        /// `hip` or `knee`.
        drive: &'static str,
        /// `inertia` or `friction`.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A servo makes no servo.
    #[error("abduction servo: {0}")]
    Servo(#[from] ServoError),
}

/// Refuses legs that are named twice.
pub(crate) fn once(legs: &[String]) -> Result<(), DrivesError> {
    let mut seen = legs.iter().enumerate();
    let twice = seen.find(|(i, leg)| legs[..*i].contains(leg));
    twice.map_or(Ok(()), |(_, leg)| Err(DrivesError::Twice(leg.clone())))
}
