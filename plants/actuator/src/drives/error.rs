//! Errors of test benches.

use crate::{MotorError, ServoError};

/// Reason why a bench cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DrivesError {
    /// A duplicate leg, whose signals would be duplicates, too.
    #[error("leg {0} is named twice")]
    DuplicateLeg(String),
    /// Invalid motor.
    #[error("{drive} motor: {why}")]
    Motor {
        /// `hip` or `knee`.
        drive: &'static str,
        /// Reason.
        why: MotorError,
    },
    /// Invalid load of a shaft.
    #[error("the {what} at the {drive} is {value} (SI units); it has to be zero or more")]
    Load {
        /// `hip` or `knee`.
        drive: &'static str,
        /// `inertia` or `friction`.
        what: &'static str,
        /// Value (SI).
        value: f64,
    },
    /// Invalid servo.
    #[error("abduction servo: {0}")]
    Servo(#[from] ServoError),
}

/// Rejects duplicate legs.
pub(crate) fn reject_duplicates(legs: &[String]) -> Result<(), DrivesError> {
    let mut entries = legs.iter().enumerate();
    let duplicate = entries.find(|(i, leg)| legs[..*i].contains(leg));
    duplicate.map_or(Ok(()), |(_, leg)| {
        Err(DrivesError::DuplicateLeg(leg.clone()))
    })
}
